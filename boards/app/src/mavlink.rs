//! Poses and obstacles as MAVLink 2, for an autopilot: `ODOMETRY`, `OBSTACLE_DISTANCE`, and a `HEARTBEAT` each second.
//!
//! MAVLink's axes are forward, right, down; ours forward, left, up. `docs/mavlink.md` has the autopilots' parameters, and what each
//! field tells them.

use beamfix::{
    geometry::{Point, Pose as Placed, Twist},
    math,
    scan::{Bearing, Mount, NoReturn, Scan},
};
use heapless::Vec;
#[cfg(not(feature = "prove-no-panic"))]
use mavlink::{MAVLinkV2MessageRaw, MavHeader};
use mavlink::{
    MessageData,
    dialects::common::{
        HEARTBEAT_DATA, MavAutopilot, MavDistanceSensor, MavEstimatorType, MavFrame, MavModeFlag,
        MavState, MavType, OBSTACLE_DISTANCE_DATA, ODOMETRY_DATA,
    },
};

use crate::{
    AppConfig,
    telemetry::{LidarState, Pose, Verdict},
};

/// Directions of `OBSTACLE_DISTANCE`, 5° each.
pub const SECTORS: usize = 72;
/// Of a sector that nobody has looked into.
pub const UNKNOWN_CM: u16 = u16::MAX;
/// Time between two heartbeats (µs): the protocol's 1 Hz.
pub const HEARTBEAT_US: u64 = 1_000_000;

/// Whose ideas of a variance that is not known the messages follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Autopilot {
    /// PX4: takes each axis by its own variance, and drops all of them where one is not finite. What is not known gets a large one.
    Px4,
    /// ArduPilot: makes one number of the variances of all axes, so that a large one of the height would throw the pose away.
    /// What is not known gets 0; its height and attitude come from elsewhere by its parameters.
    ArduPilot,
}

impl Autopilot {
    /// Variances of a position (m²) and of an angle (rad²) that are not known: 100 m, and more than half a turn.
    const fn not_known(self) -> (f32, f32) {
        match self {
            Self::Px4 => (1e4, 10.0),
            Self::ArduPilot => (0.0, 0.0),
        }
    }
}

/// What one link remembers: its sequence of messages, a clock that does not wrap, when the last heartbeat was.
#[derive(Debug)]
pub struct Link {
    sequence: u8,
    now_us: u64,
    heartbeat_due_us: u64,
    /// The last pose, if it was known, and its time by the lidar's clock (µs).
    last: Option<(Placed, u32)>,
}

impl Link {
    /// At the start of the board's clock; a heartbeat is due at once.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            sequence: 0,
            now_us: 0,
            heartbeat_due_us: 0,
            last: None,
        }
    }

    /// Says what the board's clock shows (µs, wrapping): at least once in half an hour, or a wrap goes unseen.
    pub fn set_time(&mut self, now_us: u32) {
        let passed = now_us.wrapping_sub(self.now_us as u32);
        // A clock that was set back stands until it has caught up.
        if passed < 1 << 31 {
            self.now_us += u64::from(passed);
        }
    }

    /// Time since the start (µs).
    #[must_use]
    pub const fn now_us(&self) -> u64 {
        self.now_us
    }

    /// Appends a `HEARTBEAT` where a second has passed since the last one; the lidar's state is the system's.
    #[inline(never)]
    pub fn heartbeat_when_due<const B: usize>(&mut self, lidar: LidarState, out: &mut Vec<u8, B>) {
        if self.now_us < self.heartbeat_due_us {
            return;
        }
        self.heartbeat_due_us = self.now_us + HEARTBEAT_US;
        let heartbeat = HEARTBEAT_DATA {
            custom_mode: 0,
            mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
            autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
            base_mode: MavModeFlag::empty(),
            system_status: match lidar {
                LidarState::Unknown | LidarState::Turning => MavState::MAV_STATE_ACTIVE,
                _ => MavState::MAV_STATE_CRITICAL,
            },
            mavlink_version: 3,
        };
        self.send(&heartbeat, out);
    }

    /// The velocity from the last pose to this one, for what tells none itself; remembers the pose, if it is known.
    fn velocity(&mut self, pose: &Pose, is_known: bool) -> Option<Twist> {
        let [x, y, theta] = pose.pose;
        let now = Placed::new(x, y, theta);
        let last = core::mem::replace(&mut self.last, is_known.then_some((now, pose.time_us)));
        let (last, last_us) = last.filter(|_| is_known)?;
        let passed_us = pose.time_us.wrapping_sub(last_us);
        (1..1_000_000)
            .contains(&passed_us)
            .then(|| Twist::from_motion(last.between(now), passed_us as f32 * 1e-6))
    }

    /// Appends a pose and the obstacles of its scan.
    #[inline(never)]
    pub fn append<const N: usize, const B: usize>(
        &mut self,
        step: &Told,
        scan: &Scan<N>,
        limits: &Limits,
        out: &mut Vec<u8, B>,
    ) {
        let time_us = self.now_us;
        // A pose that nobody knows is no pose, and a velocity of 0 that nobody knows would be believed.
        let known = !matches!(step.pose.verdict, Verdict::Searching | Verdict::Choosing);
        let between = self.velocity(&step.pose, known);
        let twist = step.twist.or(between);
        if known && twist.is_some() {
            self.send(&odometry(&Told { twist, ..*step }, time_us), out);
        }
        self.send(&obstacles(scan, limits, time_us), out);
    }

    /// The crate's writing panics where a buffer is full. It never is: the buffer has room for the longest message there is,
    /// 255 bytes, but only the loops' lengths say that ours are shorter, which a linker does not see.
    #[cfg(not(feature = "prove-no-panic"))]
    #[inline(never)]
    fn send<const B: usize>(&mut self, message: &impl MessageData, out: &mut Vec<u8, B>) {
        // Who sends: the autopilot's own system, component `MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY`.
        let header = MavHeader {
            system_id: 1,
            component_id: 197,
            sequence: self.sequence,
        };
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message_data(header, message);
        // A message that finds no room is lost on purpose, and its number with it: the gap tells.
        self.sequence = self.sequence.wrapping_add(1);
        let _ = out.extend_from_slice(raw.raw_bytes());
    }

    /// In the crate's place: every field is used, so what computes it is in the proof.
    #[cfg(feature = "prove-no-panic")]
    #[inline(never)]
    fn send<const B: usize>(&mut self, message: &impl MessageData, out: &mut Vec<u8, B>) {
        let _ = out.push(core::hint::black_box(self.sequence));
        self.sequence = self.sequence.wrapping_add(1);
        let _ = core::hint::black_box(message);
    }
}

/// What `ODOMETRY` tells of a revolution.
#[derive(Debug, Clone, Copy)]
pub struct Told {
    /// The pose as the frames have it.
    pub pose: Pose,
    /// The robot's velocity; where the task tells none, a [`Link`] has it from two poses.
    pub twist: Option<Twist>,
    /// Times that the pose may have jumped, wrapping.
    pub resets: u8,
    /// Who listens.
    pub autopilot: Autopilot,
}

/// Where the lidar sits and how far it sees, as `OBSTACLE_DISTANCE` needs it.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    mount: Mount,
    /// Ranges that count (mm).
    nearest_mm: u16,
    farthest_mm: u16,
    /// Distances from the robot's centre that every direction can tell (cm).
    min_cm: u16,
    max_cm: u16,
}

impl Limits {
    /// By the application's settings: the lidar's own limits, and those of what is believed.
    #[must_use]
    pub fn of(config: &AppConfig) -> Self {
        let points = &config.odometry.points;
        let (model, to_mm) = (config.lidar, |metres: f32| (1000.0 * metres) as u16);
        let nearest_mm = to_mm(points.min_range).max(model.min_range_mm);
        let farthest_mm = to_mm(points.max_range).min(model.max_range_mm);
        let at = points.mount.robot_from_lidar;
        let aside_mm = to_mm(math::sqrt(at.x * at.x + at.y * at.y));
        Self {
            mount: points.mount,
            nearest_mm,
            farthest_mm,
            // ArduPilot drops 0.
            min_cm: (nearest_mm / 10).max(1),
            // What lies farther than this from the robot may be out of the lidar's sight on its other side.
            max_cm: farthest_mm.saturating_sub(aside_mm) / 10,
        }
    }
}

/// The pose since the start, and the robot's velocity.
#[must_use]
pub fn odometry(told: &Told, time_usec: u64) -> ODOMETRY_DATA {
    let Told {
        pose,
        twist,
        resets,
        autopilot,
    } = told;
    let twist = twist.unwrap_or(Twist::ZERO);
    let [x, y, theta] = pose.pose;
    let [xx, xy, yy, xt, yt, tt] = pose.covariance;
    let (sin, cos) = math::sin_cos(-0.5 * theta);
    let (metres, radians) = autopilot.not_known();
    // Rows of the upper triangle over x, y, z, roll, pitch, yaw.
    let known = [(0, xx), (1, -xy), (5, -xt), (6, yy), (10, yt), (20, tt)];
    let unknown = [(11, metres), (15, radians), (18, radians)];
    let mut covariance = [0.0; 21];
    for (at, value) in known.into_iter().chain(unknown) {
        if let Some(slot) = covariance.get_mut(at) {
            *slot = value;
        }
    }
    ODOMETRY_DATA {
        time_usec,
        x,
        y: -y,
        z: 0.0,
        q: [cos, 0.0, 0.0, sin],
        vx: twist.vx,
        vy: -twist.vy,
        vz: 0.0,
        rollspeed: 0.0,
        pitchspeed: 0.0,
        yawspeed: -twist.omega,
        pose_covariance: covariance,
        velocity_covariance: velocity_covariance(metres, radians),
        frame_id: MavFrame::MAV_FRAME_LOCAL_FRD,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        reset_counter: *resets,
        estimator_type: MavEstimatorType::MAV_ESTIMATOR_TYPE_LIDAR,
        quality: quality(pose),
    }
}

/// Of a velocity that is the difference of two matches of about 1 cm and 0.2° in 0.1 s: 0.15 m/s and 0.05 rad/s along the axes that
/// are measured.
fn velocity_covariance(metres: f32, radians: f32) -> [f32; 21] {
    let mut covariance = [0.0; 21];
    for (at, value) in [
        (0, 0.0225),
        (6, 0.0225),
        (11, metres),
        (15, radians),
        (18, radians),
        (20, 0.0025),
    ] {
        if let Some(slot) = covariance.get_mut(at) {
            *slot = value;
        }
    }
    covariance
}

/// Share of the beams that agree (%), at least 1; -1 where the pose is only predicted.
fn quality(pose: &Pose) -> i8 {
    match pose.verdict {
        Verdict::Measured | Verdict::Keyframe => {
            let share = 100 * u32::from(pose.inliers);
            let share = share.checked_div(pose.beams.into()).unwrap_or(0);
            share.clamp(1, 100) as i8
        }
        _ => -1,
    }
}

/// What a beam says of its direction.
enum Seen {
    /// Something, so far from the lidar (mm).
    Something(u16),
    /// Nothing up to the farthest range.
    Nothing,
    /// Nobody knows: covered, filtered, doubtful, or just no answer.
    Unknown,
}

/// The nearest thing in each of 72 directions from the robot's centre, clockwise from forward.
///
/// A sector is free only where each of its beams has said that nothing is there; one that did not answer makes it unknown. What is too
/// near to be measured is at the nearest distance that the message can tell.
#[must_use]
pub fn obstacles<const N: usize>(
    scan: &Scan<N>,
    limits: &Limits,
    time_usec: u64,
) -> OBSTACLE_DISTANCE_DATA {
    let mut nearest = [UNKNOWN_CM; SECTORS];
    // Bit 0: a beam looked and saw nothing. Bit 1: a beam gave no answer.
    let mut looked = [0u8; SECTORS];
    for beam in scan.beams() {
        let seen = match beam.range.mm() {
            Ok(mm) if mm < limits.nearest_mm => Seen::Something(limits.nearest_mm),
            Ok(mm) if mm <= limits.farthest_mm => Seen::Something(mm),
            Ok(_) | Err(NoReturn::TooFar) => Seen::Nothing,
            Err(NoReturn::TooNear) => Seen::Something(limits.nearest_mm),
            Err(_) => Seen::Unknown,
        };
        let mm = match seen {
            Seen::Something(mm) => mm,
            Seen::Nothing | Seen::Unknown => limits.farthest_mm,
        };
        let (sector, cm) = from_robot(limits, beam.bearing, mm);
        let (Some(nearest), Some(looked)) = (nearest.get_mut(sector), looked.get_mut(sector))
        else {
            continue;
        };
        match seen {
            Seen::Something(_) if cm > limits.max_cm => *looked |= 1,
            Seen::Something(_) => *nearest = (*nearest).min(cm.max(limits.min_cm)),
            Seen::Nothing => *looked |= 1,
            Seen::Unknown => *looked |= 2,
        }
    }
    for (nearest, looked) in nearest.iter_mut().zip(looked) {
        if *nearest == UNKNOWN_CM && looked == 1 {
            *nearest = limits.max_cm + 1;
        }
    }
    OBSTACLE_DISTANCE_DATA {
        time_usec,
        distances: nearest,
        min_distance: limits.min_cm,
        max_distance: limits.max_cm,
        sensor_type: MavDistanceSensor::MAV_DISTANCE_SENSOR_LASER,
        increment: 5,
        increment_f: 5.0,
        angle_offset: 0.0,
        frame: MavFrame::MAV_FRAME_BODY_FRD,
    }
}

/// The sector and the distance (cm) from the robot's centre of what the lidar sees in a direction, so far away (mm).
fn from_robot(limits: &Limits, bearing: Bearing, mm: u16) -> (usize, u16) {
    let bearing = match limits.mount.upside_down {
        true => Bearing(bearing.0.wrapping_neg()),
        false => bearing,
    };
    let direction = Placed::new(0.0, 0.0, bearing.radians());
    let at = limits.mount.robot_from_lidar * (direction * Point::new(1e-3 * f32::from(mm), 0.0));
    let Bearing(counter_clockwise) = Bearing::from_radians(math::atan2(at.y, at.x));
    let clockwise = u32::from(counter_clockwise.wrapping_neg());
    // The first sector is around 0.
    let sector = (clockwise * SECTORS as u32 + 32_768) >> 16;
    let cm = 100.0 * math::sqrt(at.x * at.x + at.y * at.y);
    (sector as usize % SECTORS, cm as u16)
}
