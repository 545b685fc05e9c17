//! Iterative closest point with projection and point-to-line distances, for scans of one lidar.
//!
//! Six stages, as Rusinkiewicz and Levoy (3DIM 2001) name them, each in its room:
//!
//! | stage | here | where |
//! | --- | --- | --- |
//! | selection | every k-th point while coarse, all at the end | [`Pass`](pass::Pass) |
//! | matching | projection: the line that the reference saw in the point's direction | [`pass::Projection`] |
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
    /// Worst score that is accepted, from 0 (nothing agrees) to 1. Default 0.0.
    pub min_score: f32,
    /// Standard deviation of a range (m): the least noise that the covariance assumes. Default 0.01.
    pub range_sigma: f32,
}

impl IcpConfig {
    /// For odometry with a cheap lidar.
    pub const DEFAULT: Self = Self {
        search: Search::Local,
        coarse_beams: 90,
        min_inliers: 30,
        min_score: 0.0,
        range_sigma: 0.01,
    };
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Gates of the coarse passes (see [`Pass::gate`]): a metre, then halving.
const COARSE: [u8; 8] = [8, 8, 8, 8, 7, 7, 6, 6];
/// Gates of the passes over all points.
const FINE: [u8; 2] = [5, 5];

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

    /// Runs passes with `gates`, each followed by a Gauss–Newton step; gives the last pass' sums and step.
    fn descend(
        &self,
        at: FixedPose,
        stride: u8,
        gates: &[u8],
        observe: &mut impl FnMut(Pose),
    ) -> Result<(FixedPose, Sums, [f32; 3]), MatchError> {
        let mut state = (at, Sums::default(), [0.0; 3]);
        let needed = self.config.min_inliers / u16::from(stride) / 2;
        for (k, &gate) in gates.iter().enumerate() {
            // Another set of points each time.
            let first = k % usize::from(stride.max(1));
            let sums = pass::run(
                self.lines,
                self.points,
                state.0,
                Pass { stride, gate },
                first,
            );
            if sums.inliers < needed {
                let found = sums.inliers;
                return Err(MatchError::TooFewCorrespondences { found, needed });
            }
            let (h, b) = sums.equations();
            let step = h.solve(b).ok_or(MatchError::Degenerate)?;
            state = (state.0.moved(step), sums, step);
            observe(state.0.pose());
        }
        Ok(state)
    }

    /// From a start to a candidate: all the coarse passes, then the score by half of the points.
    fn coarse(
        &self,
        start: FixedPose,
        observe: &mut impl FnMut(Pose),
    ) -> Result<Candidate, MatchError> {
        let stride = self.coarse_stride();
        let (at, ..) = self.descend(start, stride, &COARSE, observe)?;
        Ok(self.judged(at))
    }

    fn judged(&self, at: FixedPose) -> Candidate {
        let stride = usize::from(self.coarse_stride()).div_ceil(2);
        let score = score::judge(self.lines, self.points, at, stride);
        Candidate {
            at,
            value: score.value((20 / stride) as u16),
        }
    }
}
