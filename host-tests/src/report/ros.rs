//! ROS 2's messages as bags and the bridge (`host-tests/bridge`) write them: frames, stamps, poses and covariances.

pub mod message;

use anyhow::{Result, anyhow};
use beamfix::geometry::Pose;
use beamfix::grid::occupancy::{self, Cell};
use beamfix::scan::Mount;
use serde::Serialize;

use self::message::{Covariance, Header, OccupancyGrid, Placed, Time, Transform};
use crate::formats::ros_map::Map;

/// Frame of a map, as REP 105 names it.
pub const MAP: &str = "map";
/// Frame in which the robot moves without jumps.
pub const ODOM: &str = "odom";
/// Frame of the robot.
pub const ROBOT: &str = "base_link";
/// Frame of the lidar.
pub const LIDAR: &str = "laser";

/// A message in little-endian CDR, without the four bytes that say so.
pub fn cdr(message: &impl Serialize) -> Result<Vec<u8>> {
    cdr_encoding::to_vec::<_, byteorder::LittleEndian>(message).map_err(|error| anyhow!("{error}"))
}

/// What is known to be free or occupied, in the frame `map`.
#[must_use]
pub fn occupied(map: &Map, stamp: Time) -> OccupancyGrid<'static> {
    let shape = map.shape();
    let value = |&byte: &u8| match occupancy::cell(byte) {
        Cell::Free => 0,
        Cell::Occupied => 100,
        Cell::Unknown => -1,
    };
    OccupancyGrid {
        header: header(stamp, MAP),
        map_load_time: stamp,
        resolution: shape.resolution(),
        width: u32::from(shape.width()),
        height: u32::from(shape.height()),
        origin: placed(shape.origin()),
        data: map.cells().iter().map(value).collect(),
    }
}

/// A time since the epoch (µs).
#[must_use]
pub fn stamp(us: u64) -> Time {
    Time {
        sec: (us / 1_000_000) as i32,
        nanosec: (us % 1_000_000) as u32 * 1000,
    }
}

/// Stamp and frame.
#[must_use]
pub fn header(stamp: Time, frame_id: &str) -> Header<'_> {
    Header { stamp, frame_id }
}

/// A pose on the floor.
#[must_use]
pub fn placed(pose: Pose) -> Placed {
    let half = 0.5 * f64::from(pose.theta);
    Placed {
        position: [f64::from(pose.x), f64::from(pose.y), 0.0],
        orientation: [0.0, 0.0, libm::sin(half), libm::cos(half)],
    }
}

/// The lidar on the robot: turned about z, then over, where it hangs head down.
#[must_use]
pub fn mounted(mount: Mount) -> Placed {
    let Placed {
        position,
        orientation: [x, y, z, w],
    } = placed(mount.robot_from_lidar);
    let orientation = if mount.upside_down {
        [w, z, 0.0, 0.0]
    } else {
        [x, y, z, w]
    };
    Placed {
        position,
        orientation,
    }
}

/// Where `child` stands in `parent`.
#[must_use]
pub fn transform<'a>(stamp: Time, [parent, child]: [&'a str; 2], place: Placed) -> Transform<'a> {
    Transform {
        header: header(stamp, parent),
        child_frame_id: child,
        transform: place,
    }
}

/// Variance of what nobody knows (m², rad²), as ROS's own drivers state it: a filter takes all zeros for exact.
pub const NOT_KNOWN: f64 = 1e6;

/// Of a pose on a floor, given as xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²); its height and tilt are [`NOT_KNOWN`].
#[must_use]
pub fn six_by_six(planar: [f32; 6]) -> Covariance {
    let [xx, xy, yy, xt, yt, tt] = planar.map(f64::from);
    let mut six = not_known();
    for (row, column, value) in [
        (0, 0, xx),
        (0, 1, xy),
        (1, 0, xy),
        (0, 5, xt),
        (5, 0, xt),
        (1, 1, yy),
        (1, 5, yt),
        (5, 1, yt),
        (5, 5, tt),
    ] {
        six[row][column] = value;
    }
    six
}

/// Nothing is known.
#[must_use]
pub fn not_known() -> Covariance {
    let mut six = Covariance::default();
    for (k, row) in six.iter_mut().enumerate() {
        row[k] = NOT_KNOWN;
    }
    six
}
