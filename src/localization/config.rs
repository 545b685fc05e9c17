//! Settings of the localizer.

use crate::{
    config::{self, ConfigError},
    matching::field::FieldConfig,
};

/// When to believe what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalizerConfig {
    /// Least quality of a scan that fits (−1…1): see `Quality::value`. Default 0.3: where people end six of ten beams, 19 of
    /// 20 right poses have more.
    pub min_quality: f32,
    /// Least quality of a scan that leaves no doubt. Default 0.35.
    pub confident_quality: f32,
    /// Largest accepted share of beams that crossed a wall of the map, among beams not cut short by unmapped things, where
    /// half of the beams agree; half of that where a third does. Default 0.125: at good poses 999 of 1000 scans have less, at
    /// wrong ones that fit otherwise most have more.
    pub max_wall_crossings: f32,
    /// Scans in a row that do not fit until the pose counts as lost. Default 3.
    pub max_bad_scans: u8,
    /// Scans in a row that fit but leave doubts until the pose counts as lost. Default 30.
    pub max_doubtful_scans: u8,
    /// Least mean quality of a candidate that can be the pose. Default 0.55.
    pub min_candidate_quality: f32,
    /// Least lead of the accepted candidate over the next, in quality summed over the scans. Default 0.25.
    pub min_margin: f32,
    /// Fewest scans after which a candidate is accepted. Default 2.
    pub min_scans: u8,
    /// Scans after which the search starts again if no candidate is accepted. Default 12.
    pub max_scans: u8,
    /// From one heading of the search to the next (rad). Default 0.0349: 2°.
    pub heading_step: f32,
    /// Half the side of the window around the prediction in which a scan that fits badly is searched (m). Default 0.4.
    pub position_range: f32,
    /// Half the angle of that window (rad). Default 0.3.
    pub heading_range: f32,
    /// Matching while tracking. Default [`FieldConfig::DEFAULT`], but a fifth of the beams near surfaces will do: people and
    /// unexplored parts may take the others.
    pub field: FieldConfig,
}

impl LocalizerConfig {
    /// For lidars that see all around, in rooms.
    pub const DEFAULT: Self = Self {
        min_quality: 0.3,
        confident_quality: 0.35,
        max_wall_crossings: 0.125,
        max_bad_scans: 3,
        max_doubtful_scans: 30,
        min_candidate_quality: 0.55,
        min_margin: 0.25,
        min_scans: 2,
        max_scans: 12,
        heading_step: 0.0349,
        position_range: 0.4,
        heading_range: 0.3,
        field: FieldConfig {
            min_inlier_share: 0.2,
            ..FieldConfig::DEFAULT
        },
    };

    /// For candidates, of which most are wrong: a few passes, to a few centimetres.
    pub(super) fn short(&self) -> FieldConfig {
        FieldConfig {
            max_iterations: 8,
            coarse_stride: 1,
            min_inlier_share: 0.1,
            translation_tolerance: 0.04,
            rotation_tolerance: 0.02,
            ..self.field
        }
    }

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("min_quality", self.min_quality, -1.0, 1.0),
            config::within(
                "confident_quality",
                self.confident_quality,
                self.min_quality,
                1.0,
            ),
            config::within("max_wall_crossings", self.max_wall_crossings, 0.0, 1.0),
            config::within("max_bad_scans", self.max_bad_scans as f32, 1.0, 255.0),
            config::within(
                "max_doubtful_scans",
                self.max_doubtful_scans as f32,
                1.0,
                255.0,
            ),
            config::within(
                "min_candidate_quality",
                self.min_candidate_quality,
                -1.0,
                1.0,
            ),
            config::within("min_margin", self.min_margin, 0.0, 255.0),
            config::within("min_scans", self.min_scans as f32, 1.0, 255.0),
            config::within(
                "max_scans",
                self.max_scans as f32,
                self.min_scans as f32,
                255.0,
            ),
            config::within("heading_step", self.heading_step, 0.01, 0.5),
            config::within("position_range", self.position_range, 0.0, 10.0),
            config::within("heading_range", self.heading_range, 0.0, 3.15),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for LocalizerConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
