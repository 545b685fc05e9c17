//! Where the robot should be before its scan is looked at.

use super::{
    error_model,
    motion::{Source, Times},
    state::Odometry,
};
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
    /// Covariance of `motion`, in the frame of `pose`.
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
    /// Times of a scan; all 0 for the first one and for a clock that stands still. After a jump of the clock `seconds` and
    /// `duration` are 0 and `elapsed` is a guess.
    pub(super) fn times(&mut self, scan: &Scan<N>) -> Times {
        /// A clock that says more between two scans, ahead or back, has been set, or scans are missing (s).
        const MAX_STEP: f32 = 2.0;
        let Some(end_us) = self.end_us else {
            return Times::default();
        };
        let micros = scan.end_us().wrapping_sub(end_us);
        if micros == 0 {
            return Times::default();
        }
        // Ahead or back.
        let signed = micros.cast_signed() as f32 * 1e-6;
        if math::abs(signed) > MAX_STEP {
            // A clock that went back tells nothing; a second may have passed.
            let elapsed = if signed < 0.0 { 1.0 } else { signed };
            return Times {
                elapsed,
                ..Times::default()
            };
        }
        let seconds = self.motion.interval(signed);
        Times {
            seconds,
            duration: scan.duration(),
            elapsed: seconds,
        }
    }

    /// Whether a scan that fits badly may be skewed by a rotation that nothing foretold.
    pub(super) fn may_retry_turn_rates(&self, prior: &Prior, times: Times) -> bool {
        prior.wheel_twist.is_none()
            && prior.turn_rate.is_none()
            && times.duration > 0.0
            && self.refused_in_a_row == 0
    }

    /// Pose and velocity that the wheels tell, and their covariance in `tracking`; without them the last velocity goes on, turned by the gyroscope.
    /// Apart, as the other steps are: so that their memory is not on the stack during a match.
    #[inline(never)]
    pub(super) fn predict(&mut self, ego: EgoMotion, times: Times) -> Prior {
        /// For so long a velocity goes on (s): robots stop turning sooner or later.
        const MAX_COASTING: f32 = 0.5;
        let wheels = ego.motion();
        let wheel_twist = wheels.map(|motion| Twist::from_motion(motion, times.seconds));
        let turn_rate = ego
            .credible_rotation()
            .filter(|_| times.seconds > 0.0)
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
            None if turn_rate.is_none() => {
                twist.displacement(math::min(times.seconds, MAX_COASTING))
            }
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
            // The velocity may have lasted longer or shorter than the clock says.
            let (along, turned) = (
                self.motion.jitter * last.speed(),
                self.motion.jitter * last.omega,
            );
            let jitter = Sym3::diagonal(along * along, along * along, turned * turned);
            growth.0 = growth.0.plus(&jitter).plus(&error_model::FLOOR);
            if turn_rate.is_some() {
                growth.0.tt = self.wheel_errors.covariance(0.02, motion).0.tt;
            }
            (Source::Velocity, growth)
        };
        tracking.wheels = tracking.wheels * motion;
        tracking.relative = tracking.relative.transported(dx, dy).plus(&growth);
        Prior {
            twist,
            pose,
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
        let limit = self.config.max_correction;
        let wild = farther(prior.pose, coasting, (limit, 2.0 * limit)).is_some();
        (!wild).then_some(coasting)
    }
}

/// How far apart two poses are (m, rad), if by more than one of these limits.
pub(super) fn farther(a: Pose, b: Pose, (far, turned): (f32, f32)) -> Option<(f32, f32)> {
    let off = a.between(b);
    let (distance, rotation) = (off.distance(), math::abs(off.theta));
    (distance > far || rotation > turned).then_some((distance, rotation))
}
