//! Settings of the firmware's application.

use beamfix::{
    lidar::{Model, motor::MotorConfig},
    odometry::OdometryConfig,
};

#[cfg(feature = "mavlink")]
use crate::mavlink::Autopilot;

/// The settings of all boards: change them here. One that is out of its range does not compile.
pub const CONFIG: AppConfig = checked(AppConfig::DEFAULT);

/// The same settings; in a `const`, those that cannot be used do not compile.
const fn checked(config: AppConfig) -> AppConfig {
    match config.odometry.checked() {
        Ok(_) => config,
        Err(_) => panic!("a setting of the odometry is out of its range"),
    }
}

/// Settings of [`App`](crate::App).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppConfig {
    /// The lidar: how far it sees. Default: an LD06.
    pub lidar: &'static Model,
    /// How the lidar sits on the robot, what is believed and what is not.
    pub odometry: OdometryConfig,
    /// What is sent. Default: frames.
    pub output: Output,
    /// Which autopilot MAVLink is for. Default: PX4.
    #[cfg(feature = "mavlink")]
    pub autopilot: Autopilot,
    /// Whether the lidar's bytes, wheels and gyroscope are sent on with their times, for a replay on a PC. Default: no;
    /// a command switches it.
    pub record: bool,
    /// Whether every beam is sent on, for a picture on a PC. Default: no; a command switches it.
    pub scans: bool,
    /// Whether every pose is followed by how good its match was, in numbers. Default: no; a command switches it.
    pub quality: bool,
    /// How the lidar's motor is driven, where its PWM line is connected. Default: an LD06's, which listens to the line
    /// only once it has seen a duty of 45 to 55 %, and is at its speed well within 5 s. `None` keeps the line low: an
    /// LD06 then turns at 10 Hz by itself.
    pub motor: Option<MotorConfig>,
}

impl AppConfig {
    /// An LD06 at the robot's centre, frames out.
    pub const DEFAULT: Self = Self {
        lidar: &Model::LDROBOT_LD06,
        odometry: OdometryConfig::DEFAULT,
        output: Output::Frames,
        #[cfg(feature = "mavlink")]
        autopilot: Autopilot::Px4,
        record: false,
        scans: false,
        quality: false,
        motor: Some(MotorConfig {
            initial_duty: 0.5,
            spin_up_ms: 5000,
            ..MotorConfig::LDROBOT_LD06
        }),
    };

    /// For a board's features of these names: lines for a terminal in the demo, MAVLink where this crate has it.
    #[must_use]
    pub const fn for_features(self, demo: bool, mavlink: bool) -> Self {
        let output = match (demo, mavlink) {
            #[cfg(feature = "mavlink")]
            (_, true) => Output::Mavlink,
            (true, _) => Output::Text,
            _ => self.output,
        };
        Self { output, ..self }
    }
}

/// What is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// The frames of [`link`](crate::link): everything of [`telemetry`](crate::telemetry).
    Frames,
    /// Lines for a terminal: poses and health.
    Text,
    /// MAVLink 2: poses as `ODOMETRY`, scans as `OBSTACLE_DISTANCE`.
    #[cfg(feature = "mavlink")]
    Mavlink,
}
