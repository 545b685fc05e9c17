//! Times of a lidar's clock as times of this computer's.

use std::collections::VecDeque;

use host_tests::decode::Unwrapped;

/// Messages among which the one that was least late is looked for: a few seconds, in which two crystals part by less than a
/// millisecond.
const WINDOW: usize = 64;
/// A clock this much later than thought (ns) has started again.
const RESTART_NS: i64 = 1_000_000_000;

/// Tells when a message of the board was measured from when it came: the line and the match make it late, never early, so
/// what lies between the clocks is the least that was seen lately.
#[derive(Debug, Default)]
pub struct Clock {
    lidar: Unwrapped,
    /// This computer's time less the lidar's (ns) of the last messages.
    offsets: VecDeque<i64>,
    last_ns: i64,
}

impl Clock {
    /// This computer's time (ns) of `lidar_us`, which came at `now_ns`; later than every one before.
    pub fn stamp(&mut self, lidar_us: u32, now_ns: i64) -> i64 {
        let lidar_ns = 1000 * self.lidar.at(lidar_us) as i64;
        let offset = now_ns - lidar_ns;
        if let Some(&least) = self.offsets.iter().min()
            && offset > least + RESTART_NS
        {
            self.offsets.clear();
        }
        if self.offsets.len() == WINDOW {
            self.offsets.pop_front();
        }
        self.offsets.push_back(offset);
        let least = self.offsets.iter().min().copied().unwrap_or(offset);
        self.last_ns = (lidar_ns + least).max(self.last_ns + 1);
        self.last_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn late_messages_are_stamped_with_when_they_were_measured() {
        let mut clock = Clock::default();
        let late = [30, 3, 8, 40, 3, 5];
        let stamps: Vec<i64> = (0..)
            .zip(late)
            .map(|(k, late)| clock.stamp(100_000 * k as u32, (1_000 + 100 * k + late) * MS))
            .collect();
        // The first cannot be known to be late; from the second on, 3 ms are on each.
        let expected = [1030, 1103, 1203, 1303, 1403, 1503].map(|ms| ms * MS);
        assert_eq!(stamps, expected);
    }

    #[test]
    fn a_clock_that_wraps_goes_on_and_one_that_restarts_is_taken_anew() {
        let mut clock = Clock::default();
        let before = u32::MAX - 49_999;
        assert_eq!(clock.stamp(before, 5_000 * MS), 5_000 * MS);
        assert_eq!(
            clock.stamp(before.wrapping_add(100_000), 5_100 * MS),
            5_100 * MS
        );
        // Ten seconds without power; its clock begins at zero.
        let mut clock = Clock::default();
        clock.stamp(60_000_000, 5_000 * MS);
        assert_eq!(clock.stamp(0, 15_000 * MS), 15_000 * MS);
        assert_eq!(clock.stamp(100_000, 15_100 * MS), 15_100 * MS);
    }

    #[test]
    fn stamps_never_step_back() {
        let mut clock = Clock::default();
        clock.stamp(0, 1_200 * MS);
        // This one tells that the first was 200 ms late.
        assert_eq!(clock.stamp(100_000, 1_100 * MS), 1_200 * MS + 1);
    }
}
