//! Odometry and a map that rolls with the robot as an estimator, in the memory of a small controller.

use super::estimator::{Estimate, Estimator, Verdict};
use crate::{
    geometry::{EgoMotion, Pose},
    linalg::Covariance,
    odometry::{Odometry, OdometryConfig, Refusal, Step},
    scan::Scan,
    slam::{RollingMap, Told},
};

/// A rolling map for a controller with 64 KB of RAM: 36 keyframes of 180 points, 512 beams a revolution.
pub type Mapper64k = RollingMapper<512, 36, 180, 512>;

/// An [`Odometry`] of N beams a revolution, and over it a map of the last K keyframes of B points, seen together in V
/// directions: for a [`Tracker`](super::Tracker) or a [`Pipeline`](super::Pipeline). The odometry, and about
/// `(46 + 2·B)·K + 32·V + 8·B` bytes.
///
/// Every scan is matched once more, against what up to 12 keyframes around the robot saw as one: it drifts less than
/// odometry, and not at all while it stays among them. There are no loops, and nothing is kept of what was left behind.
/// A scan costs the odometry's update and a match; [`work`](Estimator::work) between scans draws the map anew where the
/// robot has moved on, which else the next scan does first.
#[derive(Debug, Clone)]
pub struct RollingMapper<const N: usize, const K: usize, const B: usize, const V: usize> {
    odometry: Odometry<N>,
    map: RollingMap<K, B, V>,
    robot_from_lidar: Pose,
}

/// What is known of the robot after a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollingStep {
    /// Robot at the scan's end, in the frame in which it started (m, rad).
    pub pose: Pose,
    /// Covariance of `pose` since the start, in the same frame (m², m·rad, rad²).
    pub covariance: Covariance,
    /// Whether the scan fitted the map; else it is where odometry leads from the scan before.
    pub is_matched: bool,
    /// What odometry says, in its own frame: that is the same at the start, and drifts away.
    pub odometry: Step,
}

impl<const N: usize, const K: usize, const B: usize, const V: usize> RollingMapper<N, K, B, V> {
    /// Waits for the first scan.
    #[must_use]
    pub const fn new(odometry: OdometryConfig) -> Self {
        Self {
            robot_from_lidar: odometry.points.mount.robot_from_lidar,
            odometry: Odometry::new(odometry),
            map: RollingMap::new(),
        }
    }

    /// Keyframes in the map.
    #[must_use]
    pub fn keyframes(&self) -> usize {
        self.map.len()
    }

    /// What stands below the map, for its counters.
    #[must_use]
    pub const fn odometry(&self) -> &Odometry<N> {
        &self.odometry
    }
}

impl<const N: usize, const K: usize, const B: usize, const V: usize> Estimator<N>
    for RollingMapper<N, K, B, V>
{
    type Step = RollingStep;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> RollingStep {
        let odometry = self.odometry.update(scan, ego);
        let points = self.odometry.points().as_slice();
        // What is told besides is the motion within this scan: the next match corrects it, so that it does not add up.
        let settled = *self.odometry.settled_covariance();
        let within = odometry.covariance.0.plus(&settled.0.scaled(-1.0));
        let rolled = self.map.update(
            &Told {
                pose: odometry.pose,
                covariance: settled,
                is_measured: odometry.outcome.is_ok(),
                is_keyframe: odometry.keyframe,
                companions: odometry
                    .outcome
                    .map_or(0, |found| found.beams.saturating_sub(points.len() as u16)),
            },
            self.robot_from_lidar,
            points,
        );
        // The map's axes are turned against those of odometry by what the map has corrected.
        let corrected = Pose::new(0.0, 0.0, rolled.pose.theta - odometry.pose.theta);
        let within = Covariance(within).rotated(corrected);
        RollingStep {
            pose: rolled.pose,
            covariance: rolled.covariance.plus(&within),
            is_matched: rolled.is_matched,
            odometry,
        }
    }

    /// Draws the map from where the robot is, where that is due: else the next scan does.
    fn work(&mut self, _budget: u32) -> bool {
        self.map.show();
        true
    }
}

impl RollingStep {
    /// Whether the scan became the first reference, or matched the odometry's.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        let step = &self.odometry;
        step.outcome.is_ok() || step.keyframe && step.outcome == Err(Refusal::First)
    }
}

impl Estimate for RollingStep {
    fn pose(&self) -> Option<Pose> {
        Some(self.pose)
    }

    fn covariance(&self) -> Option<Covariance> {
        Some(self.covariance)
    }

    fn verdict(&self) -> Verdict {
        self.odometry.verdict()
    }
}
