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

/// The beams of one revolution in the order in which they were measured.
///
/// 8·N + 24 bytes. N is the most beams a revolution may have; further ones are refused and counted by who pushes.
#[derive(Debug, Clone)]
pub struct Scan<const N: usize> {
    beams: Vec<Stored, N>,
    start_us: u32,
    end_us: u32,
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
        }
    }

    /// Forgets all beams.
    pub fn clear(&mut self) {
        self.beams.clear();
    }

    /// Appends a beam; gives it back where the scan is full.
    ///
    /// The first beam sets the scan's start. A time more than 1.04 s after it is kept as 1.04 s.
    pub fn push(&mut self, beam: Beam) -> Result<(), Beam> {
        let start_us = if self.beams.is_empty() {
            beam.time_us
        } else {
            self.start_us
        };
        let age = beam.time_us.wrapping_sub(start_us) >> 4;
        let stored = Stored {
            bearing: beam.bearing,
            range: beam.range,
            age: if age > 0xffff { 0xffff } else { age as u16 },
            quality: beam.quality,
        };
        self.beams.push(stored).map_err(|_| beam)?;
        self.start_us = start_us;
        self.end_us = beam.time_us;
        Ok(())
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

    /// The beams in the order of measurement, their times to 16 µs.
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

    /// Age of the last beam (16 µs).
    fn last_age(&self) -> u16 {
        self.beams.last().map_or(0, |beam| beam.age)
    }

    /// Time of the first beam (µs, the sensor's or the driver's clock, wrapping).
    #[must_use]
    pub fn start_us(&self) -> u32 {
        self.start_us
    }

    /// Time of the last beam (µs, same clock).
    #[must_use]
    pub fn end_us(&self) -> u32 {
        self.end_us
    }

    /// Time from the first to the last beam (s).
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
        assert_eq!(scan.push(late), Err(late));
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
    fn a_late_beam_is_kept_at_the_last_time_there_is() {
        let mut scan = Scan::<2>::new();
        scan.push(beam(0.0, 1.0, 0)).expect("room");
        scan.push(beam(0.0, 1.0, 5_000_000)).expect("room");
        assert_eq!(scan.beams().nth(1).expect("beam").time_us, 0xffff << 4);
    }
}
