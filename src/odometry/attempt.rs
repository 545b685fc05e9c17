//! Matching a scan: at the prior, and where that fails at other poses and other turn rates.

use super::{
    fusion::MAX_DIFFERENCE,
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

    /// Fuses match and prior, and places the robot there. If the match implies another velocity than the scan was deskewed
    /// with, deskews and matches again first.
    #[inline(never)]
    pub(super) fn refine(
        &mut self,
        scan: &Scan<N>,
        (found, expected): (&mut Match, Twist),
        prior: &Prior,
        times: Times,
    ) {
        let back = -0.5 * times.duration;
        let (end, _) = self.robot_pose(found);
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
            if let Ok(again) = self.try_match(self.deskewed.pose, prior, self.rivals()) {
                *found = again;
                (self.deskewed.pose, _) = self.robot_pose(found);
                middle = self.deskewed.pose * during.displacement(back);
            }
        }
        self.place(found, (middle, during), prior, times);
    }

    /// Puts the robot where its match and its prior say: it was at `middle` in the middle of the scan, and moved as `during`
    /// says. Apart: so that its memory is not on the stack during a match.
    #[inline(never)]
    fn place(
        &mut self,
        found: &Match,
        (middle, during): (Pose, Twist),
        prior: &Prior,
        times: Times,
    ) {
        let half = during.displacement(0.5 * times.duration);
        let (_, of_match) = self.robot_pose(found);
        let unskewed = self.motion.unskewed(during, prior.source, times);
        let matched = middle * half * unskewed;
        let (pose, is_sure) = self.fuse(matched, &of_match, found, prior);
        // The points are seen from where fusion has moved the robot to.
        self.deskewed.pose = pose * matched.between(self.deskewed.pose);
        self.learn((matched, is_sure), &of_match, prior, found);
        let end = pose * unskewed.inverse();
        self.motion.advance(end, during, prior.wheel_twist, times);
        self.pose = pose;
        self.covariance = self
            .keyframe
            .covariance_at(pose, &self.tracking.covariance());
    }

    /// Tries other headings where the prior does not tell which of them it is, after a gap without wheels in a room that
    /// looks the same from several sides: takes the match that explains most, and refuses it if another explains about as
    /// much.
    #[inline(never)]
    pub(super) fn refuse_ambiguous(&self, prior: &Prior, best: &mut Attempt) {
        /// A heading known better than this (rad) decides between two sides of a hexagon.
        const SURE: f32 = 0.3;
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
        let sigma = math::sqrt(self.tracking.relative.0.tt);
        let Ok(found) = &*best.outcome else {
            return;
        };
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

    /// Learns from a match how good the wheels are.
    fn learn(
        &mut self,
        (matched, is_sure): (Pose, bool),
        of_match: &Covariance,
        prior: &Prior,
        found: &Match,
    ) {
        if prior.source == Source::Wheels && is_sure {
            let off = self.tracking.wheels.between(matched);
            self.wheel_errors
                .learn(off, self.config.prior_error, prior.motion, of_match);
        } else {
            self.wheel_errors.interrupt();
        }
        if found.degenerate_direction.is_none() {
            self.tracking.coasting = 0.0;
        }
    }

    /// Robot pose of a match, with its covariance relative to the keyframe.
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

/// Whether two motions skew a scan differently: by more than 1 cm or 0.3°.
fn differs(a: Pose, b: Pose) -> bool {
    let off = a.between(b);
    off.distance() > 0.01 || math::abs(off.theta) > 0.005
}
