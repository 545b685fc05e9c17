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
mod step;

pub use config::OdometryConfig;
pub use step::{Counters, Refusal, Step};

use crate::{
    geometry::{EgoMotion, Pose, Twist},
    keyframe::Keyframe,
    linalg::{Covariance, Sym3},
    matching::icp::Reference,
    math,
    scan::{Points, Scan},
};
use attempt::Attempt;
use deskew::Deskewed;
use motion::Motion;

/// Pose from scans, in fixed memory.
///
/// 20·N + 300 bytes: a keyframe's lines and the current scan's points. N is the most beams of a revolution; beyond that
/// it does not change the result, which depends on [`OdometryConfig::directions`] alone.
#[derive(Debug, Clone)]
pub struct Odometry<const N: usize> {
    config: OdometryConfig,
    deskewed: Deskewed<N>,
    keyframe: Keyframe<Reference<N>>,
    pose: Pose,
    covariance: Covariance,
    motion: Motion,
    end_us: u32,
    refused_in_a_row: u8,
    counters: Counters,
}

impl<const N: usize> Odometry<N> {
    /// At the origin, with nothing seen yet.
    #[must_use]
    pub const fn new(config: OdometryConfig) -> Self {
        Self {
            config,
            deskewed: Deskewed::EMPTY,
            keyframe: Keyframe::at_origin(Reference::with_directions(config.directions)),
            pose: Pose::IDENTITY,
            covariance: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
            motion: Motion::STANDING,
            end_us: 0,
            refused_in_a_row: 0,
            counters: Counters {
                scans: 0,
                refused: 0,
                keyframes: 0,
                lost: 0,
            },
        }
    }

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
        let mut best = Attempt {
            twist: prior.twist,
            outcome: self.try_match(prior.pose),
        };
        if best.is_unsure() {
            self.retry_fallback(&prior, times, &mut best);
        }
        if best.is_unsure() && self.may_retry_turn_rates(&prior, times) {
            self.retry_turn_rates(scan, times, &mut best);
        }

        self.deskewed.pose = prior.pose;
        (self.pose, self.covariance) = match &mut best.outcome {
            Ok(found) => self.refine(scan, (found, best.twist), &prior, times),
            Err(_) => {
                self.motion
                    .advance(prior.pose, best.twist, prior.wheel_twist, times);
                (prior.pose, prior.covariance)
            }
        };

        let acceleration = math::abs(self.motion.twist.omega - last.omega) * times.duration;
        let keyframe = self.is_keyframe(&best.outcome, acceleration);
        if keyframe {
            self.keep(&best.outcome);
        }
        self.note_outcome(&best.outcome, keyframe);
        self.end_us = scan.end_us();
        Step {
            pose: self.pose,
            covariance: self.covariance,
            outcome: best.outcome,
            keyframe,
        }
    }

    /// The robot at the end of the last scan, in the frame in which it started (m, rad).
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// The robot's velocity during the last scan.
    #[must_use]
    pub const fn twist(&self) -> Twist {
        self.motion.twist
    }

    /// The last scan's points, in the lidar's frame at the scan's end.
    #[must_use]
    pub const fn points(&self) -> &Points<N> {
        &self.deskewed.points
    }

    /// The scan that the next one is matched against, and where the robot was.
    #[must_use]
    pub const fn keyframe(&self) -> &Keyframe<Reference<N>> {
        &self.keyframe
    }

    /// Scans, refusals and keyframes since the start.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }
}

/// How far apart two poses are (m, rad), if by more than `limit` metres or twice as many radians.
fn farther(a: Pose, b: Pose, limit: f32) -> Option<(f32, f32)> {
    let off = a.between(b);
    let (distance, rotation) = (off.distance(), math::abs(off.theta));
    (distance > limit || rotation > 2.0 * limit).then_some((distance, rotation))
}
