//! Where the robot is by its scans: each matched against a keyframe, with wheel odometry or its own speed as the
//! guess.
//!
//! A scan that becomes the keyframe is first fused with the one before: what stays in sight is known ever better instead
//! of being measured anew, and the pose drifts by what comes into sight.

mod motion;

use self::motion::{Motion, Times};
use crate::{
    geometry::{Pose, Twist},
    linalg::{Covariance, Sym3},
    matching::{
        Match, MatchError,
        icp::{self, IcpConfig, Reference},
    },
    math,
    scan::{Mount, Points, PointsConfig, Scan},
};

/// Settings of [`Odometry`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryConfig {
    /// How the lidar sits on the robot. Default: at its centre, upright, looking forward.
    pub mount: Mount,
    /// Shortest range that is used (m). Default 0.05.
    pub min_range: f32,
    /// Longest range that is used (m). Default 32.
    pub max_range: f32,
    /// Scans of more beams are thinned by averaging neighbours: see [`PointsConfig::enough`]. Default `u16::MAX`: every
    /// beam counts. Fewer cost less and drift more.
    pub enough: u16,
    /// A new keyframe is made this far from the last one (m). Default 0.4: near enough for most surfaces to be seen by
    /// both, far enough for errors not to add up often.
    pub keyframe_distance: f32,
    /// A new keyframe is made this much turned from the last one (rad). Default 0.8. While the turn quickens or slows a
    /// scan is bent as no twist tells: then this and the distance may be twice as much.
    pub keyframe_turn: f32,
    /// A new keyframe is made when fewer than this share of the beams meet the last one's surfaces. Default 0.6.
    pub keyframe_overlap: f32,
    /// A match that explains every beam may be this far from the guess (m, and rad at twice its value), one that explains
    /// half of them half as far. Default 0.45: wheels that slip or spin, not another room.
    pub max_correction: f32,
    /// Error of the guess, as a share of the distance and of the turn. Default 0.1.
    pub prior_error: f32,
    /// Scans refused one after the other before the keyframe is given up. Default 10: who stands before the lidar for
    /// less than a second costs nothing.
    pub max_refused: u8,
    /// The matcher's settings. Default [`IcpConfig::DEFAULT`], but a direction is degenerate below a share of 0.035: along a
    /// corridor the guess is better than what a few beams tell.
    pub icp: IcpConfig,
}

impl OdometryConfig {
    /// For a wheeled robot with a lidar of 5 to 15 turns a second.
    pub const DEFAULT: Self = Self {
        mount: Mount::DEFAULT,
        min_range: 0.05,
        max_range: 32.0,
        enough: u16::MAX,
        keyframe_distance: 0.4,
        keyframe_turn: 0.8,
        keyframe_overlap: 0.6,
        max_correction: 0.45,
        prior_error: 0.1,
        max_refused: 10,
        icp: IcpConfig {
            min_constraint_share: 0.035,
            ..IcpConfig::DEFAULT
        },
    };
}

impl Default for OdometryConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What [`Odometry::update`] made of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// The robot at the scan's end, in the frame in which it started.
    pub pose: Pose,
    /// How far off `pose` may be by now.
    pub covariance: Covariance,
    /// The match against the keyframe, or why `pose` is only the guess.
    pub outcome: Result<Match, Refusal>,
    /// This scan is the new keyframe.
    pub keyframe: bool,
}

/// Why a scan gave no pose of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// The first scan: there was nothing to match against.
    First,
    /// The matcher found no pose.
    NoMatch(MatchError),
    /// The match is too far from the guess to be believed.
    TooFar {
        /// How far (m).
        distance: f32,
        /// How much turned (rad).
        turn: f32,
    },
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::First => f.write_str("the first scan has nothing to be matched against"),
            Self::NoMatch(error) => error.fmt(f),
            Self::TooFar { distance, turn } => {
                write!(f, "the match is {distance} m and {turn} rad from the guess")
            }
        }
    }
}

impl core::error::Error for Refusal {}

/// What happened so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Scans given.
    pub scans: u32,
    /// Scans whose pose is only the guess (the first does not count).
    pub refused: u32,
    /// Keyframes made.
    pub keyframes: u32,
    /// Keyframes given up because too many scans in a row were refused: the pose may have jumped.
    pub lost: u32,
}

/// Pose from scans, in fixed memory.
///
/// 20·N + 300 bytes: a keyframe's lines and the current scan's points. N is the most beams of a turn.
#[derive(Debug, Clone)]
pub struct Odometry<const N: usize> {
    config: OdometryConfig,
    points: Points<N>,
    keyframe: Reference<N>,
    /// Robot at the keyframe.
    keyframe_pose: Pose,
    keyframe_covariance: Covariance,
    pose: Pose,
    covariance: Covariance,
    motion: Motion,
    /// The robot where the scan's points were bent back to.
    seen_from: Pose,
    wheels: Option<Pose>,
    end_us: u32,
    refused_in_a_row: u8,
    counters: Counters,
}

impl<const N: usize> Odometry<N> {
    /// At the origin, with nothing seen yet.
    #[must_use]
    pub const fn new(config: OdometryConfig) -> Self {
        const EXACT: Covariance = Covariance(Sym3::diagonal(0.0, 0.0, 0.0));
        Self {
            config,
            points: Points::new(),
            keyframe: Reference::new(),
            keyframe_pose: Pose::IDENTITY,
            keyframe_covariance: EXACT,
            pose: Pose::IDENTITY,
            covariance: EXACT,
            motion: Motion::STANDING,
            seen_from: Pose::IDENTITY,
            wheels: None,
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

    /// The robot at the end of the last scan, in the frame in which it started.
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// The robot's velocity during the last scan.
    #[must_use]
    pub const fn twist(&self) -> Twist {
        self.motion.twist
    }

    /// What happened so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// The last scan's points, in the lidar's frame.
    #[must_use]
    pub const fn points(&self) -> &Points<N> {
        &self.points
    }

    /// Takes a scan in and says where the robot is.
    ///
    /// `wheels` is the robot's pose by its wheels at the scan's end, in any fixed frame. `None`: the last velocity is
    /// believed to go on; where that leads to no good match, the robot may also stand, or turn more or less.
    /// A scan without a usable match leaves the guess as the pose, is counted, and says why.
    ///
    /// Costs a match or two, three with wheels that slip, and up to seven without wheels.
    pub fn update(&mut self, scan: &Scan<N>, wheels: Option<Pose>) -> Step {
        let times = self.times(scan);
        let rolled = self.rolled(wheels);
        let rolling = rolled.map(|motion| Twist::from_motion(motion, times.seconds));
        let before = self.motion.twist;
        let mut expected = rolling.unwrap_or(before);
        let motion = match rolled {
            // Without a clock there is no velocity, but the wheels still tell how far.
            Some(motion) if times.seconds == 0.0 => motion,
            _ => expected.displacement(times.seconds),
        };
        let predicted = (self.pose * motion, self.grown(motion));
        self.see(scan, expected);
        let mut outcome = self.matched(predicted.0);
        if score(&outcome) < UNSURE
            && let Some(guess) = self.other_guess(predicted.0, rolling, times)
        {
            let other = self.matched(guess);
            if score(&other) > score(&outcome) {
                outcome = other;
            }
        }
        if score(&outcome) < UNSURE
            && rolling.is_none()
            && times.duration > 0.0
            && self.refused_in_a_row == 0
        {
            expected = self.seen_otherwise(scan, times, &mut outcome);
        }
        self.seen_from = predicted.0;
        (self.pose, self.covariance) = match &mut outcome {
            Ok(found) => self.unbent(scan, found, expected, rolling, times),
            Err(_) => {
                self.motion.advance(predicted.0, expected, rolling, times);
                predicted
            }
        };
        let bend = math::abs(self.motion.twist.omega - before.omega) * times.duration;
        let keyframe = self.wants_keyframe(&outcome, bend);
        if keyframe {
            if outcome
                .as_ref()
                .is_ok_and(|found| found.degenerate_direction.is_none())
            {
                let motion = self.keyframe_pose.between(self.seen_from);
                let pose = self.config.mount.lidar_motion(motion);
                icp::smooth_towards(&self.keyframe, self.points.as_mut_slice(), pose);
            }
            self.keyframe.assign(self.points.as_slice());
            self.keyframe_pose = self.seen_from;
            self.keyframe_covariance = self.covariance;
            self.counters.keyframes = self.counters.keyframes.wrapping_add(1);
        }
        self.counters.scans = self.counters.scans.wrapping_add(1);
        self.wheels = wheels.filter(|pose| pose.is_finite());
        self.end_us = scan.end_us();
        Step {
            pose: self.pose,
            covariance: self.covariance,
            outcome,
            keyframe,
        }
    }

    /// Where the robot may be if not where it is predicted.
    fn other_guess(&self, predicted: Pose, rolling: Option<Twist>, times: Times) -> Option<Pose> {
        if rolling.is_none() {
            // It has stopped, or its velocity was wrong.
            return Some(self.pose);
        }
        // Wheels that slip tell a wrong motion; but a clock whose moments jump tells a wild velocity.
        let on = self.pose * self.motion.twist.displacement(times.seconds);
        let wild = farther(predicted, on, self.config.max_correction).is_some();
        (!wild).then_some(on)
    }

    /// Matches a scan as if the robot had turned otherwise than in the last one, until one match is sure; gives the best
    /// one's motion, which has bent the points back.
    ///
    /// Without wheels nothing foretells a hard turn, and a scan that it bent fits nowhere.
    fn seen_otherwise(
        &mut self,
        scan: &Scan<N>,
        times: Times,
        outcome: &mut Result<Match, Refusal>,
    ) -> Twist {
        /// How much a turn quickens or slows (rad/s²); a nimble robot's by twice that.
        const QUICKENS: f32 = 4.0;
        let expected = self.motion.twist;
        let quicker = |by: f32| Twist {
            omega: expected.omega + by * QUICKENS * times.duration,
            ..expected
        };
        let (mut best, mut seen) = (expected, expected);
        for twist in [quicker(1.0), quicker(-1.0), quicker(2.0), quicker(-2.0)] {
            self.see(scan, twist);
            seen = twist;
            let other = self.matched(self.pose * twist.displacement(times.seconds));
            if score(&other) > score(outcome) {
                *outcome = other;
                best = twist;
            }
            if score(outcome) > UNSURE {
                break;
            }
        }
        if seen != best {
            self.see(scan, best);
        }
        best
    }

    /// Robot at the scan's end by a match of the scan as `expected` bent it back; where the robot moved otherwise, the
    /// scan is bent back by that and matched once more.
    fn unbent(
        &mut self,
        scan: &Scan<N>,
        found: &mut Match,
        expected: Twist,
        rolling: Option<Twist>,
        times: Times,
    ) -> (Pose, Covariance) {
        let back = -0.5 * times.duration;
        let (end, mut covariance) = self.placed(found);
        self.seen_from = end;
        let mut middle = end * expected.displacement(back);
        let sudden = self.refused_in_a_row > 0 || expected != self.motion.twist;
        let during = if rolling.is_none() && sudden {
            // From the last scan's middle no velocity can be measured: that one's place was only a guess, or the velocity
            // has changed since, as the scan itself tells better.
            expected
        } else {
            self.motion.during(middle, rolling, times)
        };
        if differs(
            expected.displacement(times.duration),
            during.displacement(times.duration),
        ) {
            self.see(scan, during);
            self.seen_from = middle * during.displacement(-back);
            if let Ok(again) = self.matched(self.seen_from) {
                *found = again;
                (self.seen_from, covariance) = self.placed(found);
                middle = self.seen_from * during.displacement(back);
            }
        }
        let pose = middle * during.displacement(-back);
        self.motion.advance(pose, during, rolling, times);
        (pose, covariance)
    }

    /// Takes the scan's points, as if the robot had moved with `during` while it was taken.
    fn see(&mut self, scan: &Scan<N>, during: Twist) {
        let config = PointsConfig {
            min_range: self.config.min_range,
            max_range: self.config.max_range,
            upside_down: self.config.mount.upside_down,
            max_points: self.config.enough,
        };
        let twist = self.config.mount.lidar_twist(during);
        self.points.assign(scan, twist, &config);
    }

    /// Times of a scan; all 0 for the first one and for clocks that stand still or jump.
    fn times(&self, scan: &Scan<N>) -> Times {
        let micros = scan.end_us().wrapping_sub(self.end_us);
        if self.counters.scans == 0 || micros > 2_000_000 {
            return Times::default();
        }
        Times {
            seconds: micros as f32 * 1e-6,
            duration: if micros > 0 { scan.duration() } else { 0.0 },
        }
    }

    /// Motion of the robot since the last scan by its wheels.
    fn rolled(&self, wheels: Option<Pose>) -> Option<Pose> {
        // No robot drives farther between two scans: a damaged message.
        const FARTHEST: f32 = 32.0;
        let motion = |(before, now): (Pose, Pose)| before.between(now);
        self.wheels
            .zip(wheels)
            .map(motion)
            .filter(|motion| motion.is_finite() && motion.distance() < FARTHEST)
    }

    /// Covariance of the pose after a predicted motion.
    fn grown(&self, motion: Pose) -> Covariance {
        const LEAST: f32 = 0.002;
        let along = self.config.prior_error * motion.distance() + LEAST;
        let turn = self.config.prior_error * math::abs(motion.theta) + LEAST;
        let moved = self.pose * motion;
        self.covariance
            .transported(moved.x - self.pose.x, moved.y - self.pose.y)
            .plus(&Covariance(Sym3::diagonal(
                along * along,
                along * along,
                turn * turn,
            )))
    }

    /// Matches the points against the keyframe, starting from the predicted pose.
    fn matched(&self, predicted: Pose) -> Result<Match, Refusal> {
        if self.keyframe.is_empty() {
            return Err(Refusal::First);
        }
        let guess = self
            .config
            .mount
            .lidar_motion(self.keyframe_pose.between(predicted));
        let found = icp::align(
            &self.keyframe,
            self.points.as_slice(),
            guess,
            &self.config.icp,
        )
        .map_err(Refusal::NoMatch)?;
        let most = self.config.max_correction * found.score;
        match farther(guess, found.pose, most) {
            Some((distance, turn)) => Err(Refusal::TooFar { distance, turn }),
            None => Ok(found),
        }
    }

    /// Pose and covariance of the robot by a match.
    fn placed(&self, found: &Match) -> (Pose, Covariance) {
        let motion = self.config.mount.robot_motion(found.pose);
        let pose = self.keyframe_pose * motion;
        // The match is about the lidar: its error of heading moves the robot's centre about it.
        let start_from_lidar = pose * self.config.mount.robot_from_lidar;
        let lidar_frame = self.keyframe_pose * self.config.mount.robot_from_lidar;
        let of_match = found
            .covariance
            .rotated(lidar_frame)
            .transported(pose.x - start_from_lidar.x, pose.y - start_from_lidar.y);
        let covariance = self
            .keyframe_covariance
            .transported(pose.x - self.keyframe_pose.x, pose.y - self.keyframe_pose.y)
            .plus(&of_match);
        (pose, covariance)
    }

    /// Whether the scan just placed is to be matched against from now on; `bend`: by how much more or less it turned
    /// than the scan before (rad).
    fn wants_keyframe(&mut self, outcome: &Result<Match, Refusal>, bend: f32) -> bool {
        /// A turn that changes by this much from scan to scan (rad) bends a scan more than it is noisy.
        const BENT: f32 = 0.02;
        let enough = self.points.as_slice().len() >= 2 * usize::from(self.config.icp.min_inliers);
        match outcome {
            Err(Refusal::First) => enough,
            Err(_) => {
                self.counters.refused = self.counters.refused.wrapping_add(1);
                self.refused_in_a_row = self.refused_in_a_row.saturating_add(1);
                let given_up = self.refused_in_a_row >= self.config.max_refused && enough;
                if given_up {
                    self.refused_in_a_row = 0;
                    self.counters.lost = self.counters.lost.wrapping_add(1);
                }
                given_up
            }
            Ok(found) => {
                let moved = self.keyframe_pose.between(self.pose);
                let met = f32::from(found.overlap) / f32::from(found.beams.max(1));
                let near = if bend > BENT { 0.5 } else { 1.0 };
                // The first match after refused ones may be wrong, which the next ones tell as long as the keyframe is there.
                let refused = core::mem::take(&mut self.refused_in_a_row);
                refused == 0
                    && enough
                    && (near * moved.distance() > self.config.keyframe_distance
                        || near * math::abs(moved.theta) > self.config.keyframe_turn
                        || met < self.config.keyframe_overlap)
            }
        }
    }
}

/// A match that explains less than this share of the beams is tried again from another guess.
const UNSURE: f32 = 0.6;

/// How far a match may be trusted: 0 for none.
fn score(outcome: &Result<Match, Refusal>) -> f32 {
    outcome.as_ref().map_or(0.0, |found| found.score)
}

/// How far apart two poses are (m, rad), if by more than `most` metres or twice as many radians.
fn farther(a: Pose, b: Pose, most: f32) -> Option<(f32, f32)> {
    let off = a.between(b);
    let (distance, turn) = (off.distance(), math::abs(off.theta));
    (distance > most || turn > 2.0 * most).then_some((distance, turn))
}

/// Whether two motions bend a scan differently: by more than 1 cm or 0.3°.
fn differs(a: Pose, b: Pose) -> bool {
    let off = a.between(b);
    off.distance() > 0.01 || math::abs(off.theta) > 0.005
}
