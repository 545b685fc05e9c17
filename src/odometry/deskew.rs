//! The scan at hand as points, as if its beams had all been measured at its end.

use crate::{
    geometry::{Pose, Twist},
    scan::{Points, PointsConfig, Scan},
};

/// Points of a scan, with the velocity that they were deskewed with and the pose that they are seen from.
#[derive(Debug, Clone)]
pub(super) struct Deskewed<const N: usize> {
    /// Places hit by the beams, in the lidar's frame at the scan's end.
    pub points: Points<N>,
    /// Velocity of the robot during the scan that the points are deskewed with.
    pub twist: Twist,
    /// Robot at the scan's end, as far as matches of these points have told.
    pub pose: Pose,
}

impl<const N: usize> Deskewed<N> {
    pub const EMPTY: Self = Self {
        points: Points::new(),
        twist: Twist::ZERO,
        pose: Pose::IDENTITY,
    };

    /// No points, at the origin.
    pub fn clear(&mut self) {
        self.points.clear();
        (self.twist, self.pose) = (Twist::ZERO, Pose::IDENTITY);
    }

    /// Deskews a scan during which the robot moved with `twist`; `pose` stays as it was.
    pub fn assign(&mut self, scan: &Scan<N>, twist: Twist, config: &PointsConfig) {
        self.points.assign(scan, twist, config);
        self.twist = twist;
    }
}
