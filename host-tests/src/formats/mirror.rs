//! When a SICK measured each reading of a scan of which only one time is known.
//!
//! Its mirror turns in 13.3 ms and takes a reading a degree. A scan of half degrees is two turns laid into each other: the odd
//! readings are the second one's. One of quarter degrees is four.

/// Turns of the mirror that a scan took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mirror {
    turns: usize,
    count: usize,
}

/// A turn of the mirror, and the time in which it turns by a degree (µs).
const TURN_US: usize = 13_333;
const DEGREE_US: usize = 37;

impl Mirror {
    /// For `count` readings `step` (rad) apart: 360 or 361 of half a degree, 400 or 401 of a quarter are a SICK's. All others
    /// are taken to be measured at once.
    #[must_use]
    pub fn of(count: usize, step: f64) -> Self {
        let turns = match (count, libm::round(step.to_degrees() * 400.0)) {
            (360 | 361, 200.0) => 2,
            (400 | 401, 100.0) => 4,
            _ => 1,
        };
        Self { turns, count }
    }

    /// Time (µs) from the `k`-th reading to the scan's last one.
    #[must_use]
    pub fn age_us(self, k: usize) -> u32 {
        if self.turns == 1 {
            return 0;
        }
        let taken = |k: usize| TURN_US * (k % self.turns) + DEGREE_US * (k / self.turns);
        // The last of the last turn.
        let last = (0..self.turns).filter_map(|back| self.count.checked_sub(1 + back));
        (last.map(taken).max().unwrap_or(0) - taken(k)) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_half_degrees_are_a_turn_of_the_mirror_later() {
        let half = Mirror::of(361, 0.5f64.to_radians());
        assert_eq!(half.age_us(359), 0);
        assert_eq!(half.age_us(0), 13_333 + 179 * 37);
        assert_eq!(half.age_us(1), 179 * 37);
        assert_eq!(half.age_us(2) + 37, half.age_us(0));
        let quarter = Mirror::of(401, 0.25f64.to_radians());
        assert_eq!(quarter.age_us(4) - quarter.age_us(5), 13_333);
        assert_eq!((0..401).map(|k| quarter.age_us(k)).min(), Some(0));
        for (count, step) in [(181, 1.0f64), (360, 1.0), (720, 0.5), (541, 0.5)] {
            let other = Mirror::of(count, step.to_radians());
            assert!((0..count).all(|k| other.age_us(k) == 0), "{count} {step}");
        }
    }
}
