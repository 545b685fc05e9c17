//! A map in flash: the table that `beamfix field MAP.yaml --out FILE` wrote, linked into the firmware with `include_bytes!`.

use beamfix::{
    Localizer, LocalizerConfig, MapLocalizer, grid::GridError, lidar::Protocol,
    matching::correlative::Pyramid, sensor_model::likelihood_field::stored,
};

use crate::{AppConfig, Firmware, Lidar};

/// Points of a scan that localization uses where all are not needed.
pub const POINTS: usize = 96;

/// Localization in a map that lies in flash.
pub type InMap<const N: usize> = MapLocalizer<'static, N, POINTS>;

/// What a board with this lidar runs that tells its pose in a map.
pub type LocalizationWith<L, const N: usize> = Firmware<<L as Lidar>::Parser, InMap<N>, N>;

impl<P: Protocol, const N: usize> Firmware<P, InMap<N>, N> {
    /// Tells the pose in the map of `table`; it is searched for in the first revolutions, unless a command tells it.
    ///
    /// # Errors
    ///
    /// Where the table is none, or `maxima` has fewer bytes than [`Pyramid::bytes`], which `beamfix field` tells.
    pub fn in_map(
        config: &AppConfig,
        lidar: P,
        table: &'static [u8],
        maxima: &'static mut [u8],
    ) -> Result<Self, GridError> {
        let pyramid = Pyramid::new(stored::parse(table)?, maxima)?;
        let localizer = Localizer::new(pyramid, LocalizerConfig::DEFAULT);
        let task = MapLocalizer::new(localizer, config.odometry.points);
        Ok(Self::with_task(config, lidar, task))
    }
}
