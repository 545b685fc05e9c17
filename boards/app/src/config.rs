//! Settings of the firmware's application.

use beamfix::{
    lidar::{Model, Motor, motor::MotorConfig},
    odometry::OdometryConfig,
};

use crate::lidars::same;
#[cfg(feature = "mavlink")]
use crate::mavlink::Autopilot;

/// The settings for an LD06 at the robot's centre.
pub const CONFIG: AppConfig = AppConfig::DEFAULT.checked();

/// Settings of [`App`](crate::App).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppConfig {
    /// The lidar: the speed of its line, how it is started, how fast it turns, how far it sees. Default: an LD06.
    pub lidar: &'static Model,
    /// How the lidar sits on the robot, what is believed and what is not. Localization takes the points' part of it.
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
        motor: motor(&Model::LDROBOT_LD06),
    };

    /// A lidar of this model at the robot's centre, frames out.
    #[must_use]
    pub const fn for_model(model: &'static Model) -> Self {
        if same(model.name, Model::LDROBOT_LD06.name) {
            return Self::DEFAULT;
        }
        Self {
            lidar: model,
            odometry: OdometryConfig::for_model(model),
            motor: motor(model),
            ..Self::DEFAULT
        }
    }

    /// For a board's features of these names: lines for a terminal in the demo, MAVLink where this crate has it.
    #[must_use]
    pub const fn for_features(self, demo: bool, mavlink: bool) -> Self {
        let output = match (demo, mavlink) {
            #[cfg(feature = "mavlink")]
            (_, true) => Output::Mavlink,
            #[cfg(feature = "text")]
            (true, _) => Output::Text,
            _ => self.output,
        };
        Self { output, ..self }
    }

    /// The same; in a `const`, settings that cannot be used do not compile.
    ///
    /// # Panics
    ///
    /// Where one is out of its range.
    #[must_use]
    pub const fn checked(self) -> Self {
        match self.odometry.checked() {
            Ok(_) => self,
            Err(_) => panic!("a setting of the odometry is out of its range"),
        }
    }
}

/// How a lidar's motor is driven by a PWM line, where it can be.
const fn motor(model: &Model) -> Option<MotorConfig> {
    let config = match model.motor {
        Motor::OwnOrPwm => MotorConfig {
            initial_duty: 0.5,
            spin_up_ms: 5000,
            ..MotorConfig::LDROBOT_LD06
        },
        Motor::Pwm => MotorConfig::NEATO_XV11,
        _ => return None,
    };
    Some(MotorConfig {
        target_rpm: 6.0 * model.revolutions_per_10s as f32,
        ..config
    })
}

/// What is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// The frames of [`link`](crate::link): everything of [`telemetry`](crate::telemetry).
    Frames,
    /// Lines for a terminal: poses and health.
    #[cfg(feature = "text")]
    Text,
    /// MAVLink 2: poses as `ODOMETRY`, scans as `OBSTACLE_DISTANCE`.
    #[cfg(feature = "mavlink")]
    Mavlink,
}
