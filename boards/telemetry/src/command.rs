//! What the firmware listens to besides the lidar.

use beamfix::scan::{Beam, Bearing, Range};
use serde::{Deserialize, Serialize};

/// Most beams of one [`Command::Beams`].
pub const BEAMS: usize = 10;
/// Most bytes of one [`Command::Lidar`].
pub const LIDAR: usize = 94;

/// A message to the board. What is long stays where it was received: there is no room for it on a small stack.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Command<'a> {
    /// The robot's pose by its wheels, in a frame of their own, when the message comes in. Any rate from two a second on
    /// will do.
    Wheels {
        /// Forward (m).
        x: f32,
        /// Left (m).
        y: f32,
        /// Heading (rad).
        theta: f32,
    },
    /// Bytes of the lidar, for a board with a single UART or a recording: as if they had come from it.
    Lidar(&'a [u8]),
    /// Beams of any other sensor, e.g. of a recorded log.
    Beams {
        /// Whether the first of them is the first of a revolution, which completes the one before.
        turn_starts: bool,
        /// In the order of measurement, each as [`beam_bytes`].
        beams: &'a [u8],
    },
    /// Asks for [`Health`](crate::telemetry::Health).
    Health,
    /// Switches what is sent besides poses and health.
    Send {
        /// The lidar's bytes, wheels and gyroscope with their times.
        raw: bool,
        /// Every beam.
        scans: bool,
        /// How good each match was.
        quality: bool,
    },
    /// The robot's rate of turn by a gyroscope when the message comes in: 20 times a second or more.
    Gyro {
        /// Counter-clockwise (rad/s).
        rate: f32,
    },
    /// Where the robot is in the map, for a board that localizes; others leave it out.
    StartAt {
        /// Forward in the map (m).
        x: f32,
        /// Left (m).
        y: f32,
        /// Heading (rad).
        theta: f32,
    },
    /// Asks for [`Ready`](crate::telemetry::Ready), for who comes after the board's start.
    Ready,
    /// Which lidar hangs on the board, for one that has a choice: it begins anew with it, and says so by
    /// [`Ready`](crate::telemetry::Ready). Others leave it out.
    Choose {
        /// A name of the table of models.
        lidar: &'a str,
    },
}

/// A beam as it is sent: `u16` bearing, `u16` range (mm, 0 for none), `u32` time (µs), `u8` quality, little endian.
#[must_use]
pub fn beam_bytes(beam: &Beam) -> [u8; 9] {
    let [b0, b1] = beam.bearing.0.to_le_bytes();
    let [r0, r1] = beam.range.mm().unwrap_or(0).to_le_bytes();
    let [t0, t1, t2, t3] = beam.time_us.to_le_bytes();
    [b0, b1, r0, r1, t0, t1, t2, t3, beam.quality]
}

/// The beams of a [`Command::Beams`]; an incomplete one at the end is left out.
pub fn beams(bytes: &[u8]) -> impl Iterator<Item = Beam> + '_ {
    bytes.chunks_exact(9).filter_map(|beam| {
        let &[b0, b1, r0, r1, t0, t1, t2, t3, quality] = beam else {
            return None;
        };
        Some(Beam {
            bearing: Bearing(u16::from_le_bytes([b0, b1])),
            range: Range::from_mm(u16::from_le_bytes([r0, r1]).into()),
            time_us: u32::from_le_bytes([t0, t1, t2, t3]),
            quality,
        })
    })
}
