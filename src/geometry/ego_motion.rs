//! How a robot moved by its own sensors, without looking around.

use super::{Pose, Twist};
use crate::math;

/// No robot drives farther between two scans (m): a damaged message.
const FARTHEST: f32 = 32.0;
/// No robot turns farther between two scans (rad): five times around, a second at five turns a second.
const MOST_ROTATION: f32 = 32.0;

/// Motion of the robot from one scan's end to the next one's, as its wheels and its gyroscope measured it.
///
/// The default knows nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct EgoMotion {
    /// Pose of the robot at the second moment in its frame at the first one, by its wheels (m, rad).
    pub wheels: Option<Pose>,
    /// Change of heading by its gyroscope, counter-clockwise (rad).
    pub rotation: Option<f32>,
}

impl EgoMotion {
    /// No wheels and no gyroscope told anything.
    pub const UNKNOWN: Self = Self {
        wheels: None,
        rotation: None,
    };

    /// Standard deviation of an unknown velocity (m/s): robots drive at half a walking pace to a walking pace.
    pub(crate) const WALKING: f32 = 0.8;
    /// Standard deviation of an unknown rate of turn (rad/s): a robot turns round in four seconds.
    pub(crate) const TURNING: f32 = 1.5;

    /// Assumed standard deviations (m, rad) of a motion by wheels: a share of its distance and its rotation.
    pub(crate) fn wheel_errors(share: f32, motion: Pose) -> (f32, f32) {
        /// Error of a standstill (m, rad).
        const MIN_ERROR: f32 = 0.001;
        (
            share * motion.distance() + MIN_ERROR,
            share * math::abs(motion.theta) + MIN_ERROR,
        )
    }

    /// Motion by the wheels, with the gyroscope's rotation where there is one: on carpet and over sills wheels tell the
    /// distance well and the heading badly. Nothing where the wheels tell 32 m or 32 rad or more, or no number.
    #[must_use]
    pub fn motion(self) -> Option<Pose> {
        let wheels = self
            .wheels
            .filter(|wheels| wheels.distance() < FARTHEST && is_rotation(wheels.theta))?;
        let Some(omega) = self.credible_rotation() else {
            return Some(wheels);
        };
        // Along an arc of the same length, bent as the gyroscope says.
        let arc = Twist::from_motion(wheels, 1.0);
        Some(Twist { omega, ..arc }.displacement(1.0))
    }

    /// Change of heading by the gyroscope, if a robot can turn so far between two scans.
    pub(crate) fn credible_rotation(self) -> Option<f32> {
        self.rotation.filter(|&rotation| is_rotation(rotation))
    }
}

/// Whether a robot can turn so far between two scans (rad); NaN is no rotation.
fn is_rotation(theta: f32) -> bool {
    math::abs(theta) < MOST_ROTATION
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gyroscope_bends_the_wheels_arc_and_leaves_its_length() {
        let wheels = Some(Pose::new(0.3, 0.0, 0.0));
        let straight = EgoMotion {
            wheels,
            rotation: None,
        };
        assert_eq!(straight.motion(), wheels);
        let quarter = core::f32::consts::FRAC_PI_2;
        let bent = EgoMotion {
            wheels,
            rotation: Some(quarter),
        };
        let motion = bent.motion().expect("wheels");
        // A quarter circle of 0.3 m: its radius is 0.3 · 2/π.
        let radius = 0.3 / quarter;
        assert!((motion.x - radius).abs() < 1e-5 && (motion.y - radius).abs() < 1e-5);
        assert_eq!(motion.theta, quarter);
        assert_eq!(EgoMotion::UNKNOWN.motion(), None);
    }

    #[test]
    fn what_no_robot_does_is_no_motion() {
        for wild in [
            Pose::new(40.0, 0.0, 0.0),
            Pose::new(0.0, -1e30, 0.0),
            Pose {
                theta: -2.5e30,
                ..Pose::IDENTITY
            },
            Pose {
                theta: f32::NAN,
                ..Pose::IDENTITY
            },
        ] {
            let ego = EgoMotion {
                wheels: Some(wild),
                rotation: Some(0.1),
            };
            assert_eq!(ego.motion(), None, "{wild:?}");
        }
        let wheels = Some(Pose::new(0.3, 0.0, 0.1));
        for wild in [1e30, f32::NEG_INFINITY, f32::NAN] {
            let ego = EgoMotion {
                wheels,
                rotation: Some(wild),
            };
            assert_eq!((ego.motion(), ego.credible_rotation()), (wheels, None));
        }
    }
}
