//! Beams one after the other to whole revolutions of the lidar.

use super::{Beam, Bearing, Scan};

/// Collects the beams of one revolution after the other.
///
/// Each beam keeps its own bearing, range and time; nothing is binned. 8·N + 64 bytes: one scan, and the one beam
/// that is already the next revolution's when a revolution is complete.
/// A revolution whose start was lost on the line ends by itself: it counts as begun when the beams have swept 370° since
/// the last start. One whose beams are more than 1.04 s apart was interrupted, by a cable or a motor: the robot is
/// elsewhere by now, so these beams are refused, and the next whole revolution is the first one reported.
///
/// ```
/// # use beamfix::scan::{Assembler, Beam, Bearing, Range};
/// let mut assembler = Assembler::<16>::new();
/// for k in 0..20u32 {
///     let beam = Beam { bearing: Bearing(0), range: Range::from_mm(1000), time_us: 100 * k, quality: 0 };
///     let ready = assembler.push(beam, k % 8 == 3);
///     assert_eq!(ready, k == 11 || k == 19);
///     if ready {
///         assert_eq!(assembler.scan().len(), 8);
///     }
/// }
/// ```
#[derive(Debug, Clone)]
pub struct Assembler<const N: usize> {
    scan: Scan<N>,
    state: State,
    starts: Starts,
    refused: u32,
}

/// Tells where revolutions start: where the sensor says so, and where it should have.
///
/// A lost start would make one revolution of two. So one counts as begun when the beams have swept 370° since the last:
/// most sensors put their zero a little elsewhere in each revolution. 8 bytes.
#[derive(Debug, Clone, Copy)]
struct Starts {
    last: Bearing,
    /// Angle since the last revolution began (1/65 536 turn).
    swept: i32,
}

impl Starts {
    const TURN: i32 = 1 << 16;

    /// Before the first beam.
    const fn new() -> Self {
        Self {
            last: Bearing(0),
            swept: 0,
        }
    }

    /// Takes the next beam's bearing and what the sensor says; tells whether a revolution starts with it.
    fn push(&mut self, bearing: Bearing, says_so: bool) -> bool {
        let step = bearing.0.wrapping_sub(self.last.0).cast_signed();
        self.last = bearing;
        // Also a sensor that turns to and fro stays within these bounds.
        self.swept = self.swept.saturating_add(step.into());
        if says_so {
            self.swept = 0;
        } else if self.swept.unsigned_abs() > (Self::TURN / 36 * 37).unsigned_abs() {
            self.swept -= Self::TURN * self.swept.signum();
            return true;
        }
        says_so
    }
}

#[derive(Debug, Clone, Copy)]
enum State {
    /// The first revolution is incomplete: nobody knows how much of it is missing.
    Partial,
    /// The scan began with a revolution.
    Whole,
    /// The scan is a whole revolution; this beam is the next one's first.
    Ready(Beam),
}

impl<const N: usize> Assembler<N> {
    /// No beams.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            scan: Scan::new(),
            state: State::Partial,
            starts: Starts::new(),
            refused: 0,
        }
    }

    /// Takes the beams of a packet in order and gives every revolution that they complete to `ready`.
    ///
    /// `start` is the number of the beam that is the first of a revolution, if there is one, as the packet's
    /// `revolution_start` says.
    pub fn push_packet(
        &mut self,
        beams: impl Iterator<Item = Beam>,
        start: Option<usize>,
        mut ready: impl FnMut(&Scan<N>),
    ) {
        for (k, beam) in beams.enumerate() {
            if self.push(beam, start == Some(k)) {
                ready(&self.scan);
            }
        }
    }

    /// Takes the beams of a whole revolution at once, in place of the present one: [`Assembler::scan`] then has them.
    pub fn assign(&mut self, beams: impl Iterator<Item = Beam>) {
        self.restart();
        beams.for_each(|beam| self.keep(beam));
    }

    /// Takes the next beam; `true` when [`Assembler::scan`] is a whole revolution.
    ///
    /// `starts` says that this beam is the first of a revolution. The scan stays until the next push.
    pub fn push(&mut self, beam: Beam, starts: bool) -> bool {
        let starts = self.starts.push(beam.bearing, starts);
        if let State::Ready(first) = self.state {
            self.scan.clear();
            self.keep(first);
            self.state = State::Whole;
        }
        if matches!(self.state, State::Whole) && !starts && !self.scan.reaches(beam.time_us) {
            self.refused = self.refused.wrapping_add(self.scan.len() as u32);
            self.restart();
        }
        match self.state {
            State::Whole if starts => {
                self.state = State::Ready(beam);
                return true;
            }
            State::Partial if starts => {
                self.scan.clear();
                self.state = State::Whole;
            }
            State::Partial => return false,
            State::Whole | State::Ready(_) => {}
        }
        self.keep(beam);
        false
    }

    /// The revolution that the last push completed, or what there is of the present one.
    #[must_use]
    pub fn scan(&self) -> &Scan<N> {
        &self.scan
    }

    /// Beams that found no room because a revolution had more than N, and the beams of interrupted revolutions; wraps.
    #[must_use]
    pub fn refused_beams(&self) -> u32 {
        self.refused
    }

    /// Forgets the present revolution: after a pause, the next whole one is the first one reported.
    pub fn restart(&mut self) {
        self.scan.clear();
        self.state = State::Partial;
        self.starts = Starts::new();
    }

    /// As new.
    pub(crate) fn reset(&mut self) {
        self.restart();
        self.refused = 0;
    }

    fn keep(&mut self, beam: Beam) {
        if self.scan.push(beam).is_err() {
            self.refused = self.refused.wrapping_add(1);
        }
    }
}

impl<const N: usize> Default for Assembler<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Bearing, Range};

    fn beam(k: u32) -> Beam {
        Beam {
            bearing: Bearing(k as u16),
            range: Range::from_mm(1000 + k),
            time_us: 160 * k,
            quality: 1,
        }
    }

    #[test]
    fn every_beam_of_every_whole_revolution_is_kept_once() {
        let mut assembler = Assembler::<8>::new();
        let mut next = 3;
        for k in 0..40 {
            if assembler.push(beam(k), k % 5 == 3) {
                for got in assembler.scan().beams() {
                    assert_eq!(got, beam(next));
                    next += 1;
                }
                assert_eq!(next, k);
            }
        }
        assert_eq!((next, assembler.refused_beams()), (38, 0));
    }

    #[test]
    fn a_revolution_without_its_start_ends_by_itself() {
        // Both ways around, beams 5° apart; every 72nd starts a revolution, some of these are lost.
        for sense in [1u16, u16::MAX] {
            let mut assembler = Assembler::<80>::new();
            let mut lengths = heapless::Vec::<_, 12>::new();
            for k in 0..700u32 {
                let bearing = Bearing((k as u16).wrapping_mul(910).wrapping_mul(sense));
                let starts = k % 72 == 0 && !(200..450).contains(&k);
                if assembler.push(Beam { bearing, ..beam(k) }, starts) {
                    lengths.push(assembler.scan().len()).expect("room");
                }
            }
            assert_eq!(lengths, [72, 72, 75, 72, 72, 72, 69, 72, 72], "{sense}");
        }
    }

    #[test]
    fn what_does_not_fit_is_counted() {
        let mut assembler = Assembler::<4>::new();
        let mut turns = 0;
        for k in 0..21 {
            if assembler.push(beam(k), k % 10 == 0) {
                assert_eq!(assembler.scan().len(), 4);
                turns += 1;
            }
        }
        assert_eq!((turns, assembler.refused_beams()), (2, 12));
    }

    #[test]
    fn an_interrupted_revolution_is_refused() {
        // Eight beams a revolution, 160 µs apart; none came for a while after beam `last`.
        for (pause_us, last, lengths, refused) in [
            (1_040_000, 11, [8, 8, 8].as_slice(), 0),
            (1_060_000, 11, &[8, 8], 4),
            // Between two revolutions, and after the first beam of one.
            (1_060_000, 15, &[8, 8, 8], 0),
            (1_060_000, 16, &[8, 8], 1),
            // Back to an earlier time: the clock started over.
            (0u32.wrapping_sub(2000), 11, &[8, 8], 4),
        ] {
            let mut assembler = Assembler::<8>::new();
            let mut got = heapless::Vec::<_, 4>::new();
            for k in 0..32 {
                let mut beam = beam(k);
                if k > last {
                    beam.time_us = beam.time_us.wrapping_add(pause_us);
                }
                if assembler.push(beam, k % 8 == 0) {
                    got.push(assembler.scan().len()).expect("room");
                    assert!(assembler.scan().duration() < 1.06);
                }
            }
            assert_eq!(
                (got.as_slice(), assembler.refused_beams()),
                (lengths, refused),
                "{pause_us} after {last}"
            );
        }
    }

    #[test]
    fn revolutions_of_a_single_beam_and_a_restart() {
        let mut assembler = Assembler::<4>::new();
        let ready: [bool; 4] = core::array::from_fn(|k| assembler.push(beam(k as u32), true));
        assert_eq!(ready, [false, true, true, true]);
        assert_eq!(assembler.scan().beams().next(), Some(beam(2)));
        assembler.restart();
        assert!(assembler.scan().is_empty());
        assert!(!assembler.push(beam(9), false) && assembler.scan().is_empty());
    }
}
