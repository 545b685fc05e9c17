//! Matching a scan: at the prior, and where that fails at other poses and other turn rates.

use super::{
    fusion::{MAX_DIFFERENCE, UNSURE},
    motion::{Source, Times},
    prior::{Prior, farther},
    state::Odometry,
    step::Refusal,
};
use crate::{
    geometry::{Pose, Twist},
    linalg::Covariance,
    matching::{
        Match, MatchError,
        icp::{self, Guess, Rivals},
    },
    math,
    scan::Scan,
};

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
    fn improve(&self, best: &mut Attempt, (twist, predicted): (Twist, Pose), prior: &Prior) {
        let outcome = self.try_match(predicted, prior, self.rivals());
        if score(&outcome) > score(best.outcome) {
            *best.outcome = outcome;
            best.twist = twist;
        }
    }

    /// Whether a pose alone, without the starts around it, leads to a match that explains more than the best one. Stops
    /// after the coarse passes where its score cannot become higher than the best one's.
    #[inline(never)]
    fn is_promising(&self, best: &Attempt, predicted: Pose, prior: &Prior) -> bool {
        let known = score(best.outcome);
        score(&self.try_match(predicted, prior, Rivals::None(known))) > known
    }

    /// Matches the scan at the fallback prior too. Apart, as the other retries are: so that a second result is on the stack
    /// only during its own match.
    #[inline(never)]
    pub(super) fn retry_fallback(&self, prior: &Prior, times: Times, best: &mut Attempt) {
        if let Some(guess) = self.fallback_prior(prior, times)
            && (prior.wheel_twist.is_some() || self.is_promising(best, guess, prior))
        {
            self.improve(best, (best.twist, guess), prior);
        }
    }

    /// Matches the scan as if the robot had turned one and two steps faster and slower than in the last one, until a
    /// match is sure; leaves the points deskewed for the best one.
    ///
    /// Without wheels and gyroscope nothing foretells a sudden rotation, and a scan that it skewed fits nowhere.
    #[inline(never)]
    pub(super) fn retry_turn_rates(
        &mut self,
        scan: &Scan<N>,
        times: Times,
        prior: &Prior,
        best: &mut Attempt,
    ) {
        /// Change of the turn rate that a step tries (rad/s²); two steps are a nimble robot's.
        const STEP: f32 = 4.0;
        let expected = best.twist;
        for steps in [1.0, -1.0, 2.0, -2.0] {
            let twist = Twist {
                omega: expected.omega + steps * STEP * times.duration,
                ..expected
            };
            self.deskewed.assign(scan, twist, &self.config.points);
            let predicted = self.pose * twist.displacement(times.seconds);
            if self.is_promising(best, predicted, prior) {
                self.improve(best, (twist, predicted), prior);
            }
            if !best.is_unsure() {
                break;
            }
        }
        if self.deskewed.twist != best.twist {
            self.deskewed.assign(scan, best.twist, &self.config.points);
        }
    }

    /// Tries other headings where the prior does not tell which of them it is, after a gap without wheels in a room that
    /// looks the same from several sides: takes the match that explains most, and refuses it if another explains about as
    /// much.
    #[inline(never)]
    pub(super) fn refuse_ambiguous(&self, prior: &Prior, best: &mut Attempt) {
        /// A heading known better than this (rad) decides between two sides of a hexagon.
        const SURE: f32 = 0.3;
        /// Farther away than this (m) there are more places than starts: one of them fits by chance, but not most of a scan.
        const FAR: f32 = 3.0;
        /// Headings that are tried, 30° apart: a room of three, four or six equal sides has its others there.
        const SIDES: u8 = 12;
        /// A match whose heading differs by more than this (rad) is another one.
        const APART: f32 = 0.3;
        /// A match elsewhere that explains this share of what the best does is as good.
        const AS_GOOD: f32 = 0.95;
        /// The same where it explains more than the match at the prior, which is the likelier one before the scan is seen.
        const FAR_BETTER: f32 = 0.7;
        /// A heading farther from the prior than so many standard deviations is none that the robot may have.
        const MAX_SIGMAS: f32 = 3.0;
        // Of all beams: of a scan that sees half of the view, other beams meet the keyframe.
        let explained = |found: &Match| found.score * f32::from(found.overlap);
        let known = &self.tracking.relative.0;
        let sigma = math::sqrt(known.tt);
        let Ok(found) = &*best.outcome else {
            return;
        };
        if found.score < UNSURE && known.xx + known.yy > FAR * FAR {
            *best.outcome = Err(Refusal::NoMatch(MatchError::Unlikely {
                score: found.score,
            }));
            return;
        }
        if sigma < SURE {
            return;
        }
        let points = self.deskewed.points.as_slice();
        // About the middle of what is seen.
        let sum = points.iter().fold((0, 0), |(x, y), point| {
            (x + i32::from(point.x), y + i32::from(point.y))
        });
        let scale = 1e-3 / points.len() as f32;
        let middle = Pose::new(sum.0 as f32 * scale, sum.1 as f32 * scale, 0.0);
        let (reference, first) = (&self.keyframe.reference, found.pose);
        let mut rival = 0.0;
        for side in 1..SIDES {
            let rotation = f32::from(side) * core::f32::consts::TAU / f32::from(SIDES);
            let turned = middle * Pose::new(0.0, 0.0, rotation) * middle.inverse();
            // What explains less than this can be no rival.
            let least = FAR_BETTER * best.outcome.as_ref().map_or(0.0, |found| found.score);
            let guess = Guess {
                pose: first * turned,
                is_decided: false,
                rivals: Rivals::None(least),
            };
            let other = icp::align_from(reference, points, guess, &self.config.icp);
            if let (Ok(other), Ok(found)) = (other, &mut *best.outcome)
                && math::abs(math::wrap_angle(other.pose.theta - found.pose.theta)) > APART
                && self.is_credible_heading(&other, prior, MAX_SIGMAS * sigma)
            {
                let (worth, most) = (explained(&other), explained(found));
                rival = math::max(rival, math::min(worth, most));
                if worth > most {
                    *found = other;
                }
            }
        }
        if let Ok(found) = &*best.outcome
            && rival
                > explained(found)
                    * if found.pose == first {
                        AS_GOOD
                    } else {
                        FAR_BETTER
                    }
        {
            let ratio = rival / explained(found);
            *best.outcome = Err(Refusal::NoMatch(MatchError::Ambiguous { ratio }));
        }
    }

    /// Whether a match has the robot's heading within `most` (rad) of the prior's.
    fn is_credible_heading(&self, found: &Match, prior: &Prior, most: f32) -> bool {
        let (pose, _) = self.robot_pose(found);
        math::abs(math::wrap_angle(pose.theta - prior.pose.theta)) < most
    }

    /// Matches the points against the keyframe, starting from where the robot should be.
    #[inline(never)]
    pub(super) fn try_match(
        &self,
        predicted: Pose,
        prior: &Prior,
        rivals: Rivals,
    ) -> Result<Match, Refusal> {
        let needed = self.config.icp.min_inliers.saturating_mul(2);
        let points = self.deskewed.points.as_slice();
        if self.keyframe.reference.is_empty() {
            let found = points.len() as u16;
            return Err(if found < needed {
                Refusal::NoMatch(MatchError::TooFewBeams { found, needed })
            } else {
                Refusal::First
            });
        }
        let motion = self.keyframe.pose.between(predicted);
        let guess = Guess {
            pose: self.config.points.mount.lidar_motion(motion),
            is_decided: self.is_decided(prior),
            rivals,
        };
        let (reference, config) = (&self.keyframe.reference, &self.config.icp);
        match icp::align_from(reference, points, guess, config) {
            Ok(found) => self.near_enough(found, guess.pose),
            Err(error) => Err(Refusal::NoMatch(error)),
        }
    }

    /// The starts that may compete with a prediction: few where the heading is known to 20° (four standard deviations), else
    /// all.
    pub(super) fn rivals(&self) -> Rivals {
        /// So many standard deviations of the heading are within the starts near by (20°).
        const MAX_SIGMAS: f32 = 4.0;
        const NEAR: f32 = 0.35;
        if MAX_SIGMAS * math::sqrt(self.tracking.relative.0.tt) < NEAR {
            Rivals::Near
        } else {
            Rivals::All
        }
    }

    /// Whether the prior tells two poses apart that a match may confuse. After a scan with a match only the motion since then
    /// is uncertain: its place is the one that its match chose.
    fn is_decided(&self, prior: &Prior) -> bool {
        /// Two poses of a match that differ by less (m, a rotation counted at 3 m) are one.
        const SAME: f32 = 0.15;
        let known = if self.refused_in_a_row == 0 {
            &prior.growth.0
        } else {
            &self.tracking.relative.0
        };
        known.xx + known.yy + 9.0 * known.tt < SAME * SAME
    }

    /// A match, unless it is too far from its guess: farther than [`OdometryConfig::max_correction`](super::OdometryConfig)
    /// allows, and two standard deviations of the guess.
    #[inline]
    fn near_enough(&self, found: Match, guess: Pose) -> Result<Match, Refusal> {
        let limit = self.config.max_correction * found.score;
        let p = &self.tracking.relative.0;
        let far = limit + 2.0 * math::sqrt(p.xx + p.yy);
        let turned = 2.0 * limit + 2.0 * math::sqrt(p.tt);
        match farther(guess, found.pose, (far, turned)) {
            Some((distance, rotation)) => Err(Refusal::TooFar { distance, rotation }),
            None => Ok(found),
        }
    }

    /// Refuses a match that contradicts the wheels, where it is not sure by itself: it explains little of the scan, and the
    /// wheels were right up to now; or the lidar was covered, and the robot may have been carried elsewhere.
    #[inline(never)]
    pub(super) fn refuse_contradicting(&self, prior: &Prior, times: Times, best: &mut Attempt) {
        let Ok(found) = &*best.outcome else {
            return;
        };
        /// After so many refused scans in a row a match is not refused for contradicting the wheels: they are wrong then.
        const MAX_DOUBTED: u8 = 2;
        let doubtful = best.is_unsure()
            && self.refused_in_a_row < MAX_DOUBTED
            && self.wheel_errors.were_right();
        if prior.source != Source::Wheels || !(doubtful || self.tracking.covered) {
            return;
        }
        let (measured, of_match) = self.robot_pose(found);
        let contradicts = |pose: Pose| {
            normalised(&self.tracking.relative, &of_match, pose, measured) > MAX_DIFFERENCE
        };
        // The wheels may be wrong, but not what the robot did up to now as well.
        let coasting = self.pose * self.motion.twist.displacement(times.seconds);
        if contradicts(prior.pose) && contradicts(coasting) {
            let off = prior.pose.between(measured);
            *best.outcome = Err(Refusal::TooFar {
                distance: off.distance(),
                rotation: math::abs(off.theta),
            });
        }
    }

    /// Robot pose of a match, with its covariance relative to the keyframe.
    pub(super) fn robot_pose(&self, found: &Match) -> (Pose, Covariance) {
        let mount = &self.config.points.mount;
        let pose = self.keyframe.pose * mount.robot_motion(found.pose);
        // The match is about the lidar: its error of heading moves the robot's centre about it.
        let start_from_lidar = pose * mount.robot_from_lidar;
        let lidar_frame = self.keyframe.pose * mount.robot_from_lidar;
        let of_match = found
            .covariance
            .rotated(lidar_frame)
            .transported(pose.x - start_from_lidar.x, pose.y - start_from_lidar.y);
        (pose, of_match)
    }
}

/// Squared distance of two poses, normalised by the covariances of both.
fn normalised(a: &Covariance, b: &Covariance, from: Pose, to: Pose) -> f32 {
    let off = [
        to.x - from.x,
        to.y - from.y,
        math::wrap_angle(to.theta - from.theta),
    ];
    let information = a.0.plus(&b.0).inverse();
    information.map_or(f32::INFINITY, |information| information.quadratic(off))
}
