//! When the loop of stages ends, and what it needs.

use crate::config::{self, ConfigError};

/// When the loop ends, and what it needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Most passes. Default 30.
    pub max_iterations: u8,
    /// Longest last step (m). Default 1e-4: a hundredth of the noise of a range.
    pub translation_tolerance: f32,
    /// Largest rotation of the last step (rad). Default 1e-4.
    pub rotation_tolerance: f32,
    /// Fewest pairs that must count. Default 30.
    pub min_pairs: u16,
    /// Neighbours on each side that a surface's line is laid through. Default 4: 9 points at 1° see 0.3 m of a wall 2 m
    /// away.
    pub neighbours: u8,
    /// Standard deviation of a range (m): the least noise that the covariance assumes. Default 0.01.
    pub min_range_sigma: f32,
}

impl Limits {
    /// For scans of a few hundred beams.
    pub const DEFAULT: Self = Self {
        max_iterations: 30,
        translation_tolerance: 1e-4,
        rotation_tolerance: 1e-4,
        min_pairs: 30,
        neighbours: 4,
        min_range_sigma: 0.01,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("max_iterations", self.max_iterations as f32, 1.0, 255.0),
            config::within(
                "translation_tolerance",
                self.translation_tolerance,
                0.0,
                1.0,
            ),
            config::within("rotation_tolerance", self.rotation_tolerance, 0.0, 1.0),
            config::within("min_pairs", self.min_pairs as f32, 3.0, 65535.0),
            config::within("neighbours", self.neighbours as f32, 1.0, 64.0),
            config::within("min_range_sigma", self.min_range_sigma, 1e-4, 1.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
