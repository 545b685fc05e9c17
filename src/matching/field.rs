//! Scan to likelihood field by Newton's method on the log-likelihood.
//!
//! Near a surface the logarithm of the likelihood is a parabola across it, so each beam's cell and its neighbours
//! give the exact slope and curvature wherever in the cell the beam ends. (Bilinear interpolation would give the
//! slope at the middle between two cells, and pull straight walls to the middles of cells.)

mod config;
mod pass;
mod system;

use super::{Match, MatchError};
use crate::{geometry::Pose, math, scan::ScanPoint, sensor_model::likelihood_field::Field};
pub use config::FieldConfig;
use system::Sums;

/// Pose from which `points` fit `field` best, near `guess`.
///
/// Converges from 2.5σ and a few degrees off: start from a search or a coarser field otherwise. The score is the mean height
/// of the beams' bytes above an unexplored cell's, as a share of the peak's.
/// A direction that the scene hardly determines keeps the guess and is named in [`Match::degenerate_direction`].
///
/// # Errors
/// [`MatchError::TooFewBeams`], [`MatchError::BadGuess`] for a guess off the field, [`MatchError::TooFewCorrespondences`]
/// where too few beams end near a surface, [`MatchError::Degenerate`], [`MatchError::NotConverged`].
pub fn align<F: Field + ?Sized>(
    field: &F,
    points: &[ScanPoint],
    guess: Pose,
    config: &FieldConfig,
) -> Result<Match, MatchError> {
    let found = points.len() as u16;
    if found < config.min_inliers {
        return Err(MatchError::TooFewBeams {
            found,
            needed: config.min_inliers,
        });
    }
    let mut pose = guess;
    let mut stride = config.coarse_stride.max(1);
    let mut iterations = 0;
    let gates = (
        gate(field, 2.5 * field.scale().sigma),
        gate(field, config.max_inlier_distance),
    );
    let per_metre = 1.0 / field.shape().resolution();
    // Neighbours are taken together until the steps are short. Then each beam speaks for itself,
    // with the curvature of the pass before: at the corners of walls neighbours do not agree.
    let mut curved: Option<Sums> = None;
    let mut fine_passes = 0;
    let sums = loop {
        let gate = if stride > 1 { gates.0 } else { gates.1 };
        let known = curved.as_ref();
        let sums = Sums::over(
            field,
            points,
            pose,
            usize::from(stride),
            gate,
            config.min_curvature_share,
            known,
        )
        .ok_or(MatchError::BadGuess)?;
        iterations += 1;
        let needed = sums.needed(config, points.len());
        if sums.inliers < needed {
            return Err(MatchError::TooFewCorrespondences {
                found: sums.inliers,
                needed,
            });
        }
        // The field is quantised, so Newton can oscillate between two poses; shorter steps end it.
        let passes = if stride > 1 { iterations } else { fine_passes };
        let pace = match passes {
            0..6 => 1.0,
            6..10 => 0.5,
            _ => 0.25,
        };
        let step = sums
            .step(config)
            .ok_or(MatchError::Degenerate)?
            .map(|along| pace * along);
        pose = Sums::moved(field.shape(), pose, step);
        let square = step[0] * step[0] + step[1] * step[1];
        let small = |factor: f32| {
            let cells = factor * config.translation_tolerance * per_metre;
            square <= cells * cells && math::abs(step[2]) <= factor * config.rotation_tolerance
        };
        if stride > 1 {
            // A quarter of the beams leave the pose twice as uncertain as all: no use in more digits.
            if small(0.5) || iterations >= config.max_iterations / 2 {
                stride = 1;
            }
            continue;
        }
        fine_passes += 1;
        if curved.is_some() && small(1.0) {
            break sums;
        } else if curved.is_none() && small(0.5) {
            curved = Some(sums);
        } else if iterations >= config.max_iterations {
            let step = math::sqrt(square) / per_metre;
            return Err(MatchError::NotConverged { step });
        }
    };
    sums.summary(field, points.len(), pose, iterations, config)
}

/// Byte from which on a beam counts, `distance` (m) from the nearest surface; above unexplored in any case.
fn gate<F: Field + ?Sized>(field: &F, distance: f32) -> u8 {
    let scale = field.scale();
    let z = distance / scale.sigma;
    let byte = 255 - math::round_to_i32(math::min(0.5 * z * z / scale.step, 255.0));
    (byte.max(0) as u8).max(scale.unexplored.saturating_add(10))
}
