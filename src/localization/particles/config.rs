//! Settings of the particle filter.

use crate::{
    config::{self, ConfigError},
    linalg::Covariance,
    matching::field::FieldConfig,
    math,
};

/// Where a particle's next pose is drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Proposal {
    /// From what the motion tells alone.
    Motion,
    /// From the normal distribution that is nearest to the product of what the motion tells and what the scan does, around
    /// the place to which a match leads; from the motion alone where no match is found.
    #[default]
    Improved,
}

/// How particles are moved, weighed and judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticleConfig {
    /// Where a particle's next pose is drawn from. Default [`Proposal::Improved`].
    pub proposal: Proposal,
    /// Particles in use, as far as there is room. Default `u16::MAX`: all that there is room for.
    pub particles: u16,
    /// Beams of a scan that count as independent where the pose is known: more than these share their weight. Default 96: all
    /// of a filter of 96 points.
    pub independent_beams: f32,
    /// Beams of a scan that count as independent where the pose is not known: poses that fit about as well as others live on.
    /// Default 8: a room has few walls.
    pub spread_beams: f32,
    /// Least way of the lidar (m) from one scan that is weighed to the next. Default 0.05: a cell of the map.
    pub min_distance: f32,
    /// Least rotation of the lidar (rad) from one scan that is weighed to the next. Default 0.05: beams end a cell
    /// farther on 1 m away.
    pub min_rotation: f32,
    /// Least quality of a scan that fits (−1…1), as a localizer has it. Default 0.3.
    pub min_quality: f32,
    /// Largest accepted share of beams that crossed a wall of the map, as for a localizer. Default 0.125.
    pub max_wall_crossings: f32,
    /// Scans in a row that do not fit until the pose counts as lost. Default 3.
    pub max_bad_scans: u8,
    /// Least quality of the scans by which a pose is found. Default 0.55, as for a localizer's candidates.
    pub min_found_quality: f32,
    /// Scans in a row of at least `min_found_quality` by which a pose is found. Default 5.
    pub min_found_scans: u8,
    /// Largest standard deviation of a pose that is known, in its worst direction (m). Default 0.2: from about so far off a
    /// match leads back.
    pub max_position_sigma: f32,
    /// Largest standard deviation of the heading of a pose that is known (rad). Default 0.1.
    pub max_heading_sigma: f32,
    /// Settings of the matches. Default [`FieldConfig::DEFAULT`], but a fifth of the beams near surfaces will do, as for a
    /// localizer.
    pub field: FieldConfig,
    /// Seed of the random numbers: the same seed repeats a run to the bit. Default 1.
    pub seed: u32,
}

impl ParticleConfig {
    /// For lidars that see all around, in rooms.
    pub const DEFAULT: Self = Self {
        proposal: Proposal::Improved,
        particles: u16::MAX,
        independent_beams: 96.0,
        spread_beams: 8.0,
        min_distance: 0.05,
        min_rotation: 0.05,
        min_quality: 0.3,
        max_wall_crossings: 0.125,
        max_bad_scans: 3,
        min_found_quality: 0.55,
        min_found_scans: 5,
        max_position_sigma: 0.2,
        max_heading_sigma: 0.1,
        field: FieldConfig {
            min_inlier_share: 0.2,
            ..FieldConfig::DEFAULT
        },
        seed: 1,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("particles", self.particles as f32, 1.0, 65_535.0),
            config::within("independent_beams", self.independent_beams, 1.0, 65_535.0),
            config::within("spread_beams", self.spread_beams, 1.0, 65_535.0),
            config::within("min_distance", self.min_distance, 0.0, 10.0),
            config::within("min_rotation", self.min_rotation, 0.0, 3.15),
            config::within("min_quality", self.min_quality, -1.0, 1.0),
            config::within("max_wall_crossings", self.max_wall_crossings, 0.0, 1.0),
            config::within("max_bad_scans", self.max_bad_scans as f32, 1.0, 255.0),
            config::within("min_found_quality", self.min_found_quality, -1.0, 1.0),
            config::within("min_found_scans", self.min_found_scans as f32, 1.0, 255.0),
            config::within("max_position_sigma", self.max_position_sigma, 0.001, 10.0),
            config::within("max_heading_sigma", self.max_heading_sigma, 0.001, 3.15),
        ];
        match (config::all(&checks), self.field.checked()) {
            (Ok(()), Ok(_)) => Ok(self),
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    /// Particles in use where there is room for so many.
    pub(super) fn count(&self, room: usize) -> usize {
        room.min(usize::from(self.particles.max(1)))
    }

    /// Whether a pose of this covariance is not known.
    pub(super) fn is_spread(&self, covariance: &Covariance) -> bool {
        let m = &covariance.0;
        let (half, differ) = (0.5 * (m.xx + m.yy), 0.5 * (m.xx - m.yy));
        let worst = half + math::sqrt(differ * differ + m.xy * m.xy);
        !(worst <= self.max_position_sigma * self.max_position_sigma
            && m.tt <= self.max_heading_sigma * self.max_heading_sigma)
    }
}

impl Default for ParticleConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
