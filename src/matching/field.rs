//! Scan to likelihood field by Newton's method on the log-likelihood.
//!
//! Near a surface the logarithm of the likelihood is a parabola across it, so each beam's cell and its neighbours
//! give the exact slope and curvature wherever in the cell the beam ends. (Bilinear interpolation would give the
//! slope at the middle between two cells, and pull straight walls to the middles of cells.)

mod pass;
mod system;

use super::{Match, MatchError};
use crate::{
    config::{self, ConfigError},
    geometry::Pose,
    math,
    scan::ScanPoint,
    sensor_model::likelihood_field::Field,
};
use system::Sums;

/// When to stop, and what to believe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldConfig {
    /// Most passes over the beams. Default 20.
    pub max_iterations: u8,
    /// The longest step that may be the last (m). Default 0.004: it leaves a small part of itself to go.
    pub translation_tolerance: f32,
    /// Largest rotation of the last step (rad). Default 0.002.
    pub rotation_tolerance: f32,
    /// While far off, every so-many-th beam is enough. Default 4.
    pub coarse_stride: u8,
    /// In the end only beams so near to a surface count (m). Default 0.05: five times a range's noise. What
    /// one scan sees and the other does not would pull.
    pub max_inlier_distance: f32,
    /// Fewest beams that must end near a surface. Default 20.
    pub min_inliers: u16,
    /// Least share of all beams that must end near a surface. Default 0.3.
    pub min_inlier_share: f32,
    /// Least noise to assume (m): what the field's cells leave. Default 0.01.
    pub min_range_sigma: f32,
    /// A direction is degenerate whose curvature is below this share of the strongest one's. Default 0.05: range noise
    /// alone makes up to 0.03 along the bare walls of a corridor.
    pub min_curvature_share: f32,
}

impl FieldConfig {
    /// For cells of 5 cm and lidars with 1 cm of noise.
    pub const DEFAULT: Self = Self {
        max_iterations: 20,
        translation_tolerance: 0.004,
        rotation_tolerance: 0.002,
        coarse_stride: 4,
        max_inlier_distance: 0.05,
        min_inliers: 20,
        min_inlier_share: 0.3,
        min_range_sigma: 0.01,
        min_curvature_share: 0.05,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("max_iterations", self.max_iterations as f32, 2.0, 255.0),
            config::within(
                "translation_tolerance",
                self.translation_tolerance,
                1e-5,
                1.0,
            ),
            config::within("rotation_tolerance", self.rotation_tolerance, 1e-5, 1.0),
            config::within("coarse_stride", self.coarse_stride as f32, 1.0, 64.0),
            config::within("max_inlier_distance", self.max_inlier_distance, 0.001, 10.0),
            config::within("min_inliers", self.min_inliers as f32, 3.0, 65535.0),
            config::within("min_inlier_share", self.min_inlier_share, 0.0, 1.0),
            config::within("min_range_sigma", self.min_range_sigma, 1e-4, 1.0),
            config::within("min_curvature_share", self.min_curvature_share, 0.0, 0.5),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for FieldConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

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
