//! Where the robot is by its scans alone: each is matched against a keyframe, from a guess by wheels, gyroscope or the
//! last velocity.
//!
//! [`Odometry::update`] is the whole of it: predict, deskew, match, retry, refine, decide, keep. A keyframe (a scan that
//! later ones are matched against) stays as long as possible, because only a change of keyframe adds up errors.

mod attempt;
mod config;
mod deskew;
mod keyframes;
mod motion;
mod prior;
mod sparse;
mod state;
mod step;

pub use config::OdometryConfig;
pub use sparse::{SparseConfig, SparseOdometry};
pub use state::Odometry;
pub use step::{Counters, Refusal, Step};

use crate::{geometry::EgoMotion, math, scan::Scan};
use attempt::Attempt;

impl<const N: usize> Odometry<N> {
    /// Takes a scan in and says where the robot is.
    ///
    /// `ego` is the robot's motion since the last scan's end as its wheels and gyroscope measured it. Without them the
    /// last velocity is believed to go on; where that leads to no good match, the robot may also stand, or turn faster
    /// or slower. A scan without a usable match leaves the prediction as the pose, is counted, and says why.
    ///
    /// Costs a match or two, three with wheels that slip, and up to seven without wheels.
    pub fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        let times = self.times(scan);
        let last = self.motion.twist;
        let prior = self.predict(ego, times);

        self.deskewed.assign(scan, prior.twist, &self.config.points);
        let mut step = Step {
            pose: prior.pose,
            covariance: prior.covariance,
            outcome: self.try_match(prior.pose),
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
            self.retry_turn_rates(scan, times, &mut best);
        }

        self.deskewed.pose = prior.pose;
        match &mut *best.outcome {
            Ok(found) => {
                let refined = self.refine(scan, (found, best.twist), &prior, times);
                (step.pose, step.covariance) = refined;
            }
            Err(_) => self
                .motion
                .advance(prior.pose, best.twist, prior.wheel_twist, times),
        }
        (self.pose, self.covariance) = (step.pose, step.covariance);

        let acceleration = math::abs(self.motion.twist.omega - last.omega) * times.duration;
        step.keyframe = self.is_keyframe(&step.outcome, acceleration);
        if step.keyframe {
            self.keep(&step.outcome);
        }
        self.note_outcome(&step.outcome, step.keyframe);
        self.end_us = scan.end_us();
        step
    }
}
