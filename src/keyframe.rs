//! A scan that is kept so that later ones can be matched against it.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
};

/// What a matcher needs of a kept scan, and where the robot was at its end.
///
/// `R` is what the matcher aligns to, for instance a polar reference. 36 bytes more than `R`.
#[derive(Debug, Clone)]
pub struct Keyframe<R> {
    /// What later scans are matched against, seen by the lidar from `pose`.
    pub reference: R,
    /// Pose of the robot (m, rad).
    pub pose: Pose,
    /// Covariance of `pose`, in the same frame.
    pub covariance: Covariance,
}

impl<R> Keyframe<R> {
    /// At the origin, which is known exactly.
    #[must_use]
    pub const fn at_origin(reference: R) -> Self {
        Self {
            reference,
            pose: Pose::IDENTITY,
            covariance: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
        }
    }

    /// Covariance of a robot at `pose` that was located against this keyframe with an error of covariance `of_match`.
    ///
    /// Both errors add: an error of the keyframe's heading moves `pose` about the keyframe.
    #[must_use]
    pub fn covariance_at(&self, pose: Pose, of_match: &Covariance) -> Covariance {
        self.covariance
            .transported(pose.x - self.pose.x, pose.y - self.pose.y)
            .plus(of_match)
    }
}
