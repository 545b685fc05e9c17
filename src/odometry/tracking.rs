//! What is known of the pose since the keyframe.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
};

/// Errors of the robot's pose relative to the keyframe, and how long things have lasted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tracking {
    /// Covariance of the pose relative to the keyframe, without the keyframe's own noise.
    pub relative: Covariance,
    /// How much of the keyframe's own noise is in the pose, 0…1.
    pub shared: f32,
    /// Covariance of the keyframe's own noise, as part of the last match.
    pub noise: Covariance,
    /// Difference of poses (m, m, rad) that the pose is off by if matches were wrongly believed, or wrongly doubted.
    pub doubt: [f32; 3],
    /// Velocity before the first match that was doubted, in the frame of the start (m/s).
    pub before: [f32; 2],
    /// Where the robot is by the predicted motions alone since the keyframe; by the wheels where there are any.
    pub wheels: Pose,
    /// Time since the robot's velocity was measured last (s).
    pub coasting: f32,
    /// Time since the keyframe (s).
    pub seconds: f32,
    /// Time since the last match (s).
    pub blind: f32,
    /// There were too few beams for a match since the last one.
    pub covered: bool,
}

impl Tracking {
    /// At a keyframe.
    pub const fn at(pose: Pose, coasting: f32) -> Self {
        const NONE: Covariance = Covariance(Sym3::diagonal(0.0, 0.0, 0.0));
        Self {
            relative: NONE,
            shared: 0.0,
            noise: NONE,
            doubt: [0.0; 3],
            before: [0.0; 2],
            wheels: pose,
            coasting,
            seconds: 0.0,
            blind: 0.0,
            covered: false,
        }
    }

    /// Covariance of the pose relative to the keyframe, all told.
    pub fn covariance(&self) -> Covariance {
        let shared = self.noise.0.scaled(self.shared * self.shared);
        let [x, y, theta] = self.doubt;
        // Of place and heading one may be wrong without the other.
        let doubt = Sym3::outer([x, y, 0.0]).plus(&Sym3::diagonal(0.0, 0.0, theta * theta));
        Covariance(self.relative.0.plus(&shared).plus(&doubt))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_keyframes_noise_counts_as_far_as_matches_have_brought_it_in() {
        let mut tracking = Tracking::at(Pose::IDENTITY, 0.0);
        tracking.noise = Covariance(Sym3::diagonal(4.0, 4.0, 4.0));
        assert_eq!(tracking.covariance().0.xx, 0.0);
        tracking.shared = 0.5;
        assert_eq!(tracking.covariance().0.xx, 1.0);
        tracking.doubt = [2.0, 0.0, 0.0];
        assert_eq!(tracking.covariance().0.xx, 5.0);
    }
}
