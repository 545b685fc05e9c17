//! Settings of the odometry.

use crate::{
    config::{self, ConfigError},
    lidar::Model,
    matching::icp::{IcpConfig, Search},
    scan::{Mount, PointsConfig},
};

/// Points that a preset thins a finer lidar's scans to: at 0.35° neighbours on a wall 3 m away are 2 cm apart, which is a
/// cheap lidar's noise, so that more of them tell little.
const MAX_POINTS: u16 = 1024;

/// Settings of [`Odometry`](super::Odometry).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryConfig {
    /// How the lidar sits on the robot, which ranges are used, and how scans are thinned.
    /// Default [`PointsConfig::DEFAULT`]: every beam between 0.05 m and 32 m.
    pub points: PointsConfig,
    /// Directions that a keyframe tells apart, at most the capacity N. Best the number of beams of a full revolution,
    /// also for a lidar that sees less than one. Default 456: the 450 beams of an LD06 at 10 Hz.
    pub directions: u16,
    /// Distance from the last keyframe at which a new one is made (m). Default 0.4: near enough for most surfaces to be
    /// seen by both, far enough for errors not to add up often.
    pub keyframe_distance: f32,
    /// Rotation from the last keyframe at which a new one is made (rad). Default 0.8. While the turn rate changes, a
    /// constant-velocity deskew is wrong: this and the distance are doubled then.
    pub keyframe_rotation: f32,
    /// A new keyframe is made when fewer than this share of the beams meet the last one's surfaces. Default 0.6.
    pub keyframe_overlap: f32,
    /// Farthest accepted distance of a match from its guess for a match that explains every beam (m; twice as many
    /// radians); for one that explains half of them it is half as far. Two standard deviations of the predicted pose are
    /// added. Default 0.45: wheels that slip or spin, not another room.
    pub max_correction: f32,
    /// Standard deviation of the motion by the wheels that is assumed at the start, as a share of its distance and of its
    /// rotation; while driving it follows from how far matches differ from the wheels. Unused without wheels. Default 0.1.
    pub prior_error: f32,
    /// The refused scan in a row that becomes the keyframe in place of the one it does not fit, if it has at least twice
    /// `icp.min_inliers` points. Default 10: an occlusion of less than a second at 10 Hz does not lose the keyframe.
    pub max_refused: u8,
    /// Settings of the matcher. Default [`IcpConfig::DEFAULT`], but a direction counts as degenerate below a share of
    /// 0.035: along a corridor the guess is better than what a few beams tell.
    pub icp: IcpConfig,
}

impl OdometryConfig {
    /// For a wheeled robot with a lidar of 5 to 15 revolutions a second.
    pub const DEFAULT: Self = Self {
        points: PointsConfig::DEFAULT,
        directions: 456,
        keyframe_distance: 0.4,
        keyframe_rotation: 0.8,
        keyframe_overlap: 0.6,
        max_correction: 0.45,
        prior_error: 0.1,
        max_refused: 10,
        icp: IcpConfig {
            min_constraint_share: 0.035,
            ..IcpConfig::DEFAULT
        },
    };

    /// All bytes zero: no settings yet.
    pub(super) const ZERO: Self = Self {
        points: PointsConfig {
            mount: Mount::DEFAULT,
            min_range: 0.0,
            max_range: 0.0,
            max_points: 0,
        },
        directions: 0,
        keyframe_distance: 0.0,
        keyframe_rotation: 0.0,
        keyframe_overlap: 0.0,
        max_correction: 0.0,
        prior_error: 0.0,
        max_refused: 0,
        icp: IcpConfig {
            search: Search::Local,
            coarse_beams: 0,
            min_inliers: 0,
            min_score: 0.0,
            min_range_sigma: 0.0,
            min_constraint_share: 0.0,
        },
    };

    /// [`OdometryConfig::DEFAULT`] for a lidar of this model: its ranges, as far as [`PointsConfig`] can hold them and from
    /// 5 cm on; a direction for each beam of a full revolution at the usual speed. Scans of more than 1024 beams are
    /// thinned, with fewer directions to match.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let default = Self::DEFAULT;
        let near = model.min_range_mm as f32 / 1000.0;
        let far = model.max_range_mm as f32 / 1000.0;
        let turns = if model.revolutions_per_10s == 0 {
            1
        } else {
            model.revolutions_per_10s as u32
        };
        let beams = (model.points_per_s * 10).div_ceil(turns);
        let averaged = beams.div_ceil(MAX_POINTS as u32);
        let directions = if averaged == 0 {
            1
        } else {
            beams.div_ceil(averaged)
        };
        Self {
            points: PointsConfig {
                min_range: if near > default.points.min_range {
                    near
                } else {
                    default.points.min_range
                },
                max_range: if far < default.points.max_range {
                    far
                } else {
                    default.points.max_range
                },
                max_points: MAX_POINTS,
                ..default.points
            },
            directions: directions as u16,
            ..default
        }
    }

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// A setting out of its range does not compile:
    ///
    /// ```compile_fail,E0080
    /// # use beamfix::odometry::OdometryConfig;
    /// const CONFIG: OdometryConfig = match (OdometryConfig { keyframe_overlap: 60.0, ..OdometryConfig::DEFAULT }).checked() {
    ///     Ok(config) => config,
    ///     Err(_) => panic!("keyframe_overlap is a share, not per cent"),
    /// };
    /// # fn main() { let _ = CONFIG; }
    /// ```
    ///
    /// One within it does, here for a lidar that the library knows:
    ///
    /// ```
    /// # use beamfix::{lidar::Model, odometry::OdometryConfig};
    /// const CONFIG: OdometryConfig = match OdometryConfig::for_model(&Model::LDROBOT_LD06).checked() {
    ///     Ok(config) => config,
    ///     Err(_) => panic!("a setting is out of its range"),
    /// };
    /// assert_eq!((CONFIG.directions, CONFIG.points.max_range), (450, 12.0));
    /// ```
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        if let Err(error) = self.points.checked() {
            return Err(error);
        }
        if let Err(error) = self.icp.checked() {
            return Err(error);
        }
        let (directions, needed) = (self.directions as f32, self.icp.min_inliers as f32);
        let checks = [
            // A keyframe of fewer lines is never matched against.
            config::within("directions", directions, needed, 65535.0),
            config::within("keyframe_distance", self.keyframe_distance, 0.01, 10.0),
            config::within("keyframe_rotation", self.keyframe_rotation, 0.01, 3.15),
            config::within("keyframe_overlap", self.keyframe_overlap, 0.0, 1.0),
            config::within("max_correction", self.max_correction, 0.01, 10.0),
            config::within("prior_error", self.prior_error, 0.0, 1.0),
            config::within("max_refused", self.max_refused as f32, 1.0, 255.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }

    /// The same settings for a lidar that sits on the robot like this.
    #[must_use]
    pub const fn with_mount(mut self, mount: Mount) -> Self {
        self.points.mount = mount;
        self
    }
}

impl Default for OdometryConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preset_of_every_lidar_is_within_its_ranges() {
        assert_eq!(
            OdometryConfig::DEFAULT.checked(),
            Ok(OdometryConfig::DEFAULT)
        );
        for model in Model::ALL {
            let config = OdometryConfig::for_model(model);
            assert_eq!(config.checked(), Ok(config), "{}", model.name);
            let most = config.points.max_points;
            assert!(config.directions <= most, "{}: {config:?}", model.name);
        }
    }

    #[test]
    fn a_setting_out_of_its_range_is_named() {
        type Set = fn(&mut OdometryConfig);
        let set: [(&str, Set); 9] = [
            ("directions", |config| config.directions = 29),
            ("keyframe_distance", |config| config.keyframe_distance = 0.0),
            ("keyframe_rotation", |config| {
                config.keyframe_rotation = 45.0
            }),
            ("keyframe_overlap", |config| config.keyframe_overlap = 1.01),
            ("max_correction", |config| config.max_correction = f32::NAN),
            ("prior_error", |config| config.prior_error = -0.1),
            ("max_refused", |config| config.max_refused = 0),
            ("max_range", |config| config.points.max_range = 40.0),
            ("min_score", |config| config.icp.min_score = 25.0),
        ];
        for (wanted, spoil) in set {
            let mut config = OdometryConfig::DEFAULT;
            spoil(&mut config);
            let refused = config.checked();
            assert!(
                matches!(refused, Err(ConfigError::OutOfRange { setting, .. }) if setting == wanted),
                "{wanted}: {refused:?}"
            );
        }
    }
}
