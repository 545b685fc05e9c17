//! Where the robot should be before its scan is looked at.

use super::{motion::Times, state::Odometry};
use crate::{
    geometry::{EgoMotion, Pose, Twist},
    linalg::{Covariance, Sym3},
    math,
    scan::Scan,
};

/// What wheels, gyroscope and the last velocity say about a scan.
pub(super) struct Prior {
    /// Velocity of the robot during the scan.
    pub twist: Twist,
    /// Robot at the scan's end.
    pub pose: Pose,
    /// Covariance of `pose`.
    pub covariance: Covariance,
    /// Velocity by the wheels, where there are any.
    pub wheel_twist: Option<Twist>,
    /// Rate of turn by the gyroscope (rad/s), where there is one.
    pub turn_rate: Option<f32>,
}

impl<const N: usize> Odometry<N> {
    /// Times of a scan; all 0 for the first one and for clocks that stand still or jump.
    pub(super) fn times(&self, scan: &Scan<N>) -> Times {
        let micros = scan.end_us().wrapping_sub(self.end_us);
        if self.counters.scans == 0 || micros > 2_000_000 {
            return Times::default();
        }
        Times {
            seconds: micros as f32 * 1e-6,
            duration: if micros > 0 { scan.duration() } else { 0.0 },
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
    pub(super) fn predict(&self, ego: EgoMotion, times: Times) -> Prior {
        let wheels = ego.motion();
        let wheel_twist = wheels.map(|motion| Twist::from_motion(motion, times.seconds));
        let turn_rate = ego
            .credible_rotation()
            .filter(|_| times.seconds > 0.0)
            .map(|rotation| rotation / times.seconds);
        let last = self.motion.twist;
        let twist = wheel_twist.unwrap_or(Twist {
            omega: turn_rate.unwrap_or(last.omega),
            ..last
        });
        let motion = match wheels {
            // Without a clock there is no velocity, but the wheels still tell how far.
            Some(motion) if times.seconds == 0.0 => motion,
            _ => twist.displacement(times.seconds),
        };
        Prior {
            twist,
            pose: self.pose * motion,
            covariance: self.predict_covariance(motion),
            wheel_twist,
            turn_rate,
        }
    }

    /// Covariance of the pose after a predicted motion.
    fn predict_covariance(&self, motion: Pose) -> Covariance {
        /// Error of a predicted standstill (m, rad).
        const MIN_ERROR: f32 = 0.002;
        let along = self.config.prior_error * motion.distance() + MIN_ERROR;
        let rotation = self.config.prior_error * math::abs(motion.theta) + MIN_ERROR;
        let moved = self.pose * motion;
        self.covariance
            .transported(moved.x - self.pose.x, moved.y - self.pose.y)
            .plus(&Covariance(Sym3::diagonal(
                along * along,
                along * along,
                rotation * rotation,
            )))
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
        let wild = farther(prior.pose, coasting, self.config.max_correction).is_some();
        (!wild).then_some(coasting)
    }
}

/// How far apart two poses are (m, rad), if by more than `limit` metres or twice as many radians.
pub(super) fn farther(a: Pose, b: Pose, limit: f32) -> Option<(f32, f32)> {
    let off = a.between(b);
    let (distance, rotation) = (off.distance(), math::abs(off.theta));
    (distance > limit || rotation > 2.0 * limit).then_some((distance, rotation))
}
