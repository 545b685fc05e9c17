//! Iterative closest point with projection and point-to-line distances, in integers, for scans of one lidar.
//!
//! *Projection* looks up, in the direction of a point, the surface that the reference saw there: no search, since both scans
//! come from one place, nearly. *Point to line* only counts the distance across that surface: a point may slide along its
//! wall, so that the beams need not hit the same spots. A reference is a line for each direction, laid through neighbouring
//! beams.
//!
//! Six stages, as Rusinkiewicz and Levoy (3DIM 2001) name them. [`modular`](super::modular) has other choices for each, and
//! [`modular::Stages::projective`](super::modular::Stages::projective) are these ones:
//!
//! | stage | here | where |
//! | --- | --- | --- |
//! | selection | every k-th point while coarse, all at the end | `accumulate::Pass` |
//! | matching | projection: the line that the reference saw in the point's direction | `accumulate::Projection` |
//! | weighting | noise of the range seen across the surface; Geman–McClure | `normals`, `accumulate` |
//! | rejection | a gate that narrows | `accumulate` |
//! | error metric | point to line | `accumulate` |
//! | minimisation | Gauss–Newton, `f32` | [`Sym3::solve`](crate::linalg::Sym3::solve) |
//!
//! What a pose is worth is judged apart from how it was found (`score`), so that several starts can compete.

mod accumulate;
mod fixed_pose;
mod line;
mod line_fit;
mod multistart;
mod normal_equations;
mod normals;
mod range_noise;
pub mod reference;
mod score;
mod smoothing;
#[cfg(test)]
mod tests;
mod verdict;

pub use line::Line;
pub use reference::Reference;

use crate::{
    config::{self, ConfigError},
    geometry::Pose,
    matching::{Match, MatchError},
    math,
    scan::ScanPoint,
};
use accumulate::{Gate, Pass};
use fixed_pose::FixedPose;
use multistart::{Candidate, Refined};
use normal_equations::Sums;

/// How far the guess may be off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Search {
    /// By a few centimetres and degrees: odometry. The guess alone is tried first, and others only if it fails. What is
    /// found far from the guess (0.75 m, a turn counted at 3 m) must explain more of the scan, and is refused as
    /// ambiguous where another pose explains nearly as much.
    #[default]
    Local,
    /// By 40 cm and 45°, or not there at all: always a bounded number of starts around it.
    Global,
}

/// Settings of [`align`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IcpConfig {
    /// How far the guess may be off. Default [`Search::Local`].
    pub search: Search,
    /// Beams in a coarse pass; all are used in the last two. Default 45: the accuracy that fewer cost is won back by
    /// the last passes.
    pub coarse_beams: u16,
    /// Fewest beams that must agree with the reference. Default 30.
    pub min_inliers: u16,
    /// Worst score that is accepted, from 0 (nothing agrees) to 1. Default 0.25: on recorded pairs no right
    /// pose had less than 0.3.
    pub min_score: f32,
    /// Standard deviation of a range (m): the least noise that the covariance assumes. Default 0.005.
    pub min_range_sigma: f32,
    /// A direction counts as degenerate if fewer than this share of the beams constrain it. Default 0.02: what the noise of
    /// the normals alone amounts to in a corridor.
    pub min_constraint_share: f32,
}

impl IcpConfig {
    /// For odometry with a cheap lidar.
    pub const DEFAULT: Self = Self {
        search: Search::Local,
        coarse_beams: 45,
        min_inliers: 30,
        min_score: 0.25,
        min_range_sigma: 0.005,
        min_constraint_share: 0.02,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// A setting out of its range does not compile:
    ///
    /// ```compile_fail
    /// # use beamfix::matching::icp::IcpConfig;
    /// const ICP: IcpConfig = match (IcpConfig { min_score: 25.0, ..IcpConfig::DEFAULT }).checked() {
    ///     Ok(config) => config,
    ///     Err(_) => panic!("min_score is a share, not per cent"),
    /// };
    /// # fn main() { let _ = ICP; }
    /// ```
    ///
    /// With `min_score: 0.3` it does:
    ///
    /// ```
    /// # use beamfix::matching::icp::IcpConfig;
    /// const ICP: IcpConfig = match (IcpConfig { min_score: 0.3, ..IcpConfig::DEFAULT }).checked() {
    ///     Ok(config) => config,
    ///     Err(_) => panic!("min_score is a share, not per cent"),
    /// };
    /// # let _ = ICP;
    /// ```
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("coarse_beams", self.coarse_beams as f32, 10.0, 65535.0),
            config::within("min_inliers", self.min_inliers as f32, 3.0, 65535.0),
            config::within("min_score", self.min_score, 0.0, 1.0),
            config::within("min_range_sigma", self.min_range_sigma, 1e-4, 1.0),
            config::within("min_constraint_share", self.min_constraint_share, 0.0, 0.5),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Width of the first coarse pass's gate (mm), and most coarse passes.
const COARSE_FIRST: u32 = 2048;
const COARSE_MOST: u8 = 16;
/// Width of the gate (mm) from which on a start that is near a known place does not leave it.
const KNOWN_WIDTH: u32 = 512;
/// A step that is this short compared with the gate narrows it to a quarter, or to half.
const SHORT: f32 = 1.0 / 16.0;
const MEDIUM: f32 = 1.0 / 4.0;
/// Width of the last gate in fifths of a standard deviation of a range: half weight at 2 of them.
const FINE_FIFTHS: u32 = 64;
/// Most fine passes, each over half of the points. Those of recorded scans need 3 to 9.
const FINE_MOST: u8 = 24;
/// A match has converged when its last two steps, whose passes took all points between them, are each shorter than this share
/// of the standard deviation that its covariance tells: what is left of the way then is shorter, and adds nothing to the error.
/// After the last pass twice as much is let pass: points that change between two lines lead to and fro for ever.
const CONVERGED: f32 = 0.3;
/// Points that decide what a converged pose is worth, about.
const JUDGED: u16 = 120;

/// Pose of the lidar that saw `points` in the frame of the one that saw `reference`.
///
/// `guess` is where the search starts and what the result keeps along a direction that the scene does not determine. The
/// score is the share of the overlapping points that agree with the reference, less half of those that it saw through. About
/// 0.3 million instructions for 180 points and lines, more where the guess is bad.
///
/// ```
/// use beamfix::{
///     geometry::Pose,
///     matching::icp::{self, IcpConfig, Reference},
///     scan::{Bearing, ScanPoint},
/// };
/// // A room of 4 m by 6 m, seen from its middle and from 10 cm further on.
/// let room = |ahead: f32| -> [ScanPoint; 180] {
///     core::array::from_fn(|k| {
///         let bearing = Bearing((k * 65_536 / 180) as u16);
///         let (s, c) = beamfix::math::sin_cos(bearing.radians());
///         let x = if c > 0.0 { (2.0 - ahead) / c } else { (-2.0 - ahead) / c };
///         let y = 3.0 / s.abs();
///         ScanPoint::at(bearing, (1000.0 * x.min(y)) as u16)
///     })
/// };
/// let mut reference = Reference::<180>::new();
/// reference.assign(&room(0.0));
/// let found = icp::align(&reference, &room(0.1), Pose::IDENTITY, &IcpConfig::DEFAULT)?;
/// assert!((found.pose.x - 0.1).abs() < 0.005 && found.degenerate_direction.is_none());
/// # Ok::<(), beamfix::matching::MatchError>(())
/// ```
///
/// # Errors
/// Refuses rather than gives a wrong pose: see [`MatchError`].
pub fn align<const N: usize>(
    reference: &Reference<N>,
    points: &[ScanPoint],
    guess: Pose,
    config: &IcpConfig,
) -> Result<Match, MatchError> {
    align_observed(reference, points, guess, config, |_| ())
}

/// As [`align`], showing the estimate after every pass: for pictures and for learning what a match does.
///
/// # Errors
/// As [`align`].
pub fn align_observed<const N: usize>(
    reference: &Reference<N>,
    points: &[ScanPoint],
    guess: Pose,
    config: &IcpConfig,
    mut observe: impl FnMut(Pose),
) -> Result<Match, MatchError> {
    let needed = config.min_inliers;
    if points.len() < usize::from(needed) {
        let found = points.len() as u16;
        return Err(MatchError::TooFewBeams { found, needed });
    }
    if reference.len() < needed {
        let found = reference.len();
        return Err(MatchError::TooFewLines { found, needed });
    }
    let start = FixedPose::new(guess).ok_or(MatchError::BadGuess)?;
    let task = Task {
        lines: reference.lines(),
        points,
        start,
        lever_shift: accumulate::lever_shift(points, start),
        sigma: u32::from(reference.sigma()),
        config,
    };
    let best = multistart::search(&task, &mut observe)?;
    verdict::verdict(&task, &best, guess)
}

/// Moves `points`, seen at `pose` in the reference's frame, towards the surfaces that the reference saw there, if they are
/// less than about three standard deviations of a range off: laid as the next reference, they know what this one knew.
///
/// For poses of matches without a degenerate direction: along one, surfaces would be passed on to the wrong place. Costs a pass
/// over the points; at a pose that is not finite or more than 27 m away they stay as they are.
pub fn smooth_towards<const N: usize>(
    reference: &Reference<N>,
    points: &mut [ScanPoint],
    pose: Pose,
) {
    if let Some(at) = FixedPose::new(pose) {
        let sigma = u32::from(reference.sigma());
        smoothing::smooth_towards(reference.lines(), points, at, sigma);
    }
}

/// A pose on the way, and the passes that led there.
#[derive(Clone, Copy)]
struct Reached {
    at: FixedPose,
    passes: u8,
}

/// A pass and the Gauss–Newton step it led to.
struct Stepped {
    /// The step: see [`FixedPose::moved`].
    by: [f32; 3],
    /// What the pass knows.
    mine: Sums,
    /// The same with what is known of other points.
    sums: Sums,
    /// Length of the step in standard deviations of the pose.
    sigmas: f32,
}

/// How much of a Gauss–Newton step is made: weights and lines that change with the pose make it too short or too long.
struct Pace {
    share: f32,
    last: [f32; 3],
}

impl Pace {
    const fn new() -> Self {
        Self {
            share: 1.0,
            last: [0.0; 3],
        }
    }

    /// More of a step that leads on as the last one did, less of one that leads back.
    fn adapted(&mut self, [x, y, turn]: [f32; 3]) -> [f32; 3] {
        // 3 m in 1/16 mm.
        const LEVER: f32 = 48_000.0;
        let [lx, ly, lt] = self.last;
        let along = x * lx + y * ly + LEVER * LEVER * turn * lt;
        self.last = [x, y, turn];
        if along > 0.0 {
            self.share = math::min(1.4 * self.share, 2.0);
        } else if along < 0.0 {
            self.share = math::max(0.5 * self.share, 0.25);
        }
        [x, y, turn].map(|v| self.share * v)
    }
}

/// What stays the same over one match.
struct Task<'a> {
    lines: &'a [Line],
    points: &'a [ScanPoint],
    start: FixedPose,
    lever_shift: u32,
    /// Standard deviation of a range (mm).
    sigma: u32,
    config: &'a IcpConfig,
}

impl Task<'_> {
    /// Width of the last gate (mm).
    fn fine_width(&self) -> u32 {
        self.sigma * FINE_FIFTHS / 5
    }

    /// A pass over every other eight points by the last gate.
    fn half(&self, which: u8) -> Pass {
        Pass {
            period: 16,
            first: 8 * u16::from(which),
            length: 8,
            gate: Gate::new(self.fine_width()),
        }
    }

    /// A pass over all points by the last gate.
    fn all(&self) -> Pass {
        Pass {
            period: u16::MAX,
            first: 0,
            length: u16::MAX,
            gate: Gate::new(self.fine_width()),
        }
    }

    /// A pass and the Gauss–Newton step by it and by what is known of other points.
    fn step(
        &self,
        at: FixedPose,
        pass: Pass,
        others: Option<&Sums>,
    ) -> Result<Stepped, MatchError> {
        let mine = accumulate::run(self.lines, self.points, at, self.lever_shift, pass);
        // Half of the share of the points that the pass looked at.
        let share = u32::from(self.config.min_inliers) * u32::from(pass.length);
        let needed = (share / u32::from(pass.period.max(1)) / 2) as u16;
        if mine.inliers < needed {
            let found = mine.inliers;
            return Err(MatchError::TooFewCorrespondences { found, needed });
        }
        let sums = others.map_or(mine, |others| mine.plus(others));
        let step = sums.step(self.lever_shift).ok_or(MatchError::Degenerate)?;
        let noise = math::max(sums.residual(), self.config.min_range_sigma) * 1e3;
        let variance = sums.inflation() * noise * noise;
        Ok(Stepped {
            by: step.by,
            mine,
            sums,
            sigmas: math::sqrt(math::max(step.gain, 0.0) / variance),
        })
    }

    /// From a start to near a candidate: coarse passes whose gate narrows as their steps get shorter. `None` where they lead to
    /// a place that is known.
    fn coarse(
        &self,
        start: FixedPose,
        is_known: impl Fn(FixedPose) -> bool,
        observe: &mut impl FnMut(Pose),
    ) -> Result<Option<Reached>, MatchError> {
        let period = self.stride(self.config.coarse_beams);
        let least = self.fine_width();
        let mut at = start;
        let mut width = COARSE_FIRST.max(least);
        let mut passes = 0;
        while passes < COARSE_MOST {
            let pass = Pass {
                period,
                // Another set of points each time.
                first: u16::from(passes) % period,
                length: 1,
                gate: Gate::new(width),
            };
            let stepped = self.step(at, pass, None)?;
            at = at.moved(stepped.by, self.start);
            observe(at.pose());
            passes += 1;
            let metres = width as f32 * 1e-3;
            let length = fixed_pose::length(stepped.by);
            let narrower = if length < metres * SHORT {
                width / 4
            } else if length < metres * MEDIUM {
                width / 2
            } else {
                continue;
            };
            if width == least {
                break;
            }
            width = narrower.max(least);
            if width <= KNOWN_WIDTH && is_known(at) {
                return Ok(None);
            }
        }
        Ok(Some(Reached { at, passes }))
    }

    /// From a candidate to the pose: passes over one half of the points and then the other, each with what the last one knew of
    /// its half, until steps are a fraction of what the pose is uncertain by.
    fn fine(&self, from: Reached, observe: &mut impl FnMut(Pose)) -> Result<Refined, MatchError> {
        let Reached { mut at, mut passes } = from;
        let mut pace = Pace::new();
        let mut others = None;
        let mut before = f32::INFINITY;
        let mut step = 0.0;
        for pass in 0..FINE_MOST {
            let half = self.half(pass % 2);
            let last = self.step(at, half, others.as_ref())?;
            let by = pace.adapted(last.by);
            at = at.moved(by, self.start);
            observe(at.pose());
            passes = passes.saturating_add(1);
            let enough = if pass + 1 < FINE_MOST {
                CONVERGED
            } else {
                2.0 * CONVERGED
            };
            if math::max(last.sigmas, before) < enough {
                let candidate = self.judged(Reached { at, passes }, JUDGED);
                return Ok(Refined { candidate, last });
            }
            step = fixed_pose::length(last.by);
            before = if others.is_some() {
                last.sigmas
            } else {
                f32::INFINITY
            };
            others = Some(last.mine.after(by, self.lever_shift));
        }
        Err(MatchError::NotConverged { step })
    }

    /// Every how many-th point makes at most `beams`.
    fn stride(&self, beams: u16) -> u16 {
        (self.points.len() as u16).div_ceil(beams.max(1)).max(1)
    }

    /// What a pose is worth by at most `beams` points.
    fn judged(&self, Reached { at, passes }: Reached, beams: u16) -> Candidate {
        let stride = self.stride(beams);
        let score = score::judge(self.lines, self.points, at, stride, self.sigma);
        Candidate {
            at,
            passes,
            overlap: score.overlap.saturating_mul(stride),
            value: score.value(20 / stride),
        }
    }
}
