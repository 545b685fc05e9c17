//! Fewer beams: at most one for each of so many directions.
//!
//! For sensors that measure more finely than the memory or the matcher wants, in front of the assembler. A direction is
//! an equal part of a turn, counted from forward. Of the beams that follow each other into one direction, one stays
//! with its own bearing, range and time; nothing is averaged. A direction that no beam meets stays empty.

use super::Beam;

/// Which beam of a direction stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Keep {
    /// The first with a range. Its error is the sensor's: for matching.
    First,
    /// The nearest. Of several noisy ranges the smallest, so about a standard deviation too near: for obstacles.
    Nearest,
}

/// A turn in equal directions, of which each passes one beam on. 28 bytes.
#[derive(Debug, Clone)]
pub struct Decimator {
    directions: u16,
    keep: Keep,
    /// The beam to pass on, and whether a turn starts with it.
    held: Option<(Beam, bool)>,
    dropped: u32,
}

impl Decimator {
    /// So many directions a turn; 0 is taken as 1.
    #[must_use]
    pub const fn new(directions: u16, keep: Keep) -> Self {
        Self {
            directions: if directions == 0 { 1 } else { directions },
            keep,
            held: None,
            dropped: 0,
        }
    }

    /// Takes the next beam; gives the one that stays of the direction just left, and whether a turn starts with it.
    pub fn push(&mut self, beam: Beam, turn_starts: bool) -> Option<(Beam, bool)> {
        match &mut self.held {
            Some((held, _))
                if !turn_starts
                    && direction(self.directions, held) == direction(self.directions, &beam) =>
            {
                self.dropped = self.dropped.wrapping_add(1);
                let is_better = match (held.range.mm(), beam.range.mm()) {
                    (Err(_), Ok(_)) => true,
                    (Ok(held), Ok(next)) => self.keep == Keep::Nearest && next < held,
                    _ => false,
                };
                if is_better {
                    *held = beam;
                }
                None
            }
            held => held.replace((beam, turn_starts)),
        }
    }

    /// Beams that gave way to another of their direction; wraps.
    #[must_use]
    pub fn dropped_beams(&self) -> u32 {
        self.dropped
    }
}

fn direction(directions: u16, beam: &Beam) -> u32 {
    (u32::from(beam.bearing.0) * u32::from(directions)) >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Bearing, Range};

    fn pass(keep: Keep, beams: &[(u16, u32, bool)]) -> heapless::Vec<(u16, u16, bool), 16> {
        let mut decimator = Decimator::new(16, keep);
        let mut passed = heapless::Vec::new();
        for (k, &(bearing, mm, starts)) in beams.iter().enumerate() {
            let beam = Beam {
                bearing: Bearing(bearing),
                range: Range::from_mm(mm),
                time_us: k as u32,
                quality: 0,
            };
            if let Some((beam, starts)) = decimator.push(beam, starts) {
                let mm = beam.range.mm().unwrap_or(0);
                passed
                    .push((beam.time_us as u16, mm, starts))
                    .expect("room");
            }
        }
        assert_eq!(
            decimator.dropped_beams() as usize + passed.len() + 1,
            beams.len()
        );
        passed
    }

    #[test]
    fn one_beam_of_a_direction_stays() {
        // Four directions of 4096, met by three, one, two and again one beam.
        let beams = [
            (100, 0, true),
            (200, 900, false),
            (300, 800, false),
            (5000, 700, false),
            (8200, 600, false),
            (8300, 650, false),
            (12_300, 500, false),
            (12_400, 400, true),
            (60_000, 1, false),
        ];
        let first = pass(Keep::First, &beams);
        assert_eq!(
            first,
            [
                (1, 900, true),
                (3, 700, false),
                (4, 600, false),
                (6, 500, false),
                (7, 400, true)
            ]
        );
        let nearest = pass(Keep::Nearest, &beams);
        assert_eq!(
            nearest,
            [
                (2, 800, true),
                (3, 700, false),
                (4, 600, false),
                (6, 500, false),
                (7, 400, true)
            ]
        );
    }
}
