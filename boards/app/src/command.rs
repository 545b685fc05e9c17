//! What the firmware listens to besides the lidar.

use beamfix::scan::{Beam, Bearing, Range};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most beams of one [`Command::Beams`].
pub const BEAMS: usize = 12;
/// Most bytes of one [`Command::Lidar`].
pub const LIDAR: usize = 128;

/// A message to the board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Command<'a> {
    /// The robot's pose by its wheels, in a frame of their own; counts for the revolution that ends next.
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
        /// In the order of measurement.
        beams: Vec<WireBeam, BEAMS>,
    },
    /// Asks for [`Health`](crate::telemetry::Health).
    Health,
}

/// A beam as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct WireBeam {
    bearing: u16,
    /// 0 stands for no return, whatever the reason.
    mm: u16,
    time_us: u32,
    quality: u8,
}

impl From<Beam> for WireBeam {
    fn from(beam: Beam) -> Self {
        Self {
            bearing: beam.bearing.0,
            mm: beam.range.mm().unwrap_or(0),
            time_us: beam.time_us,
            quality: beam.quality,
        }
    }
}

impl From<WireBeam> for Beam {
    fn from(beam: WireBeam) -> Self {
        Self {
            bearing: Bearing(beam.bearing),
            range: Range::from_mm(u32::from(beam.mm)),
            time_us: beam.time_us,
            quality: beam.quality,
        }
    }
}
