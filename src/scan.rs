//! One revolution of beams, and what a matcher needs of it.

#[cfg(not(feature = "internals"))]
pub(crate) mod assembler;
#[cfg(feature = "internals")]
pub mod assembler;
#[cfg(not(feature = "internals"))]
pub(crate) mod beam;
#[cfg(feature = "internals")]
pub mod beam;
#[cfg(not(feature = "internals"))]
pub(crate) mod decimator;
#[cfg(feature = "internals")]
pub mod decimator;
mod deskew;
#[cfg(not(feature = "internals"))]
pub(crate) mod mount;
#[cfg(feature = "internals")]
pub mod mount;
mod point;
#[cfg(not(feature = "internals"))]
pub(crate) mod points;
#[cfg(feature = "internals")]
pub mod points;
pub(crate) mod slots;
pub(crate) mod surface;
pub(crate) mod thinning;
pub(crate) mod wide;

pub use assembler::Assembler;
pub use beam::{Beam, Bearing, NoReturn, Range};
pub use mount::Mount;
pub use point::ScanPoint;
pub use points::{Points, PointsConfig};

use heapless::Vec;

/// The beams of one revolution in the order in which the lidar hands them over, each with its own time.
///
/// 8·N + 32 bytes. N is the most beams a revolution may have; further ones are refused and counted by who pushes.
#[derive(Debug, Clone)]
pub struct Scan<const N: usize> {
    beams: Vec<Stored, N>,
    start_us: u32,
    end_us: u32,
    /// The latest time but one.
    before_us: u32,
    /// Index of the beam of `end_us`.
    latest: u16,
    /// Beams removed because their times stood alone.
    outliers: u16,
}

/// A beam as it is kept: 8 bytes instead of 12.
#[derive(Debug, Clone, Copy)]
struct Stored {
    bearing: Bearing,
    range: Range,
    /// Time since the scan's start (16 µs).
    age: u16,
    quality: u8,
}

impl<const N: usize> Scan<N> {
    /// No beams.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            beams: Vec::new(),
            start_us: 0,
            end_us: 0,
            before_us: 0,
            latest: 0,
            outliers: 0,
        }
    }

    /// Forgets all beams.
    pub fn clear(&mut self) {
        self.beams.clear();
        self.outliers = 0;
    }

    /// Appends a beam, measured before or after the others: interleaving lidars and reversed arrays hand them over in
    /// another order than that of time.
    ///
    /// # Errors
    /// 0 for a scan that is full; how long (µs) from the scan's first beam one was measured that is more than 1.04 s from
    /// another one: a clock that jumped, or another revolution.
    pub fn push(&mut self, beam: Beam) -> Result<(), u32> {
        if self.beams.is_empty() {
            (self.start_us, self.end_us) = (beam.time_us, beam.time_us);
            (self.latest, self.before_us) = (0, beam.time_us);
        }
        self.remove_outlier(beam.time_us);
        let after = beam.time_us.wrapping_sub(self.start_us);
        let before = self.start_us.wrapping_sub(beam.time_us);
        let earlier = if before < after { before } else { 0 };
        let after = if earlier > 0 { 0 } else { after };
        // From the earliest to the latest beam.
        let span = self.end_us.wrapping_sub(self.start_us);
        if span.wrapping_add(earlier).max(after) >> 4 > u32::from(u16::MAX) {
            let micros = earlier.max(after);
            return Err(micros);
        }
        let stored = Stored {
            bearing: beam.bearing,
            range: beam.range,
            age: (after >> 4) as u16,
            quality: beam.quality,
        };
        self.beams.push(stored).map_err(|_| 0_u32)?;
        if earlier > 0 {
            // What was the first beam is not any more: all others are older by that much.
            if let Some((_, others)) = self.beams.split_last_mut() {
                for other in others {
                    other.age = other.age.saturating_add((earlier >> 4) as u16);
                }
            }
            self.start_us = beam.time_us;
        } else if after >= span {
            self.before_us = self.end_us;
            self.end_us = beam.time_us;
            self.latest = self.beams.len() as u16 - 1;
        } else if after > self.before_us.wrapping_sub(self.start_us) {
            self.before_us = beam.time_us;
        }
        Ok(())
    }

    /// Removes the latest beam if it stands alone: long after all others, and long after one of `time_us` that was
    /// measured next.
    fn remove_outlier(&mut self, time_us: u32) {
        /// Longer than from one turn of an interleaving mirror to the next but two (µs).
        const LONG: u32 = 50_000;
        let alone = self.end_us.wrapping_sub(self.before_us) > LONG;
        let ahead = self.end_us.wrapping_sub(time_us);
        if alone && ahead > LONG && ahead < 1 << 31 && self.beams.len() > 2 {
            // Those after it move up; `Vec::remove` could panic.
            let mut next = self.beams.pop();
            let after = self.beams.get_mut(usize::from(self.latest)..);
            for beam in after.into_iter().flatten().rev() {
                next = next.map(|next| core::mem::replace(beam, next));
            }
            self.end_us = self.before_us;
            self.outliers = self.outliers.wrapping_add(1);
            // Which of the others is the latest matters only until a later one comes.
            self.latest = 0;
        }
    }

    /// Whether a beam of this time (µs) is less than 1.04 s younger than the first, or the first itself.
    pub(crate) fn reaches(&self, time_us: u32) -> bool {
        self.is_empty() || time_us.wrapping_sub(self.start_us) >> 4 <= 0xffff
    }

    /// Number of beams, with or without a return.
    #[must_use]
    pub fn len(&self) -> usize {
        self.beams.len()
    }

    /// Whether there is no beam.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.beams.is_empty()
    }

    /// The beams in the order in which they were pushed, their times to 16 µs.
    pub fn beams(&self) -> impl ExactSizeIterator<Item = Beam> + DoubleEndedIterator + Clone + '_ {
        self.beams.iter().map(|stored| Beam {
            bearing: stored.bearing,
            range: stored.range,
            time_us: self.start_us.wrapping_add(u32::from(stored.age) << 4),
            quality: stored.quality,
        })
    }

    /// The beams as they are kept.
    fn stored(&self) -> &[Stored] {
        &self.beams
    }

    /// Age of the latest beam (16 µs).
    fn last_age(&self) -> u16 {
        (self.end_us.wrapping_sub(self.start_us) >> 4) as u16
    }

    /// Time of the earliest beam (µs, the sensor's or the driver's clock, wrapping).
    #[must_use]
    pub fn start_us(&self) -> u32 {
        self.start_us
    }

    /// Time of the latest beam (µs, same clock).
    #[must_use]
    pub fn end_us(&self) -> u32 {
        self.end_us
    }

    /// Time from the earliest to the latest beam (s).
    #[must_use]
    pub(crate) fn duration(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        self.end_us.wrapping_sub(self.start_us) as f32 * 1e-6
    }
}

impl<const N: usize> Default for Scan<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(degrees: f32, metres: f32, time_us: u32) -> Beam {
        Beam {
            bearing: Bearing::from_radians(degrees.to_radians()),
            range: Range::from_metres(metres),
            time_us,
            quality: 7,
        }
    }

    #[test]
    fn beams_come_back_in_order_with_their_times() {
        let mut scan = Scan::<3>::new();
        let start = u32::MAX - 50;
        for k in 0..3 {
            scan.push(beam(k as f32, 1.0, start.wrapping_add(160 * k)))
                .expect("room");
        }
        let late = beam(3.0, 1.0, 0);
        assert_eq!(scan.push(late), Err(0));
        let times: [u32; 3] = core::array::from_fn(|k| scan.beams().nth(k).expect("beam").time_us);
        assert_eq!(
            times,
            [start, start.wrapping_add(160), start.wrapping_add(320)]
        );
        assert_eq!(scan.duration(), 320e-6);
        scan.clear();
        assert!(scan.is_empty() && scan.duration() == 0.0);
    }

    #[test]
    fn times_may_come_in_any_order() {
        let orders: [[u32; 4]; 3] = [
            [0, 1600, 3200, 4800],
            [4800, 3200, 1600, 0],
            [1600, 4800, 0, 3200],
        ];
        for times in orders {
            let start = u32::MAX - 2000;
            let mut scan = Scan::<4>::new();
            for time in times {
                scan.push(beam(0.0, 1.0, start.wrapping_add(time)))
                    .expect("room");
            }
            let kept: [u32; 4] = core::array::from_fn(|k| {
                let time = scan.beams().nth(k).map(|beam| beam.time_us);
                time.expect("beam").wrapping_sub(start)
            });
            assert_eq!(kept, times);
            assert_eq!(scan.start_us(), start, "{times:?}");
            assert!((scan.duration() - 4800e-6).abs() < 1e-9, "{times:?}");
        }
    }

    #[test]
    fn one_late_beam_does_not_make_the_scan_longer() {
        let mut scan = Scan::<8>::new();
        for time in [0, 1000, 2000, 203_000, 4000, 5000, 6000] {
            scan.push(beam(0.0, 1.0, time)).expect("room");
        }
        assert_eq!((scan.len(), scan.outliers), (6, 1));
        assert_eq!(scan.end_us(), 6000);
    }

    #[test]
    fn a_beam_of_another_time_is_refused_with_its_number() {
        let mut scan = Scan::<4>::new();
        scan.push(beam(0.0, 1.0, 7_000_000)).expect("room");
        for time in [2_000_000, 12_000_000] {
            let micros = 5_000_000;
            assert_eq!(scan.push(beam(0.0, 1.0, time)), Err(micros));
        }
        // Together they would span more than a scan can.
        scan.push(beam(0.0, 1.0, 7_600_000)).expect("room");
        let early = scan.push(beam(0.0, 1.0, 6_400_000));
        assert_eq!(early, Err(600_000));
        assert_eq!(scan.len(), 2);
    }
}
