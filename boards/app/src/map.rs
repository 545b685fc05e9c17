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

/// Bytes of RAM that a table's maxima take: for a static, `static mut MAXIMA: [u8; maxima_bytes(TABLE)]`.
///
/// # Panics
///
/// Where the table has no header. In a `const` it does not compile.
#[must_use]
pub const fn maxima_bytes(table: &[u8]) -> usize {
    let [_, _, _, _, _, _, w0, w1, h0, h1, ..] = table else {
        panic!("no table of `beamfix field`");
    };
    let (width, height) = (
        u16::from_le_bytes([*w0, *w1]),
        u16::from_le_bytes([*h0, *h1]),
    );
    // Blocks of 4 and of 16 cells.
    let (w4, h4) = (
        width.div_ceil(4) as usize + 1,
        height.div_ceil(4) as usize + 1,
    );
    let (w16, h16) = (
        width.div_ceil(16) as usize + 1,
        height.div_ceil(16) as usize + 1,
    );
    w4 * h4 + w16 * h16
}

impl<P: Protocol, const N: usize> Firmware<P, InMap<N>, N> {
    /// Tells the pose in the map of `table`; it is searched for in the first revolutions, unless a command tells it.
    ///
    /// # Errors
    ///
    /// Where the table is none, or `maxima` has less than [`maxima_bytes`].
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
