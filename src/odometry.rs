//! Scan-to-keyframe odometry: each scan is matched against a keyframe, from a pose predicted by wheels, gyroscope or the
//! last velocity; match and prediction are then fused, weighted by their covariances.
//!
//! [`Odometry::update`] is the whole of it: predict, deskew, match, retry, reject; then refine and fuse, or coast; then keep
//! as a keyframe. A keyframe (a scan that later ones are matched against) stays as long as possible, because only a change
//! of keyframe and a scan without a match add up errors.

mod attempt;
mod config;
mod deskew;
mod error_model;
mod fusion;
mod keyframes;
mod lateness;
mod motion;
mod prior;
mod refine;
mod residuals;
mod sparse;
mod state;
mod step;
mod tracking;

pub use config::OdometryConfig;
pub use sparse::{SparseConfig, SparseOdometry};
pub use state::Odometry;
pub use step::{Counters, Refusal, Step};

use crate::{
    geometry::{EgoMotion, Pose, Twist},
    linalg::{Covariance, Sym3},
    matching::{Match, MatchError},
    math,
    scan::Scan,
};
use attempt::Attempt;
use motion::{Source, Times};
use prior::Prior;

impl<const N: usize> Odometry<N> {
    /// Takes a scan in and says where the robot is.
    ///
    /// `ego` is the robot's motion since the last scan's end as its wheels and gyroscope measured it. Without wheels the
    /// last velocity is believed to go on, at the gyroscope's rate of turn where there is one. Where the prediction leads to
    /// no good match, others are tried: with wheels the last velocity, without them a standing robot; and, without either
    /// wheels or gyroscope, one that turns faster or slower.
    ///
    /// [`Step::pose`] is the fused pose, not the match's. A scan without a usable match leaves the prediction as the pose,
    /// is counted, and says why; after [`OdometryConfig::max_refused`] of them in a row the scan becomes the keyframe, which
    /// [`Counters::lost`] tells.
    ///
    /// Costs a match or two, and one more where a turn sets in without wheels: the README's table has the dearest of an ordinary
    /// drive. A scan that fits nowhere costs several times a usual one, as other starts compete then; a bounded number of them.
    pub fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        let times = self.times(scan);
        let last = self.motion.twist;
        let prior = self.predict(ego, times);

        self.deskewed.assign(scan, prior.twist, &self.config.points);
        let mut step = Step {
            pose: prior.pose,
            covariance: self.covariance,
            outcome: self.try_match(prior.pose, &prior, self.rivals()),
            keyframe: false,
        };
        let mut best = Attempt {
            twist: prior.twist,
            outcome: &mut step.outcome,
        };
        if best.is_unsure() {
            self.retry_fallback(&prior, times, &mut best);
        }
        if best.is_unsure() && self.may_retry_turn_rates(&prior, times) {
            self.retry_turn_rates(scan, times, &prior, &mut best);
        }
        self.refuse_contradicting(&prior, times, &mut best);
        self.refuse_ambiguous(&prior, &mut best);

        self.deskewed.pose = prior.pose;
        let mut missed = 0.0;
        match &mut *best.outcome {
            Ok(found) => {
                missed = self.refine(scan, (found, best.twist), &prior, times);
            }
            Err(refusal) => {
                let covered = matches!(refusal, Refusal::NoMatch(MatchError::TooFewBeams { .. }));
                self.coast(&prior, best.twist, times, covered);
            }
        }

        self.conclude(&mut step, (last, missed), &prior, times);
        self.end_us = Some(scan.end_us());
        step
    }

    /// Finishes a step: the decision about a keyframe, the counters, and the covariance of the motion within the scan, which
    /// no match sees. `last` is the velocity during the scan before, `missed` the rotation that the wheels missed since then more than
    /// before (rad).
    #[inline(never)]
    fn conclude(
        &mut self,
        step: &mut Step,
        (last, missed): (Twist, f32),
        prior: &Prior,
        times: Times,
    ) {
        /// Of a turn that sets in at any moment of a scan and is not told, the middle sees up to a third, 2.6 times less than the
        /// end has turned on the mean; half of what the middle sees is added to the end with the velocity.
        const UNTOLD: f32 = 2.0;
        let change = (self.motion.twist.omega - last.omega) * times.duration;
        let mut unforeseen = error_model::unforeseen(times.duration).0;
        let skew = self.skew(&step.outcome, last, prior, times);
        step.keyframe = self.is_keyframe(&step.outcome, change);
        if step.keyframe {
            self.keep(&step.outcome, &skew);
        }
        self.note_outcome(&step.outcome, step.keyframe);
        if prior.source == Source::Wheels {
            // What the robot has done since the middle of the scan is known by the wheels alone.
            let scan = if times.seconds > 0.0 {
                math::min(times.duration / times.seconds, 1.0)
            } else {
                1.0
            };
            let untold = UNTOLD * scan * missed;
            let mut since = prior.growth.0.scaled(0.25 * scan * scan);
            since.tt = math::max(since.tt, untold * untold);
            let left = self.lateness.unforeseen(unforeseen.tt);
            unforeseen = unforeseen.scaled(left).plus(&since);
        }
        step.pose = self.pose;
        step.covariance = self.covariance.plus(&skew).plus(&Covariance(unforeseen));
    }

    /// Covariance that the change of velocity since the last scan, whose velocity was `last`, adds to a matched pose.
    fn skew(
        &mut self,
        outcome: &Result<Match, Refusal>,
        last: Twist,
        prior: &Prior,
        times: Times,
    ) -> Covariance {
        /// Largest difference between the rotation by the wheels and the one that was found that is believed (rad).
        const MAX_ROTATION: f32 = 0.35;
        let range = self.mean_range();
        outcome
            .as_ref()
            .map_or(Covariance(Sym3::diagonal(0.0, 0.0, 0.0)), |found| {
                let bent = self.motion.residuals.bent(found.residual, range);
                let mut change = self.motion.twist.minus(last);
                // Wheels that jumped may still have told a rotation.
                let said = self.motion.said.theta - self.motion.twist.omega * times.seconds;
                if math::abs(said) < MAX_ROTATION {
                    let said = Twist::from_motion(Pose::new(0.0, 0.0, said), times.seconds).omega;
                    change.omega = math::max(math::abs(change.omega), math::abs(said));
                }
                if self.refused_in_a_row > 0
                    && prior.source == Source::Velocity
                    && prior.turn_rate.is_none()
                {
                    // Between two matches a velocity is measured: after refused scans there was none.
                    let since = times.seconds * f32::from(self.refused_in_a_row + 1);
                    let unknown = error_model::turn_rate_after(since);
                    change.omega = math::max(math::abs(change.omega), unknown);
                }
                let told = (&found.covariance, range, bent);
                let source = (prior.source, self.lateness.share());
                error_model::skew(change, times.duration, source, told)
            })
    }

    /// How far away the scan's places are on the mean (m).
    fn mean_range(&self) -> f32 {
        let points = self.deskewed.points.as_slice();
        let sum: u32 = points.iter().map(|point| u32::from(point.range)).sum();
        1e-3 * sum as f32 / points.len().max(1) as f32
    }

    /// Takes the prior as the pose: the scan has no match.
    #[inline(never)]
    fn coast(&mut self, prior: &Prior, twist: Twist, times: Times, covered: bool) {
        self.motion
            .advance(prior.pose, twist, prior.wheel_twist, times);
        self.motion.note_rate(None);
        self.wheel_errors.interrupt();
        let tracking = &mut self.tracking;
        tracking.blind += times.elapsed;
        tracking.covered |= covered;
        self.pose = prior.pose;
        self.covariance = self
            .keyframe
            .covariance_at(prior.pose, &self.tracking.covariance());
    }
}
