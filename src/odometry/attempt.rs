//! Matching a scan: at the prior, and where that fails at other poses and other turn rates.

use super::{
    motion::Times,
    prior::{Prior, farther},
    state::Odometry,
    step::Refusal,
};
use crate::{
    geometry::{Pose, Twist},
    linalg::Covariance,
    matching::{Match, icp},
    math,
    scan::Scan,
};

/// A match that explains less than this share of the beams is tried again from another guess.
const UNSURE: f32 = 0.6;

/// The best match of a scan so far, and the velocity that the scan was deskewed with for it.
pub(super) struct Attempt<'a> {
    pub twist: Twist,
    /// In the step that is handed on: a second copy would lie on the stack during a match.
    pub outcome: &'a mut Result<Match, Refusal>,
}

impl Attempt<'_> {
    /// Whether too few beams agree for the match to be relied on.
    pub fn is_unsure(&self) -> bool {
        score(self.outcome) < UNSURE
    }
}

/// How well a match explains the scan: 0 for none.
fn score(outcome: &Result<Match, Refusal>) -> f32 {
    outcome.as_ref().map_or(0.0, |found| found.score)
}

impl<const N: usize> Odometry<N> {
    /// Matches the scan, deskewed with `twist`, at another pose, and takes that match if it explains the scan better.
    #[inline]
    fn improve(&self, best: &mut Attempt, twist: Twist, predicted: Pose) {
        let outcome = self.try_match(predicted);
        if score(&outcome) > score(best.outcome) {
            *best.outcome = outcome;
            best.twist = twist;
        }
    }

    /// Matches the scan at the fallback prior too. Apart, as the other retries are: so that a second result is on the stack
    /// only during its own match.
    #[inline(never)]
    pub(super) fn retry_fallback(&self, prior: &Prior, times: Times, best: &mut Attempt) {
        if let Some(guess) = self.fallback_prior(prior, times) {
            self.improve(best, best.twist, guess);
        }
    }

    /// Matches the scan as if the robot had turned one and two steps faster and slower than in the last one, until a
    /// match is sure; leaves the points deskewed for the best one.
    ///
    /// Without wheels and gyroscope nothing foretells a sudden rotation, and a scan that it skewed fits nowhere.
    #[inline(never)]
    pub(super) fn retry_turn_rates(&mut self, scan: &Scan<N>, times: Times, best: &mut Attempt) {
        /// Change of the turn rate that a step tries (rad/s²); two steps are a nimble robot's.
        const STEP: f32 = 4.0;
        let expected = best.twist;
        for steps in [1.0, -1.0, 2.0, -2.0] {
            let twist = Twist {
                omega: expected.omega + steps * STEP * times.duration,
                ..expected
            };
            self.deskewed.assign(scan, twist, &self.config.points);
            self.improve(best, twist, self.pose * twist.displacement(times.seconds));
            if !best.is_unsure() {
                break;
            }
        }
        if self.deskewed.twist != best.twist {
            self.deskewed.assign(scan, best.twist, &self.config.points);
        }
    }

    /// Robot pose at the scan's end, with its covariance. If the match implies another velocity than the scan was
    /// deskewed with, deskews and matches again.
    #[inline(never)]
    pub(super) fn refine(
        &mut self,
        scan: &Scan<N>,
        (found, expected): (&mut Match, Twist),
        prior: &Prior,
        times: Times,
    ) -> (Pose, Covariance) {
        let back = -0.5 * times.duration;
        let (end, mut covariance) = self.robot_pose(found);
        self.deskewed.pose = end;
        let mut middle = end * expected.displacement(back);
        let retried = prior.wheel_twist.is_none() && expected != prior.twist;
        let sudden = prior.wheel_twist.is_none() && (retried || self.refused_in_a_row > 0);
        let during = if sudden {
            // From the last scan's middle no velocity can be measured: that one's place was only a guess, or the velocity
            // has changed since, as the scan itself tells better.
            expected
        } else {
            let measured = self.motion.during(middle, prior.wheel_twist, times);
            match prior.turn_rate {
                Some(omega) if prior.wheel_twist.is_none() => Twist { omega, ..measured },
                _ => measured,
            }
        };
        if differs(
            expected.displacement(times.duration),
            during.displacement(times.duration),
        ) {
            self.deskewed.assign(scan, during, &self.config.points);
            self.deskewed.pose = middle * during.displacement(-back);
            if let Ok(again) = self.try_match(self.deskewed.pose) {
                *found = again;
                (self.deskewed.pose, covariance) = self.robot_pose(found);
                middle = self.deskewed.pose * during.displacement(back);
            }
        }
        let pose = middle * during.displacement(-back);
        self.motion.advance(pose, during, prior.wheel_twist, times);
        (pose, covariance)
    }

    /// Matches the points against the keyframe, starting from where the robot should be.
    pub(super) fn try_match(&self, predicted: Pose) -> Result<Match, Refusal> {
        if self.keyframe.reference.is_empty() {
            return Err(Refusal::First);
        }
        let motion = self.keyframe.pose.between(predicted);
        let guess = self.config.points.mount.lidar_motion(motion);
        let mut outcome = icp::align(
            &self.keyframe.reference,
            self.deskewed.points.as_slice(),
            guess,
            &self.config.icp,
        )
        .map_err(Refusal::NoMatch);
        if let Ok(found) = &outcome {
            let limit = self.config.max_correction * found.score;
            if let Some((distance, rotation)) = farther(guess, found.pose, limit) {
                outcome = Err(Refusal::TooFar { distance, rotation });
            }
        }
        outcome
    }

    /// Robot pose of a match, with its covariance.
    fn robot_pose(&self, found: &Match) -> (Pose, Covariance) {
        let mount = &self.config.points.mount;
        let pose = self.keyframe.pose * mount.robot_motion(found.pose);
        // The match is about the lidar: its error of heading moves the robot's centre about it.
        let start_from_lidar = pose * mount.robot_from_lidar;
        let lidar_frame = self.keyframe.pose * mount.robot_from_lidar;
        let of_match = found
            .covariance
            .rotated(lidar_frame)
            .transported(pose.x - start_from_lidar.x, pose.y - start_from_lidar.y);
        (pose, self.keyframe.covariance_at(pose, &of_match))
    }
}

/// Whether two motions skew a scan differently: by more than 1 cm or 0.3°.
fn differs(a: Pose, b: Pose) -> bool {
    let off = a.between(b);
    off.distance() > 0.01 || math::abs(off.theta) > 0.005
}
