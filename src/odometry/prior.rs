//! Where the robot should be before its scan is looked at.

use super::{
    error_model,
    motion::{Source, Times},
    state::Odometry,
};
use crate::{
    geometry::{EgoMotion, Pose, Twist},
    linalg::Covariance,
    math,
    scan::Scan,
};

/// What wheels, gyroscope and the last velocity say about a scan.
pub(super) struct Prior {
    /// Velocity of the robot during the scan.
    pub twist: Twist,
    /// Robot at the scan's end.
    pub pose: Pose,
    /// Covariance of `pose` relative to the keyframe.
    pub relative: Covariance,
    /// Covariance of `motion`, in the same frame.
    pub growth: Covariance,
    /// Where `pose` comes from.
    pub source: Source,
    /// Motion of the robot since the last scan.
    pub motion: Pose,
    /// Velocity by the wheels, where there are any.
    pub wheel_twist: Option<Twist>,
    /// Rate of turn by the gyroscope (rad/s), where there is one.
    pub turn_rate: Option<f32>,
}

impl<const N: usize> Odometry<N> {
    /// Times of a scan; all 0 for the first one and for clocks that stand still or jump.
    pub(super) fn times(&self, scan: &Scan<N>) -> Times {
        let micros = scan.end_us().wrapping_sub(self.end_us);
        if self.counters.scans == 0 {
            return Times::default();
        }
        // A clock that went back tells nothing; a second may have passed.
        let elapsed = if micros > 1 << 31 {
            1.0
        } else {
            micros as f32 * 1e-6
        };
        if micros > 2_000_000 {
            return Times {
                elapsed,
                ..Times::default()
            };
        }
        Times {
            seconds: elapsed,
            duration: if micros > 0 { scan.duration() } else { 0.0 },
            elapsed,
        }
    }

    /// Whether a scan that fits badly may be skewed by a rotation that nothing foretold.
    pub(super) fn may_retry_turn_rates(&self, prior: &Prior, times: Times) -> bool {
        prior.wheel_twist.is_none()
            && prior.turn_rate.is_none()
            && times.duration > 0.0
            && self.refused_in_a_row == 0
    }

    /// Pose and velocity that the wheels tell; without them the last velocity goes on, turned by the gyroscope.
    /// Apart, as the other steps are: so that their memory is not on the stack during a match.
    #[inline(never)]
    pub(super) fn predict(&mut self, ego: EgoMotion, times: Times) -> Prior {
        let wheels = wheel_motion(ego);
        let wheel_twist = wheels.map(|motion| Twist::from_motion(motion, times.seconds));
        let turn_rate = ego
            .rotation
            .filter(|rotation| rotation.is_finite() && times.seconds > 0.0)
            .map(|rotation| rotation / times.seconds);
        let last = self.motion.twist;
        let coasting = Twist {
            omega: turn_rate.unwrap_or(last.omega),
            ..last
        };
        let jumped = wheels.is_some_and(|motion| self.motion.is_jump(motion, coasting, times));
        if jumped {
            self.counters.wheel_jumps = self.counters.wheel_jumps.wrapping_add(1);
        }
        self.motion.said = wheels.unwrap_or(coasting.displacement(times.seconds));
        let (wheels, wheel_twist) = if jumped {
            (None, None)
        } else {
            (wheels, wheel_twist)
        };
        let twist = wheel_twist.unwrap_or(coasting);
        let motion = match wheels {
            // Without a clock there is no velocity, but the wheels still tell how far.
            Some(motion) if times.seconds == 0.0 => motion,
            _ => twist.displacement(times.seconds),
        };
        let pose = self.pose * motion;
        let (dx, dy) = (pose.x - self.pose.x, pose.y - self.pose.y);
        let tracking = &mut self.tracking;
        tracking.seconds += times.elapsed;
        let before = tracking.coasting;
        tracking.coasting += times.elapsed;
        let (source, growth) = if wheels.is_some() {
            tracking.coasting = 0.0;
            let share = self.config.prior_error;
            (Source::Wheels, self.wheel_errors.covariance(share, motion))
        } else {
            let mut growth = error_model::coasting_between(before, tracking.coasting);
            growth.0 = growth.0.plus(&error_model::FLOOR);
            if turn_rate.is_some() {
                growth.0.tt = self.wheel_errors.covariance(0.02, motion).0.tt;
            }
            (Source::Velocity, growth)
        };
        tracking.wheels = tracking.wheels * motion;
        Prior {
            twist,
            pose,
            relative: Covariance(tracking.relative.transported(dx, dy).0.plus(&growth.0)),
            growth,
            source,
            motion,
            wheel_twist,
            turn_rate,
        }
    }

    /// A second guess of the robot's pose, for a scan that does not fit at the predicted one.
    pub(super) fn fallback_prior(&self, prior: &Prior, times: Times) -> Option<Pose> {
        if prior.wheel_twist.is_none() {
            // It has stopped, or its velocity was wrong.
            let rotation = prior.turn_rate.unwrap_or(0.0) * times.seconds;
            return Some(self.pose * Pose::new(0.0, 0.0, rotation));
        }
        // Wheels that slip tell a wrong motion; but a clock whose moments jump tells a wild velocity.
        let coasting = self.pose * self.motion.twist.displacement(times.seconds);
        let off = prior.pose.between(coasting);
        let limit = self.config.max_correction;
        let wild = off.distance() > limit || math::abs(off.theta) > 2.0 * limit;
        (!wild).then_some(coasting)
    }
}

/// Motion by the wheels, unless it cannot be one.
fn wheel_motion(ego: EgoMotion) -> Option<Pose> {
    // No robot drives farther between two scans: a damaged message.
    const FARTHEST: f32 = 32.0;
    ego.motion()
        .filter(|motion| motion.is_finite() && motion.distance() < FARTHEST)
}
