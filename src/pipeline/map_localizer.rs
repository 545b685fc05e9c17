//! Localization in a map as an estimator: whole scans and the robot's motion in, the robot's pose out.

use super::{
    estimator::{Estimate, Estimator, Verdict},
    seen::Seen,
};
use crate::{
    geometry::{EgoMotion, Pose},
    linalg::Covariance,
    localization::{Localizer, Verdict as Localization},
    scan::{PointsConfig, Scan},
};

/// A [`Localizer`] with the lidar's place on the robot.
///
/// The localizer and 8·N bytes. N is the most beams of a revolution, M the points that are used where all are not
/// needed.
#[derive(Debug)]
pub struct MapLocalizer<'a, const N: usize, const M: usize> {
    localizer: Localizer<'a, M>,
    seen: Seen<N>,
}

/// What is known of the robot in a map after a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Located {
    /// Robot in the map at the scan's end (m, rad), where it is known.
    pub pose: Option<Pose>,
    /// What the localizer says.
    pub outcome: Localization,
    /// Covariance of `pose` in the map, where the scan has measured it.
    pub covariance: Option<Covariance>,
}

impl<'a, const N: usize, const M: usize> MapLocalizer<'a, N, M> {
    /// Localizes with scans taken as `config` says.
    #[must_use]
    pub const fn new(localizer: Localizer<'a, M>, config: PointsConfig) -> Self {
        Self {
            localizer,
            seen: Seen::new(config),
        }
    }

    /// Tracks from a known pose of the robot in the map on (m, rad).
    pub fn start_at(&mut self, map_from_robot: Pose) {
        let mount = self.seen.mount().robot_from_lidar;
        self.localizer.start_at(map_from_robot * mount);
    }

    /// Robot in the map (m, rad), where it is known.
    #[must_use]
    pub fn pose(&self) -> Option<Pose> {
        let mount = self.seen.mount().robot_from_lidar;
        Some(self.localizer.pose()? * mount.inverse())
    }

    /// The localizer, for its counters.
    #[must_use]
    pub const fn localizer(&self) -> &Localizer<'a, M> {
        &self.localizer
    }
}

impl<const N: usize, const M: usize> Estimator<N> for MapLocalizer<'_, N, M> {
    type Step = Located;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Located {
        let (motion, _) = self.seen.take(scan, ego);
        let lidar_motion = self.seen.mount().lidar_motion(motion);
        let outcome = self.localizer.update(self.seen.points(), lidar_motion);
        let pose = self.pose();
        let covariance = match (&outcome, pose, self.localizer.pose()) {
            // The match is about the lidar: its error of heading moves the robot's centre about it.
            (Localization::Tracking(found, _), Some(robot), Some(lidar)) => Some(
                found
                    .covariance
                    .transported(robot.x - lidar.x, robot.y - lidar.y),
            ),
            _ => None,
        };
        Located {
            pose,
            outcome,
            covariance,
        }
    }

    fn work(&mut self, budget: u32) -> bool {
        self.localizer.step(budget)
    }
}

impl Estimate for Located {
    fn pose(&self) -> Option<Pose> {
        self.pose
    }

    fn covariance(&self) -> Option<Covariance> {
        self.covariance
    }

    fn verdict(&self) -> Verdict {
        match self.outcome {
            Localization::Tracking(..) => Verdict::Measured,
            Localization::Doubtful(_) => Verdict::Predicted,
            Localization::Searching | Localization::Choosing { .. } => Verdict::Unknown,
        }
    }
}
