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
//! | selection | every k-th point while coarse, one half and then the other at the end | `descent` |
//! | matching | projection: the line that the reference saw in the point's direction | `accumulate::Projection` |
//! | weighting | noise of the range seen across the surface, and by the range where it grows; Geman–McClure | `normals`, `accumulate` |
//! | rejection | a gate that narrows | `accumulate` |
//! | error metric | point to line | `accumulate` |
//! | minimisation | Gauss–Newton, `f32`, until steps are a fraction of the standard deviation | `normal_equations`, `descent` |
//!
//! What a pose is worth is judged apart from how it was found (`score`), so that several starts can compete.

mod accumulate;
mod companions;
mod config;
mod descent;
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
mod task;
mod verdict;

pub(crate) use companions::remove_companions;
pub use config::{IcpConfig, Search};
pub use line::Line;
pub use reference::Reference;
pub(crate) use task::{Guess, Rivals};

use crate::{
    geometry::Pose,
    matching::{Match, MatchError},
    scan::ScanPoint,
};
use fixed_pose::FixedPose;
use task::Task;

/// Pose of the lidar that saw `points` in the frame of the one that saw `reference`.
///
/// `guess` is where the search starts and what the result keeps along a direction that the scene does not determine. The
/// score is the mean agreement of the overlapping points with the reference (1 on its lines, half at four standard deviations of
/// a range), less a half for each that the reference saw through. At most 0.43 million instructions for 180 points and lines on
/// a PC (`host-tests/tests/matching/host_cost.rs`), more where the guess is bad.
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
    observe: impl FnMut(Pose),
) -> Result<Match, MatchError> {
    let guess = Guess {
        pose: guess,
        is_decided: false,
        rivals: Rivals::All,
    };
    search(reference, points, guess, config, observe)
}

/// As [`align`], from a guess of which more is known.
///
/// # Errors
/// As [`align`].
pub(crate) fn align_from<const N: usize>(
    reference: &Reference<N>,
    points: &[ScanPoint],
    guess: Guess,
    config: &IcpConfig,
) -> Result<Match, MatchError> {
    search(reference, points, guess, config, |_| ())
}

/// The pose of `points`.
fn search<const N: usize>(
    reference: &Reference<N>,
    points: &[ScanPoint],
    guess: Guess,
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
    let start = FixedPose::new(guess.pose).ok_or(MatchError::BadGuess)?;
    let task = Task {
        lines: reference.lines(),
        points,
        start,
        lever_shift: accumulate::lever_shift(points, start),
        noise: reference.noise(),
        mean_square: task::mean_square_weight(points, reference.noise()),
        is_decided: guess.is_decided,
        rivals: guess.rivals,
        config,
    };
    let best = multistart::search(&task, &mut observe)?;
    verdict::verdict(&task, &best, guess.pose)
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
        smoothing::smooth_towards(reference.lines(), points, at, reference.noise());
    }
}
