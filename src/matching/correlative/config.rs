//! Settings of the correlative matcher.

use crate::config::{self, ConfigError};

/// Where to look, and what counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrelativeConfig {
    /// Half the window's side (m), rounded up to whole blocks of the pyramid's top. Default 0.25.
    pub position_range: f32,
    /// Half the window's angle (rad). Default 0.2094: 12°.
    pub heading_range: f32,
    /// From one heading to the next (rad); 0: as far as the farthest point moves by a cell. Default 0.
    pub heading_step: f32,
    /// Least score, 0…1: a share of the peak above unexplored. Default 0.3.
    pub min_score: f32,
    /// Two poses this much alike in score, this far apart, are ambiguous (0…1; above 1: not looked for). Default 2.
    pub max_ambiguity: f32,
    /// Nearer modes are the same pose (m). Default 0.5.
    pub min_separation: f32,
    /// Exponent of each beam's likelihood in the covariance, 1 for beams that err independently. Default 0.1: neighbours err
    /// alike.
    pub temper: f32,
}

impl CorrelativeConfig {
    /// Around a good guess, such as wheel odometry.
    pub const DEFAULT: Self = Self {
        position_range: 0.25,
        heading_range: 0.2094,
        heading_step: 0.0,
        min_score: 0.3,
        max_ambiguity: 2.0,
        min_separation: 0.5,
        temper: 0.1,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("position_range", self.position_range, 0.0, 1000.0),
            config::within("heading_range", self.heading_range, 0.0, 3.15),
            config::within("heading_step", self.heading_step, 0.0, 1.0),
            config::within("min_score", self.min_score, 0.0, 1.0),
            config::within("max_ambiguity", self.max_ambiguity, 0.0, 10.0),
            config::within("min_separation", self.min_separation, 0.0, 1000.0),
            config::within("temper", self.temper, 1e-4, 1.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for CorrelativeConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
