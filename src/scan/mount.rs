//! How the lidar sits on the robot.

use crate::geometry::{Pose, Twist};

/// Place and attitude of the lidar on the robot.
///
/// A wrong mount shows as a map that is mirrored (`upside_down`) or drifts in turns (`x`, `y`).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mount {
    /// Pose of the lidar in the robot's frame (m, rad). Default: at its centre, looking forward.
    pub robot_from_lidar: Pose,
    /// Mounted head down: bearings run the other way round. Default false.
    pub upside_down: bool,
}

impl Mount {
    /// At the robot's centre, upright, looking forward.
    pub const DEFAULT: Self = Self {
        robot_from_lidar: Pose::IDENTITY,
        upside_down: false,
    };

    /// Motion of the lidar between two moments when the robot moves by `motion` between them.
    #[must_use]
    pub(crate) fn lidar_motion(&self, motion: Pose) -> Pose {
        self.robot_from_lidar
            .between(motion * self.robot_from_lidar)
    }

    /// Velocity of the lidar, in its own frame, when the robot has `twist`.
    #[must_use]
    pub(crate) fn lidar_twist(&self, twist: Twist) -> Twist {
        // The lidar's place moves with the robot and around it; then the axes turn to its own.
        let at = self.robot_from_lidar;
        let (vx, vy) = (twist.vx - twist.omega * at.y, twist.vy + twist.omega * at.x);
        let own = Pose::new(0.0, 0.0, at.theta).between(Pose::new(vx, vy, 0.0));
        Twist {
            vx: own.x,
            vy: own.y,
            omega: twist.omega,
        }
    }

    /// Motion of the robot when its lidar moves by `motion`: undoes [`Mount::lidar_motion`].
    #[must_use]
    pub(crate) fn robot_motion(&self, motion: Pose) -> Pose {
        self.robot_from_lidar * motion * self.robot_from_lidar.inverse()
    }
}

impl Default for Mount {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lidar_in_front_moves_sideways_when_the_robot_turns() {
        let mount = Mount {
            robot_from_lidar: Pose::new(0.2, 0.0, 0.0),
            ..Mount::DEFAULT
        };
        let turn = Pose::new(0.0, 0.0, core::f32::consts::FRAC_PI_2);
        let moved = mount.lidar_motion(turn);
        assert!(
            (moved.x + 0.2).abs() < 1e-6 && (moved.y - 0.2).abs() < 1e-6,
            "{moved:?}"
        );
        let twist = mount.lidar_twist(Twist {
            vx: 1.0,
            vy: 0.0,
            omega: 2.0,
        });
        assert!(
            (twist.vx - 1.0).abs() < 1e-6 && (twist.vy - 0.4).abs() < 1e-6,
            "{twist:?}"
        );
        let back = mount.robot_motion(moved);
        assert!(
            back.x.abs() < 1e-6 && back.y.abs() < 1e-6 && (back.theta - turn.theta).abs() < 1e-6
        );
    }
}
