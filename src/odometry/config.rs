//! Settings of the odometry.

use crate::{
    matching::icp::IcpConfig,
    scan::{Mount, PointsConfig},
};

/// Settings of [`Odometry`](super::Odometry).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryConfig {
    /// How the lidar sits on the robot, which ranges are used, and how scans are thinned.
    /// Default [`PointsConfig::DEFAULT`]: every beam between 0.05 m and 32 m.
    pub points: PointsConfig,
    /// Directions that a keyframe tells apart, at most the capacity N. Best the number of beams of a full revolution,
    /// also for a lidar that sees less than one. Default 456: the 450 beams of an LD06 at 10 Hz.
    pub directions: u16,
    /// Distance from the last keyframe at which a new one is made (m). Default 0.4: near enough for most surfaces to be
    /// seen by both, far enough for errors not to add up often.
    pub keyframe_distance: f32,
    /// Rotation from the last keyframe at which a new one is made (rad). Default 0.8. While the turn rate changes, a
    /// constant-velocity deskew is wrong: this and the distance are doubled then.
    pub keyframe_rotation: f32,
    /// A new keyframe is made when fewer than this share of the beams meet the last one's surfaces. Default 0.6.
    pub keyframe_overlap: f32,
    /// Farthest accepted distance of a match from its guess for a match that explains every beam (m; twice as many
    /// radians); for one that explains half of them it is half as far. Default 0.45: wheels that slip or spin, not
    /// another room.
    pub max_correction: f32,
    /// Standard deviation of the predicted motion, as a share of its distance and of its rotation. Default 0.1.
    pub prior_error: f32,
    /// Refused scans in a row after which the keyframe is given up. Default 10: an occlusion of up to a second at 10 Hz
    /// does not lose the keyframe.
    pub max_refused: u8,
    /// Settings of the matcher. Default [`IcpConfig::DEFAULT`], but a direction counts as degenerate below a share of
    /// 0.035: along a corridor the guess is better than what a few beams tell.
    pub icp: IcpConfig,
}

impl OdometryConfig {
    /// For a wheeled robot with a lidar of 5 to 15 revolutions a second.
    pub const DEFAULT: Self = Self {
        points: PointsConfig::DEFAULT,
        directions: 456,
        keyframe_distance: 0.4,
        keyframe_rotation: 0.8,
        keyframe_overlap: 0.6,
        max_correction: 0.45,
        prior_error: 0.1,
        max_refused: 10,
        icp: IcpConfig {
            min_constraint_share: 0.035,
            ..IcpConfig::DEFAULT
        },
    };

    /// The same settings for a lidar that sits on the robot like this.
    #[must_use]
    pub const fn with_mount(mut self, mount: Mount) -> Self {
        self.points.mount = mount;
        self
    }
}

impl Default for OdometryConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
