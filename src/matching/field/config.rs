//! Settings of the matcher of scans to a likelihood field.

use crate::config::{self, ConfigError};

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
