//! Where the robot is by its match and its prior, each weighed by its covariance.

use super::{
    motion::{Source, Times},
    prior::Prior,
    state::Odometry,
};
use crate::{
    geometry::{EgoMotion, Pose},
    linalg::{Covariance, Sym3},
    matching::Match,
    math,
};

/// A match that explains less than this share of the beams is tried again from another guess, and is no better than the prior
/// that it contradicts.
pub(super) const UNSURE: f32 = 0.6;
/// A direction that a smaller share of the beams constrains may be told by something that moves along with the robot:
/// a person 1 m away, a trailer, a mast hide up to a sixth of the view.
const COMPANION: f32 = 0.17;
/// What was doubted is believed again from so many beams on: half as many more.
const CERTAIN: f32 = 0.25;
/// A match that says "stands" is doubted without wheels, which could contradict it, below this share: one person 1 m away.
const COMPANION_ALONE: f32 = 0.1;
/// A match that contradicts the last velocity by more standard deviations than so many is doubted where few beams tell it.
const MAX_SIGMAS: f32 = 3.0;
/// A robot that is slower than this is taken to stand (m/s).
const STANDING: f32 = 0.1;
/// Largest squared difference of match and prior, normalised by their covariances, at which both are believed: one in
/// ten thousand is larger by chance.
pub(super) const MAX_DIFFERENCE: f32 = 21.0;

/// A covariance with as much added to every direction as rounding takes from it where another one is much larger.
fn invertible(covariance: &Sym3) -> Sym3 {
    /// What rounding takes from a small direction, as a share of all: some units in the last place of an `f32`.
    const ROUNDING: f32 = 2e-6;
    let most = ROUNDING * (covariance.xx + covariance.yy + covariance.tt);
    // A rotation is counted at 3 m.
    covariance.plus(&Sym3::diagonal(most, most, most / 9.0))
}

/// The direction in which the beams constrain the position least, and their share: from the information of a match,
/// whose trace over x and y is that of all beams.
fn weakest(information: &Sym3) -> ([f32; 2], f32) {
    let (a, b, c) = (information.xx, information.xy, information.yy);
    let (mean, half) = (0.5 * (a + c), 0.5 * (a - c));
    let root = math::sqrt(half * half + b * b);
    let share = if mean > 0.0 {
        0.5 * (mean - root) / mean
    } else {
        0.0
    };
    // Eigenvector of the smaller eigenvalue: the half angle of (half, b), turned by a right angle.
    let angle = 0.5 * math::atan2(b, half) + core::f32::consts::FRAC_PI_2;
    let (s, c) = math::sin_cos(angle);
    ([c, s], share)
}

/// Length of a difference of two poses (m), a rotation counted at 1 m.
fn length([x, y, theta]: [f32; 3]) -> f32 {
    math::sqrt(x * x + y * y + theta * theta)
}

/// The longer of two differences of poses.
fn larger(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    if length(b) > length(a) { b } else { a }
}

impl<const N: usize> Odometry<N> {
    /// Pose by the match that put the robot at `measured` with covariance `of_match`, and by the prior; and whether enough
    /// beams constrain every direction for no companion to have told it.
    pub(super) fn fuse(
        &mut self,
        measured: Pose,
        of_match: &Covariance,
        found: &Match,
        prior: &Prior,
        times: Times,
    ) -> (Pose, bool) {
        let off = [
            measured.x - prior.pose.x,
            measured.y - prior.pose.y,
            math::wrap_angle(measured.theta - prior.pose.theta),
        ];
        let tracking = &mut self.tracking;
        (tracking.blind, tracking.covered) = (0.0, false);
        let p = tracking.relative.0;
        // Half of a match's noise is the keyframe's, and the same for all matches with it.
        let own = of_match.0.scaled(0.5);
        let mut r = own;
        let heading = Pose::new(
            0.0,
            0.0,
            self.keyframe.pose.theta + self.config.points.mount.robot_from_lidar.theta,
        );
        let mut doubt = [0.0; 3];
        let (mut is_sure, mut is_certain) = (false, false);
        let is_unsure = found.score < UNSURE;
        // Direction that few beams constrain, and how far off along it a match may be that something moving along told.
        let mut weak = None;
        if let Some(degenerate) = &found.degenerate_direction {
            // Along it the match is the guess once more.
            let [x, y, t] = degenerate.direction;
            let turned = heading * Pose::new(x, y, 0.0);
            let along = [turned.x, turned.y, t / degenerate.lever];
            r = r.plus(&Sym3::outer(along).scaled(30.0 * (p.xx + p.yy + p.tt)));
        } else {
            let information = Covariance(found.information.0).rotated(heading).0;
            let ([ux, uy], share) = weakest(&information);
            (is_sure, is_certain) = (share >= COMPANION, share >= CERTAIN);
            if !is_sure {
                let along = ux * off[0] + uy * off[1];
                let since = self.keyframe.pose;
                let moved = ux * (prior.pose.x - since.x) + uy * (prior.pose.y - since.y);
                if prior.source == Source::Wheels && self.wheel_errors.are_steady() {
                    // Nearer to what moves along than to the world, by more than the match's noise.
                    let sigma = math::sqrt(own.quadratic([ux, uy, 0.0]));
                    if math::abs(along) > 0.25 * math::abs(moved) + 2.0 * sigma {
                        r = r.plus(&Sym3::outer([ux, uy, 0.0]).scaled(4.0 * along * along));
                        doubt = [ux * along, uy * along, 0.0];
                    }
                } else if prior.source == Source::Velocity {
                    weak = Some(([ux, uy], along));
                    // The match says that the robot stands: it may also drive, and all that tells it move along.
                    let straight = math::abs(math::wrap_angle(measured.theta - since.theta)) < 0.2;
                    let stands = math::abs(moved + along) < STANDING * tracking.seconds;
                    if share < COMPANION_ALONE && stands && straight {
                        let walked = EgoMotion::WALKING * tracking.seconds;
                        doubt = [ux * walked, uy * walked, 0.0];
                    }
                }
            }
        }
        let difference = p
            .plus(&r)
            .inverse()
            .map_or(f32::INFINITY, |information| information.quadratic(off));
        // A match that contradicts the last velocity in a direction that something moving along may tell: the robot may have gone
        // on as before.
        if let Some(([ux, uy], along)) = weak
            && along * along > MAX_SIGMAS * MAX_SIGMAS * p.plus(&r).quadratic([ux, uy, 0.0])
        {
            doubt = larger(doubt, [ux * along, uy * along, 0.0]);
        }
        let mut p = p;
        if prior.source == Source::Wheels {
            self.wheel_errors.note(difference <= MAX_DIFFERENCE);
        }
        if difference > MAX_DIFFERENCE {
            self.counters.contradicted = self.counters.contradicted.wrapping_add(1);
            // A match that explains little of the scan is no better than the prior.
            if is_unsure {
                doubt = larger(doubt, off);
            }
            // The prior is as wrong as the match says.
            p = p.plus(&Sym3::outer(off));
        }
        // Against the same keyframe what was doubted once stays so, until enough beams know better in every direction: meanwhile
        // the matches and the velocity before part.
        let [x, y, _] = tracking.doubt;
        if (x, y) == (0.0, 0.0) {
            let (s, c) = math::sin_cos(self.pose.theta);
            let last = self.motion.twist;
            tracking.before = [c * last.vx - s * last.vy, s * last.vx + c * last.vy];
        } else if is_unsure || !is_certain {
            let [vx, vy] = tracking.before;
            let seconds = times.elapsed;
            let parted = [
                x + measured.x - self.pose.x - seconds * vx,
                y + measured.y - self.pose.y - seconds * vy,
                0.0,
            ];
            doubt = larger(doubt, parted);
        }
        tracking.doubt = doubt;
        let both = invertible(&p).inverse().zip(invertible(&r).inverse());
        let fused = both.and_then(|(prior_information, match_information)| {
            let relative = prior_information.plus(&match_information).inverse()?;
            Some((relative, relative.times(match_information.times(off))))
        });
        let (relative, pulled) = fused.unwrap_or((p, off));
        let pose = Pose::new(
            prior.pose.x + pulled[0],
            prior.pose.y + pulled[1],
            prior.pose.theta + pulled[2],
        );
        // Trace of the gain: 1 where the match alone counts, 0 where the prior does.
        let kept = (relative.xx / p.xx + relative.yy / p.yy + relative.tt / p.tt) / 3.0;
        let gain = math::max(1.0 - kept, 0.0);
        tracking.relative = Covariance(relative);
        tracking.noise = Covariance(own.scaled(0.25));
        tracking.shared += (1.0 - tracking.shared) * gain;
        (pose, is_sure)
    }
}
