//! Iterative closest point with projection and point-to-line distances, for scans of one lidar.
//!
//! Six stages, as Rusinkiewicz and Levoy (3DIM 2001) name them, each in its room:
//!
//! | stage | here | where |
//! | --- | --- | --- |
//! | selection | every k-th point while coarse, all at the end | `pass::Pass` |
//! | matching | projection: the line that the reference saw in the point's direction | `pass::Projection` |
//! | weighting | noise of the range seen across the surface; Geman–McClure | `lines`, `pass` |
//! | rejection | a gate that narrows | `pass` |
//! | error metric | point to line | `pass` |
//! | minimisation | Gauss–Newton, `f32` | [`Sym3::solve`](crate::linalg::Sym3::solve) |
//!
//! What a pose is worth is judged apart from how it was found (`score`), so that several starts can compete.

mod hypotheses;
mod lines;
mod pass;
mod quality;
pub mod reference;
mod score;

pub use reference::{Line, Reference};

use crate::{
    geometry::Pose,
    matching::{Match, MatchError},
    scan::ScanPoint,
};
use hypotheses::Candidate;
use pass::{FixedPose, Pass, Sums};

/// How far the guess may be off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Search {
    /// By a few centimetres and degrees: odometry. The guess alone is tried first, and others only if it fails.
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
    /// Beams in a coarse pass; all are used in the last two. Default 90: four times fewer cost half the accuracy, which
    /// the last passes win back.
    pub coarse_beams: u16,
    /// Fewest beams that must agree with the reference. Default 30.
    pub min_inliers: u16,
    /// Worst score that is accepted, from 0 (nothing agrees) to 1. Default 0.25: on recorded pairs no right
    /// pose had less than 0.3.
    pub min_score: f32,
    /// Standard deviation of a range (m): the least noise that the covariance assumes. Default 0.01.
    pub range_sigma: f32,
}

impl IcpConfig {
    /// For odometry with a cheap lidar.
    pub const DEFAULT: Self = Self {
        search: Search::Local,
        coarse_beams: 45,
        min_inliers: 30,
        min_score: 0.25,
        range_sigma: 0.01,
    };
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Gate of the first coarse pass (see [`Pass::gate`]) and the one that ends them, and most of them.
const COARSE_FIRST: u8 = 9;
const COARSE_LAST: u8 = 5;
const COARSE_MOST: usize = 16;
/// A step that is this short compared with the gate narrows it by two, or by one.
const SHORT: f32 = 1.0 / 16.0;
const MEDIUM: f32 = 1.0 / 4.0;
/// Gate and most of the passes over all points.
const FINE: u8 = 5;
const FINE_MOST: u8 = 8;
/// A step this short (m) ends the match.
const CONVERGED: f32 = 0.003;

/// Pose of the lidar that saw `points` in the frame of the one that saw `reference`.
///
/// `guess` is where the search starts and what the result keeps along a direction that the scene does not determine.
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
        config,
    };
    let best = hypotheses::search(&task, &mut observe)?;
    quality::verdict(&task, &best, guess)
}

/// A pass and the step it led to.
struct Stepped {
    at: FixedPose,
    sums: Sums,
    /// Length of the step (m): see [`step_length`].
    length: f32,
}

/// Length of a step (m), a turn counted at 3 m.
fn step_length(step: [f32; 3]) -> f32 {
    let [x, y, t] = step.map(crate::math::abs);
    x + y + 3.0 * t
}

/// What stays the same over one match.
struct Task<'a> {
    lines: &'a [Line],
    points: &'a [ScanPoint],
    start: FixedPose,
    config: &'a IcpConfig,
}

impl Task<'_> {
    /// Every how many-th point a coarse pass takes.
    fn coarse_stride(&self) -> u8 {
        let stride = self.points.len() / usize::from(self.config.coarse_beams.max(1));
        stride.clamp(1, 255) as u8
    }

    /// One pass and its Gauss–Newton step; `k` chooses another set of points each time.
    fn step(&self, at: FixedPose, pass: Pass, k: usize) -> Result<Stepped, MatchError> {
        let needed = self.config.min_inliers / u16::from(pass.stride.max(1)) / 2;
        let sums = pass::run(
            self.lines,
            self.points,
            at,
            pass,
            k % usize::from(pass.stride.max(1)),
        );
        if sums.inliers < needed {
            let found = sums.inliers;
            return Err(MatchError::TooFewCorrespondences { found, needed });
        }
        let (h, b) = sums.equations();
        let step = h.solve(b).ok_or(MatchError::Degenerate)?;
        Ok(Stepped {
            at: at.moved(step),
            sums,
            length: step_length(step),
        })
    }

    /// From a start to a candidate: coarse passes whose gate narrows as their steps get shorter, then the score.
    fn coarse(
        &self,
        start: FixedPose,
        observe: &mut impl FnMut(Pose),
    ) -> Result<Candidate, MatchError> {
        let stride = self.coarse_stride();
        let mut at = start;
        let mut gate = COARSE_FIRST;
        let mut passes = 0;
        for k in 0..COARSE_MOST {
            passes += 1;
            let stepped = self.step(at, Pass { stride, gate }, k)?;
            at = stepped.at;
            observe(at.pose());
            let width = f32::from(4u16 << gate) * 1e-3;
            if stepped.length < width * SHORT {
                gate -= 2;
            } else if stepped.length < width * MEDIUM {
                gate -= 1;
            }
            if gate <= COARSE_LAST {
                break;
            }
        }
        Ok(self.judged(at, passes))
    }

    /// Passes over all points until they move the pose no more; and how many.
    fn fine(
        &self,
        start: FixedPose,
        observe: &mut impl FnMut(Pose),
    ) -> Result<(Stepped, u8), MatchError> {
        let pass = Pass {
            stride: 1,
            gate: FINE,
        };
        let mut state = self.step(start, pass, 0)?;
        observe(state.at.pose());
        let mut passes = 1;
        while passes < 2 || (passes < FINE_MOST && state.length >= CONVERGED) {
            state = self.step(state.at, pass, 0)?;
            observe(state.at.pose());
            passes += 1;
        }
        Ok((state, passes))
    }

    fn judged(&self, at: FixedPose, passes: u8) -> Candidate {
        let stride = usize::from(self.coarse_stride()).div_ceil(2);
        let score = score::judge(self.lines, self.points, at, stride);
        Candidate {
            at,
            passes,
            value: score.value((20 / stride) as u16),
        }
    }
}
