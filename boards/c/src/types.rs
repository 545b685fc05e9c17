//! What passes between C and Rust: plain numbers, each with its unit.
//!
//! Enumerations have 32 bits: a plain C `enum` has 8 with `-fshort-enums`, Arm's default without an operating system, and 32 without.

use core::ffi::c_void;

use beamfix_core::{ConfigError, OdometryConfig, Pose};

/// Version of this interface: of the functions, types and constants of this header. It changes with each of them.
pub const BEAMFIX_VERSION: u32 = 2;
/// Alignment of the memory that every object is made in (bytes).
pub const BEAMFIX_ALIGN: usize = 8;
/// Most beams of a revolution; further ones are refused and counted.
pub const BEAMFIX_BEAMS: usize = 1100;
/// The same for objects of the functions whose names end in `_small`, for a microcontroller with 16 KB of RAM: of an LD06's 450
/// beams the last 66, or 53 degrees, are given up, so that the stack fits too.
pub const BEAMFIX_SMALL_BEAMS: usize = 384;
/// Memory for odometry with any lidar (bytes).
pub const BEAMFIX_ODOMETRY_BYTES: usize = 36_600;
/// Memory for odometry with BEAMFIX_SMALL_BEAMS (bytes), with any lidar.
pub const BEAMFIX_SMALL_ODOMETRY_BYTES: usize = 17_600;
/// The same with one of LDROBOT's lidars (LD06, LD19, STL-19P, ...), whose packets are short.
pub const BEAMFIX_LDROBOT_SMALL_ODOMETRY_BYTES: usize = 12_120;
/// Memory for localization (bytes), with any lidar; a map takes BEAMFIX_MAP_BYTES(width, height) more.
pub const BEAMFIX_LOCALIZATION_BYTES: usize = 28_600;
/// The same with BEAMFIX_SMALL_BEAMS (bytes).
pub const BEAMFIX_SMALL_LOCALIZATION_BYTES: usize = 17_600;
/// Memory for mapping (bytes), with any lidar.
pub const BEAMFIX_MAPPING_BYTES: usize = 208_000;
/// Memory for a lidar's start-up (bytes).
pub const BEAMFIX_STARTUP_BYTES: usize = 400;
/// Most bytes of a beamfix_action.
pub const BEAMFIX_ACTION_BYTES: usize = 24;

/// What became of a call. Errors are negative.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, and a revolution is complete: the step was written.
    Step = 1,
    /// A pointer is null.
    NullPointer = -1,
    /// The memory is too small: see the constants of this header.
    StorageTooSmall = -2,
    /// The memory is not aligned to BEAMFIX_ALIGN bytes.
    Misaligned = -3,
    /// The object was not made, or its memory was overwritten or moved since.
    NotMade = -4,
    /// A setting is out of its range, or not a number.
    BadConfig = -5,
    /// The table is no field that `beamfix field` wrote, or it is cut off.
    BadField = -6,
    /// A number is infinite or not a number.
    NotANumber = -7,
    /// The object does another task: only mapping has a map to be drawn, and only localization is told where it starts.
    OtherTask = -8,
}

/// How a pose was found.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// By matching the scan: rely on it.
    Measured = 0,
    /// By the motion since the last measured one: the scan did not fit, and the reason says why. Drive slowly, or stop.
    Predicted = 1,
    /// Not at all: there is no pose.
    Unknown = 2,
}

/// Why a pose is not measured.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It is measured.
    None = 0,
    /// The first revolution: there is nothing to match it against.
    FirstScan = 1,
    /// The revolution has too few beams with a range: the lidar is covered, or in a void.
    TooFewBeams = 2,
    /// What it was matched against has too few surfaces.
    TooFewLines = 3,
    /// Too few beams found a surface that they could belong to.
    TooFewCorrespondences = 4,
    /// The geometry leaves a direction undetermined, as a long corridor does.
    Degenerate = 5,
    /// The iteration limit came first.
    NotConverged = 6,
    /// Two poses explain the revolution equally well.
    Ambiguous = 7,
    /// No pose that was tried reaches the least score.
    NothingFound = 8,
    /// The best pose explains the revolution badly.
    Unlikely = 9,
    /// The match is too far from the prediction to be believed.
    TooFar = 10,
    /// The prediction is not a number, or farther away than the matcher can reckon.
    BadGuess = 11,
    /// Localization: the scan fits the map badly, or so that the pose may be another.
    Doubtful = 12,
    /// Localization: the pose is being searched; call beamfix_work between the revolutions.
    Searching = 13,
    /// Localization: several poses are left, and more scans will tell them apart.
    Choosing = 14,
}

/// Settings: how the lidar sits on the robot, and which ranges count. beamfix_default_config fills them in for a lidar.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Config {
    /// Place of the lidar on the robot: forward of its centre (m).
    pub mount_x: f32,
    /// Left of its centre (m).
    pub mount_y: f32,
    /// Direction in which the lidar's zero looks, counter-clockwise from forward (rad).
    pub mount_theta: f32,
    /// Whether the lidar hangs head down: 0 or 1.
    pub upside_down: u8,
    /// Shorter ranges are left out (m): the robot's own body. 0 to 32.
    pub min_range: f32,
    /// Longer ranges are left out (m). min_range to 32.
    pub max_range: f32,
}

/// Where the robot is after a revolution of the lidar, and how well that is known.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Robot at the revolution's end: forward (m), in the frame in which it started, or in the map.
    pub x: f32,
    /// Left (m).
    pub y: f32,
    /// Heading, in [-pi, pi) (rad).
    pub theta: f32,
    /// Covariance of the three in the same frame: xx, xy, yy (m^2), x-theta, y-theta (m rad), theta-theta (rad^2). Of odometry
    /// since the start; all 0 where has_covariance is 0.
    pub covariance: [f32; 6],
    /// End of the revolution by the lidar's clock, where it has one, else by the caller's (us, wrapping).
    pub time_us: u32,
    /// Counts revolutions from 0, wrapping.
    pub sequence: u32,
    /// Times that what scans are matched against was given up, or a map's loop closed, wrapping: when it grows, the pose may have jumped.
    pub lost: u32,
    /// How the pose was found.
    pub verdict: Verdict,
    /// Why it is not measured.
    pub reason: Reason,
    /// Whether the covariance is known: 0 or 1.
    pub has_covariance: u8,
}

/// Counters since the object was made; all wrap.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct Health {
    /// Packets that passed every check.
    pub packets: u32,
    /// Packets that failed their check code.
    pub check_errors: u32,
    /// Bytes that belong to no packet.
    pub skipped_bytes: u32,
    /// Beams that a revolution had no room for, and those of interrupted revolutions.
    pub beams_refused: u32,
    /// Revolutions matched.
    pub revolutions: u32,
    /// Revolutions whose pose was not measured, the first one left out.
    pub refused: u32,
    /// Times that what scans are matched against was given up.
    pub lost: u32,
}

/// What a start-up wants done.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionKind {
    /// Nothing; ask again within 10 ms.
    Wait = 0,
    /// Send the bytes to the lidar.
    Send = 1,
    /// Set the UART to `baud` bits/s, once all that was to be sent has left it.
    SetBaud = 2,
    /// Switch the motor on, where the board does that.
    MotorOn = 3,
    /// Measurements come: call beamfix_use_startup once, and give the bytes to beamfix_push_lidar from now on.
    Ready = 4,
    /// The lidar does not answer, or says that it is broken: start over after a while.
    Failed = 5,
}

/// What a start-up wants done, and with what.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Action {
    /// What to do.
    pub kind: ActionKind,
    /// Speed of the line to set (bits/s).
    pub baud: u32,
    /// How many of the bytes are to be sent.
    pub count: u8,
    /// The bytes to send.
    pub bytes: [u8; BEAMFIX_ACTION_BYTES],
}

/// Takes a place that a beam of a revolution hit, in the robot's frame at the revolution's end, not corrected for the robot's motion
/// during it (m). `user` is what was given with the callback.
pub type PointCallback = Option<unsafe extern "C" fn(user: *mut c_void, x: f32, y: f32)>;

impl Config {
    /// The settings of this configuration, where all of them are in their ranges.
    pub(crate) fn odometry(&self, preset: OdometryConfig) -> Result<OdometryConfig, ConfigError> {
        let mut config = preset;
        let mount = &mut config.points.mount;
        mount.robot_from_lidar = Pose::new(self.mount_x, self.mount_y, self.mount_theta);
        mount.upside_down = self.upside_down != 0;
        config.points.min_range = self.min_range;
        config.points.max_range = self.max_range;
        config.checked()
    }

    pub(crate) fn is_finite(&self) -> bool {
        [self.mount_x, self.mount_y, self.mount_theta]
            .iter()
            .all(|number| number.is_finite())
    }
}
