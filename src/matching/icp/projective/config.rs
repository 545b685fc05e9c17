//! Settings of the projective matcher.

use crate::config::{self, ConfigError};

/// How far the guess may be off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Search {
    /// By a few centimetres and degrees: odometry. The guess alone is tried first, and others only if it fails. What is
    /// found far from the guess (0.75 m, a turn counted at 3 m) must explain more of the scan, and is refused as
    /// ambiguous where another pose explains nearly as much.
    #[default]
    Local,
    /// By 40 cm and 45°, or not there at all: always a bounded number of starts around it.
    Global,
}

/// Settings of [`align`](super::align).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IcpConfig {
    /// How far the guess may be off. Default [`Search::Local`].
    pub search: Search,
    /// Beams in a coarse pass; half of all are used in each fine one. Default 45: the accuracy that fewer cost is won back by
    /// the fine passes.
    pub coarse_beams: u16,
    /// Fewest beams that must agree with the reference. Default 30.
    pub min_inliers: u16,
    /// Worst score that is accepted, from 0 (nothing agrees) to 1. Default 0.25: on recorded pairs no right
    /// pose had less than 0.3.
    pub min_score: f32,
    /// Standard deviation of a range (m): the least noise that the covariance assumes. Default 0.005.
    pub min_range_sigma: f32,
    /// A direction counts as degenerate if it is told by less than this share of what all beams would tell head on. Default 0.01:
    /// in a corridor normals that are good to 2.7° make it 0.002, and what stands out of the walls as much again.
    pub min_constraint_share: f32,
}

impl IcpConfig {
    /// For odometry with a cheap lidar.
    pub const DEFAULT: Self = Self {
        search: Search::Local,
        coarse_beams: 45,
        min_inliers: 30,
        min_score: 0.25,
        min_range_sigma: 0.005,
        min_constraint_share: 0.01,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// A setting out of its range does not compile:
    ///
    /// ```compile_fail
    /// # use beamfix::matching::icp::IcpConfig;
    /// const ICP: IcpConfig = match (IcpConfig { min_score: 25.0, ..IcpConfig::DEFAULT }).checked() {
    ///     Ok(config) => config,
    ///     Err(_) => panic!("min_score is a share, not per cent"),
    /// };
    /// # fn main() { let _ = ICP; }
    /// ```
    ///
    /// With `min_score: 0.3` it does:
    ///
    /// ```
    /// # use beamfix::matching::icp::IcpConfig;
    /// const ICP: IcpConfig = match (IcpConfig { min_score: 0.3, ..IcpConfig::DEFAULT }).checked() {
    ///     Ok(config) => config,
    ///     Err(_) => panic!("min_score is a share, not per cent"),
    /// };
    /// # let _ = ICP;
    /// ```
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("coarse_beams", self.coarse_beams as f32, 10.0, 65535.0),
            config::within("min_inliers", self.min_inliers as f32, 3.0, 65535.0),
            config::within("min_score", self.min_score, 0.0, 1.0),
            config::within("min_range_sigma", self.min_range_sigma, 1e-4, 1.0),
            config::within("min_constraint_share", self.min_constraint_share, 0.0, 0.5),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
