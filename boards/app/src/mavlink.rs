//! Poses and obstacles as MAVLink 2, for an autopilot: `ODOMETRY` and `OBSTACLE_DISTANCE`, a `HEARTBEAT` now and then.
//!
//! MAVLink's axes are forward, right, down; ours forward, left, up.

use beamfix::{
    geometry::Twist,
    math,
    scan::{Bearing, Scan},
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

use crate::telemetry::{Pose, Telemetry, Verdict};

/// Directions of `OBSTACLE_DISTANCE`, 5° each.
pub const SECTORS: usize = 72;
/// What an LD06 sees (cm).
const NEAREST_CM: u16 = 2;
const FARTHEST_CM: u16 = 1200;

/// Appends a `HEARTBEAT` for the messages that come at the start and now and then.
#[inline(never)]
pub fn append_heartbeat<const B: usize>(message: &Telemetry, out: &mut Vec<u8, B>) {
    if let Telemetry::Ready(_) | Telemetry::Health(_) = message {
        let heartbeat = HEARTBEAT_DATA {
            custom_mode: 0,
            mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
            autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
            base_mode: MavModeFlag::empty(),
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
        };
        send(0, &heartbeat, out);
    }
}

/// Appends both messages, each only where there is room for all of it.
#[inline(never)]
pub fn append<const N: usize, const B: usize>(
    pose: &Pose,
    twist: Twist,
    scan: &Scan<N>,
    now_us: u32,
    out: &mut Vec<u8, B>,
) {
    let sequence = (pose.sequence as u8).wrapping_mul(2);
    send(sequence, &odometry(pose, twist, now_us), out);
    send(sequence.wrapping_add(1), &obstacles(scan, now_us), out);
}

/// The crate's writing panics where a buffer is full. It never is: the buffer has room for the longest message there is,
/// 255 bytes, but only the loops' lengths say that ours are shorter, which a linker does not see.
#[cfg(not(feature = "prove-no-panic"))]
#[inline(never)]
fn send<const B: usize>(sequence: u8, message: &impl MessageData, out: &mut Vec<u8, B>) {
    // Who sends: the autopilot's own system, component `MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY`.
    let header = MavHeader {
        system_id: 1,
        component_id: 197,
        sequence,
    };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message_data(header, message);
    let _ = out.extend_from_slice(raw.raw_bytes());
}

/// In the crate's place: every field is used, so what computes it is in the proof.
#[cfg(feature = "prove-no-panic")]
#[inline(never)]
fn send<const B: usize>(sequence: u8, message: &impl MessageData, out: &mut Vec<u8, B>) {
    let _ = out.push(core::hint::black_box(sequence));
    let _ = core::hint::black_box(message);
}

/// The pose since the start, and the robot's velocity.
#[must_use]
pub fn odometry(pose: &Pose, twist: Twist, now_us: u32) -> ODOMETRY_DATA {
    let [x, y, theta] = pose.pose;
    let [xx, xy, yy, xt, yt, tt] = pose.covariance;
    let (sin, cos) = math::sin_cos(-0.5 * theta);
    // Rows of the upper triangle over x, y, z, roll, pitch, yaw.
    let mut covariance = [0.0; 21];
    for (at, value) in [(0, xx), (1, -xy), (5, -xt), (6, yy), (10, yt), (20, tt)] {
        if let Some(slot) = covariance.get_mut(at) {
            *slot = value;
        }
    }
    let mut velocity_covariance = [0.0; 21];
    // NaN in the first: nobody knows.
    if let Some(first) = velocity_covariance.first_mut() {
        *first = f32::NAN;
    }
    ODOMETRY_DATA {
        time_usec: now_us.into(),
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
        velocity_covariance,
        frame_id: MavFrame::MAV_FRAME_LOCAL_FRD,
        child_frame_id: MavFrame::MAV_FRAME_BODY_FRD,
        reset_counter: 0,
        estimator_type: MavEstimatorType::MAV_ESTIMATOR_TYPE_LIDAR,
        quality: quality(pose),
    }
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

/// The nearest range in each of 72 directions, clockwise from forward.
#[must_use]
pub fn obstacles<const N: usize>(scan: &Scan<N>, now_us: u32) -> OBSTACLE_DISTANCE_DATA {
    // Nobody knows; or, one more than the largest: nothing there.
    let mut distances = [u16::MAX; SECTORS];
    for beam in scan.beams() {
        let Bearing(counter_clockwise) = beam.bearing;
        let clockwise = u32::from(counter_clockwise.wrapping_neg());
        // The first sector is around 0.
        let sector = (clockwise * SECTORS as u32 + 32_768) >> 16;
        let cm = beam.range.mm().map_or(FARTHEST_CM + 1, |mm| mm / 10);
        if let Some(slot) = distances.get_mut(sector as usize % SECTORS) {
            *slot = (*slot).min(cm);
        }
    }
    OBSTACLE_DISTANCE_DATA {
        time_usec: now_us.into(),
        distances,
        min_distance: NEAREST_CM,
        max_distance: FARTHEST_CM,
        sensor_type: MavDistanceSensor::MAV_DISTANCE_SENSOR_LASER,
        increment: 5,
        increment_f: 5.0,
        angle_offset: 0.0,
        frame: MavFrame::MAV_FRAME_BODY_FRD,
    }
}
