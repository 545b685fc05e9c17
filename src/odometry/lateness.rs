//! How late the wheels tell that the robot turns faster or slower, learned from matches.

use crate::math;

/// What the wheels miss of a change of the rate of turn.
///
/// Wheels that are read late, seldom or at jittering moments tell the right way in the end, but not what the robot does
/// during this very scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lateness {
    /// Rotation from the middle of the scan before the last to the middle of the last, less what the wheels said (rad).
    missed: f32,
    /// Sum of the squared changes of `missed` from scan to scan, fading (rad²); 0 before the first.
    squares: f32,
    /// The same of the changes of the rotation during a scan.
    changes: f32,
}

impl Lateness {
    /// Share of a sum that each scan takes from it: it has faded to a third after 20.
    const FADING: f32 = 0.05;

    /// Nothing compared yet.
    pub const UNKNOWN: Self = Self {
        missed: 0.0,
        squares: 0.0,
        changes: 0.0,
    };

    /// Takes in the rotation (rad) that the wheels missed between the middles of the last scan and this one, while the rotation
    /// during a scan changed by `change`: how much more or less they missed than before. Errors in proportion to the motion are
    /// the same in each scan of a steady turn.
    ///
    /// `unforeseen` is the variance of the heading at a scan's end (rad²) by accelerations that nobody foresees: until they have
    /// shown better, wheels are taken to miss that much.
    pub fn push(&mut self, missed: f32, change: f32, unforeseen: f32) -> f32 {
        if self.squares <= 0.0 {
            self.squares = unforeseen / Self::FADING;
            self.changes = self.squares;
        }
        let more = missed - self.missed;
        self.missed = missed;
        self.squares += more * more - Self::FADING * self.squares;
        self.changes += change * change - Self::FADING * self.changes;
        more
    }

    /// Squared share of a change of the rate of turn that they miss: 1 as long as nothing is known.
    pub fn share(&self) -> f32 {
        if self.squares < self.changes {
            self.squares / self.changes
        } else {
            1.0
        }
    }

    /// How much of the covariance of an unforeseen acceleration is left, whose heading has the variance `unforeseen` (rad²): the
    /// share that they miss, and no more than they usually do.
    pub fn unforeseen(&self, unforeseen: f32) -> f32 {
        let usual = Self::FADING * self.squares;
        if self.squares > 0.0 && usual < unforeseen {
            math::min(self.share(), usual / unforeseen)
        } else {
            self.share()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is learned of wheels that say `told` of the rotations (rad) of all scans and a scan's number.
    fn learned(told: impl Fn(&[f32], usize) -> f32) -> Lateness {
        let mut lateness = Lateness::UNKNOWN;
        // To and fro, half a second each.
        let turned: [f32; 100] = core::array::from_fn(|k| if k % 10 < 5 { 0.1 } else { -0.1 });
        for k in 1..turned.len() {
            let change = turned[k] - turned[k - 1];
            lateness.push(turned[k] - told(&turned, k), change, 2.5e-5);
        }
        lateness
    }

    #[test]
    fn wheels_on_time_miss_little_and_late_ones_all() {
        let on_time = learned(|turned, k| 0.9 * turned[k]);
        assert!((on_time.share() - 0.01).abs() < 0.005, "{on_time:?}");
        assert!(on_time.unforeseen(2.5e-5) < 0.02);
        let late = learned(|turned, k| turned[k - 1]);
        assert!(late.share() > 0.9, "{late:?}");
        assert!(late.unforeseen(2.5e-5) > 0.9);
        // Nothing is known of wheels that were never compared.
        assert_eq!(Lateness::UNKNOWN.share(), 1.0);
        assert_eq!(Lateness::UNKNOWN.unforeseen(2.5e-5), 1.0);
    }

    #[test]
    fn a_robot_that_never_turns_is_foreseen_too() {
        let mut lateness = Lateness::UNKNOWN;
        for _ in 0..100 {
            assert_eq!(lateness.push(0.0, 0.0, 2.5e-5), 0.0);
        }
        assert!(lateness.unforeseen(2.5e-5) < 0.02, "{lateness:?}");
        // A turn that the wheels do not tell.
        assert_eq!(lateness.push(0.02, 0.06, 2.5e-5), 0.02);
    }
}
