//! Velocity of the robot during a scan, measured from the middle of one scan to the middle of the next.
//!
//! A scan that is deskewed with a velocity off by δ is matched with its end δ·T/2 off, T being its duration, but with its
//! middle in place to first order. Measured from end to end, half of each error would return with the other sign, scan
//! after scan.

use super::residuals::Residuals;
use crate::{
    geometry::{Pose, Twist},
    math,
};

/// When a scan was taken.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Times {
    /// Time from the last scan's end to this one's (s).
    pub seconds: f32,
    /// Time from the scan's first beam to its last (s).
    pub duration: f32,
    /// Time from the last scan's end to this one's as far as is known, also over a gap (s).
    pub elapsed: f32,
}

/// Where a prior comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// The wheels' motion since the last scan.
    Wheels,
    /// The last velocity, which is believed to go on.
    Velocity,
}

/// A smaller change of the rotation during a scan is the noise of two matches (rad).
const NOISE: f32 = 0.015;

/// Motion up to the last scan.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    /// Velocity during the last scan.
    pub twist: Twist,
    /// Robot in the middle of the last scan.
    middle: Pose,
    /// Rate of turn from the middle of the scan before the last to the middle of the last (rad/s), if both
    /// were measured.
    rate: Option<f32>,
    /// Velocity during the last scan by the wheels; zero without them.
    wheel_twist: Twist,
    /// The motion that was measured or extrapolated last, before it was looked at for jumps.
    pub said: Pose,
    /// Time from the last scan's first beam to its last (s).
    duration: f32,
    /// What residuals usually are.
    pub residuals: Residuals,
    /// Running mean of the time from scan to scan (s).
    mean_interval: f32,
    /// Running mean of the distance of such a time from that mean (s): a clock that jitters.
    pub jitter: f32,
}

impl Motion {
    /// Nothing seen yet.
    pub const STANDING: Self = Self {
        twist: Twist::ZERO,
        middle: Pose::IDENTITY,
        rate: None,
        wheel_twist: Twist::ZERO,
        said: Pose::IDENTITY,
        duration: 0.0,
        residuals: Residuals::NONE,
        mean_interval: 0.0,
        jitter: 0.0,
    };

    /// Time between two scans of which the clock says that it was `told` (s): the usual one, where the clock jitters by as
    /// much or went back. Learns how much it jitters.
    pub fn interval(&mut self, told: f32) -> f32 {
        /// Farther from the usual time than so many times the jitter, scans are missing.
        const MISSING: f32 = 4.0;
        /// Share of one interval in the running means.
        const SHARE: f32 = 0.1;
        if self.mean_interval <= 0.0 {
            self.mean_interval = math::max(told, 0.0);
            return self.mean_interval;
        }
        let unlike = told - self.mean_interval;
        let is_jitter = math::abs(unlike) < MISSING * self.jitter;
        let seconds = if is_jitter || told <= 0.0 {
            self.mean_interval
        } else {
            told
        };
        // A gap is no jitter, or as little as can be told apart.
        let most = self.mean_interval + MISSING * self.jitter;
        let unlike = math::max(-most, math::min(unlike, most));
        self.mean_interval = math::max(self.mean_interval + SHARE * unlike, 0.0);
        self.jitter += SHARE * (math::abs(unlike) - self.jitter);
        seconds
    }

    /// Whether wheels that say `motion` have jumped: it differs by more than any robot accelerates from where the robot
    /// would be by the velocity that it was found to have, and from the motion that they said before.
    pub fn is_jump(&self, motion: Pose, coasting: Twist, times: Times) -> bool {
        /// Hardest braking and turning of a robot (m/s², rad/s²) ...
        const HARDEST: (f32, f32) = (10.0, 20.0);
        /// ... and how far off a motion between two scans may be measured besides (m, rad).
        const OFF: (f32, f32) = (0.1, 0.15);
        if times.seconds <= 0.0 {
            return false;
        }
        let square = times.seconds * times.seconds;
        let far = |expected: Pose| {
            let off = expected.between(motion);
            off.distance() > HARDEST.0 * square + OFF.0
                || math::abs(off.theta) > HARDEST.1 * square + OFF.1
        };
        far(coasting.displacement(times.seconds)) && far(self.said)
    }

    /// Velocity during a scan whose middle was found at `middle`: wheel velocity plus the correction that the last two
    /// matches imply. Without wheels the whole velocity comes from the matches.
    pub fn during(&self, middle: Pose, wheels: Option<Twist>, times: Times) -> Twist {
        /// A smaller correction (m, rad) is the noise of two matches: wheels know better.
        const SLIP: (f32, f32) = (0.01, 0.006);
        if times.seconds <= 0.0 {
            // Over a gap of unknown length there is no velocity.
            return Twist::ZERO;
        }
        let between = times.seconds + 0.5 * (self.duration - times.duration);
        let by_wheels = wheels.unwrap_or(Twist::ZERO);
        let missed = self.missed(middle, by_wheels, times);
        if wheels.is_some() && missed.distance() < SLIP.0 && math::abs(missed.theta) < SLIP.1 {
            return by_wheels;
        }
        let missed = Twist::from_motion(missed, between);
        Twist {
            vx: by_wheels.vx + missed.vx,
            vy: by_wheels.vy + missed.vy,
            omega: by_wheels.omega + missed.omega,
        }
    }

    /// Motion from the last scan's middle to this one's, found at `middle`, as seen from where wheels say it ended that turned with
    /// `wheels` during this scan.
    pub fn missed(&self, middle: Pose, wheels: Twist, times: Times) -> Pose {
        let wheel_motion = self.wheel_twist.displacement(0.5 * self.duration)
            * wheels.displacement(times.seconds - 0.5 * times.duration);
        wheel_motion.between(self.middle.between(middle))
    }

    /// How far ahead the rate of turn during a scan is of `omega` (rad/s), the rate from the last scan's middle to this one's
    /// where there are no wheels: by half of what it has changed by since the scan before, if that is more than the noise of
    /// matches whose heading has the variance `noise`.
    pub fn lead(&self, omega: f32, noise: f32, times: Times) -> Option<f32> {
        /// Variances of a match in a change of the rotation, which is 1, -2 and 1 times a match's error; three standard
        /// deviations of it.
        const SQUARES: f32 = 9.0 * 6.0;
        let change = omega - self.rate?;
        let turned = change * times.duration;
        (turned * turned > math::max(SQUARES * noise, NOISE * NOISE)).then_some(0.5 * change)
    }

    /// Rotation that a change of the turn rate adds between what a match of a scan deskewed with `during` says of its end
    /// and its real end: a constant acceleration since the last scan.
    ///
    /// Wheels tell the mean rate over the scan, and its middle lags by a twelfth of what the rate has changed by. Without
    /// them the rate is that from the last scan's middle to this one's, and a quarter did best in simulated drives.
    pub fn unskewed(&self, during: Twist, source: Source, times: Times) -> Pose {
        let change = (during.omega - self.twist.omega) * times.duration;
        if math::abs(change) < NOISE {
            return Pose::IDENTITY;
        }
        let share = match source {
            Source::Wheels => 1.0 / 12.0,
            Source::Velocity => 0.25,
        };
        Pose::new(0.0, 0.0, share * change)
    }

    /// Takes a scan that ended at `end` and during which the robot moved with `twist`.
    pub fn advance(&mut self, end: Pose, twist: Twist, wheels: Option<Twist>, times: Times) {
        self.middle = end * twist.displacement(-0.5 * times.duration);
        self.wheel_twist = wheels.unwrap_or(Twist::ZERO);
        self.duration = times.duration;
        self.twist = twist;
    }

    /// Notes the rate of turn from the last scan's middle to this one's, as measured by two matches (rad/s).
    pub fn note_rate(&mut self, rate: Option<f32>) {
        self.rate = rate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: Times = Times {
        seconds: 0.1,
        duration: 0.1,
        elapsed: 0.1,
    };

    fn driving(vx: f32, omega: f32) -> Twist {
        Twist { vx, vy: 0.0, omega }
    }

    /// Scans of a robot that drives with `truth`, their middles found `errors` (rad) off; velocity found at the end.
    fn told(truth: Twist, wheels: Option<Twist>, errors: &[f32]) -> Twist {
        let mut motion = Motion::STANDING;
        let mut end = Pose::IDENTITY;
        motion.advance(end, truth, wheels, TIMES);
        for &error in errors {
            end = end * truth.displacement(TIMES.seconds);
            let mut middle = end * truth.displacement(-0.5 * TIMES.duration);
            middle.theta += error;
            let during = motion.during(middle, wheels, TIMES);
            motion.advance(
                middle * during.displacement(0.5 * TIMES.duration),
                during,
                wheels,
                TIMES,
            );
        }
        motion.twist
    }

    #[test]
    fn the_velocity_is_found_with_and_without_wheels_and_where_they_slip() {
        let truth = driving(0.6, -1.1);
        for wheels in [
            None,
            Some(truth),
            Some(driving(0.6, -0.8)),
            Some(driving(0.9, -1.1)),
        ] {
            let twist = told(truth, wheels, &[0.0; 3]);
            let off = [twist.vx - 0.6, twist.vy, twist.omega + 1.1];
            // What wheels and slip turn within one scan is added, not composed: a fifteenth of the slip.
            assert!(off.iter().all(|v| v.abs() < 0.02), "{wheels:?}: {twist:?}");
        }
    }

    #[test]
    fn a_clock_whose_moments_jump_makes_no_wild_velocity() {
        let mut motion = Motion::STANDING;
        let (mut end, step) = (Pose::IDENTITY, Pose::new(0.05, 0.0, 0.0));
        for k in 0..60 {
            // Every fourth scan is told a tenth of a second late, or more than that.
            let seconds = motion.interval([0.1, 0.1, 0.22, -0.02][k % 4]);
            let times = Times {
                seconds,
                duration: 0.0,
                elapsed: seconds,
            };
            end = end * step;
            let during = motion.during(end, None, times);
            // 0.5 m/s.
            assert!(k < 20 || (during.vx - 0.5).abs() < 0.1, "{k}: {during:?}");
            motion.advance(end, during, None, times);
        }
        // Scans that are missing from a regular clock are a longer time.
        let mut regular = Motion::STANDING;
        for _ in 0..20 {
            assert!((regular.interval(0.1) - 0.1).abs() < 1e-6);
        }
        assert_eq!(regular.interval(0.3), 0.3);
        assert!((regular.interval(0.1) - 0.1).abs() < 0.02);
    }

    #[test]
    fn an_error_of_one_scan_is_gone_two_scans_later() {
        let truth = driving(0.6, 0.4);
        for wheels in [None, Some(truth)] {
            let bad = told(truth, wheels, &[0.0, 0.02]);
            assert!((bad.omega - 0.4).abs() > 0.1, "{wheels:?}: {bad:?}");
            let twist = told(truth, wheels, &[0.0, 0.02, 0.0, 0.0]);
            assert!((twist.omega - 0.4).abs() < 1e-3, "{wheels:?}: {twist:?}");
        }
    }

    #[test]
    fn a_turn_rate_that_changes_steadily_is_led_by_half_a_scan() {
        let mut motion = Motion::STANDING;
        // Nothing is known of the rate before the first two matches.
        assert_eq!(motion.lead(1.0, 1e-6, TIMES), None);
        motion.note_rate(Some(0.6));
        let lead = motion
            .lead(1.0, 1e-6, TIMES)
            .expect("a change of 2.3 deg a scan");
        assert!((lead - 0.2).abs() < 1e-6);
        // The noise of three matches, and what it may be.
        assert_eq!(motion.lead(0.7, 1e-6, TIMES), None);
        assert_eq!(motion.lead(1.0, 1e-3, TIMES), None);
    }
}
