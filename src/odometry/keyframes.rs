//! When a scan becomes the keyframe, and what is counted.

use super::{error_model::ANY_HEADING, state::Odometry, step::Refusal, tracking::Tracking};
use crate::{
    geometry::EgoMotion,
    linalg::{Covariance, Sym3},
    matching::{Match, icp},
    math,
};

impl<const N: usize> Odometry<N> {
    /// Whether later scans are to be matched against the one just placed; `acceleration` is the change of heading during
    /// it minus that during the scan before (rad).
    #[inline(never)]
    pub(super) fn is_keyframe(&self, outcome: &Result<Match, Refusal>, acceleration: f32) -> bool {
        /// A larger change of the rotation from scan to scan (rad) skews a scan by more than its noise.
        const MAX_ACCELERATION: f32 = 0.02;
        let config = &self.config;
        if self.deskewed.points.as_slice().len() < 2 * usize::from(config.icp.min_inliers) {
            return false;
        }
        match outcome {
            Err(Refusal::First) => true,
            Err(_) => self.refused_in_a_row.saturating_add(1) >= config.max_refused,
            // The first match after refused ones may be wrong, which the next ones tell as long as the keyframe is there.
            Ok(_) if self.refused_in_a_row > 0 => false,
            Ok(found) => {
                let moved = self.keyframe.pose.between(self.pose);
                let overlap = f32::from(found.overlap) / f32::from(found.beams.max(1));
                let near = if math::abs(acceleration) > MAX_ACCELERATION {
                    0.5
                } else {
                    1.0
                };
                near * moved.distance() > config.keyframe_distance
                    || near * math::abs(moved.theta) > config.keyframe_rotation
                    || overlap < config.keyframe_overlap
            }
        }
    }

    /// Counts what became of a scan.
    pub(super) fn note_outcome(&mut self, outcome: &Result<Match, Refusal>, keyframe: bool) {
        let counters = &mut self.counters;
        counters.scans = counters.scans.wrapping_add(1);
        counters.keyframes = counters.keyframes.wrapping_add(keyframe.into());
        match outcome {
            Ok(_) => self.refused_in_a_row = 0,
            Err(Refusal::First) => {}
            Err(_) => {
                counters.refused = counters.refused.wrapping_add(1);
                counters.lost = counters.lost.wrapping_add(keyframe.into());
                self.refused_in_a_row = if keyframe {
                    0
                } else {
                    self.refused_in_a_row.saturating_add(1)
                };
            }
        }
    }

    /// Makes the scan just placed the keyframe, its pose uncertain by a share of `skew` besides. Where its pose is known in all
    /// directions its points are first moved towards the surfaces of the keyframe before: so errors do not add up as long as these
    /// stay in sight.
    #[inline(never)]
    pub(super) fn keep(&mut self, outcome: &Result<Match, Refusal>, skew: &Covariance) {
        /// A keyframe's points are in place in the middle of the scan: they are bent by a sixth of what its end is off, where
        /// nothing on time told of the change.
        const BENT: f32 = 1.0 / 32.0;
        let (keyframe, scan) = (&mut self.keyframe, &mut self.deskewed);
        let motion = keyframe.pose.between(scan.pose);
        let pose = self.config.points.mount.lidar_motion(motion);
        if outcome.is_ok() {
            icp::remove_companions(&keyframe.reference, &mut scan.points, pose);
        }
        if outcome
            .as_ref()
            .is_ok_and(|found| found.degenerate_direction.is_none())
        {
            icp::smooth_towards(&keyframe.reference, scan.points.as_mut_slice(), pose);
        }
        keyframe.reference.assign(scan.points.as_slice());
        keyframe.pose = scan.pose;
        if matches!(outcome, Err(Refusal::NoMatch(_) | Refusal::TooFar { .. })) {
            self.covariance = self.covariance_when_lost();
        }
        let bent = BENT * self.lateness.share();
        self.covariance = self.covariance.plus(&Covariance(skew.0.scaled(bent)));
        self.keyframe.covariance = self.covariance;
        self.tracking = Tracking::at(self.pose, self.tracking.coasting);
        self.wheel_errors.interrupt();
    }

    /// Covariance of the pose once the keyframe is given up: near it scans should have matched, and the robot may have
    /// been carried anywhere since the last match, and turned.
    fn covariance_when_lost(&self) -> Covariance {
        /// From farther than this a keyframe is no longer in sight (m).
        const IN_SIGHT: f32 = 1.0;
        if self.keyframe.pose.between(self.pose).distance() > IN_SIGHT {
            return self.covariance;
        }
        let carried = 2.0 * EgoMotion::WALKING * self.tracking.blind;
        let (distance, rotation) = (carried * carried, ANY_HEADING * ANY_HEADING);
        self.covariance
            .plus(&Covariance(Sym3::diagonal(distance, distance, rotation)))
    }
}
