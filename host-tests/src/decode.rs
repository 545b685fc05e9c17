//! Raw bytes of any supported sensor to rows of measurements.

use std::fmt;

use beamfix::lidar::{Counters, Packet, Protocol, Sample, ld06};
use beamfix::scan::Beam;

/// Sensors that [`decode`] knows, by the names that the tool takes.
pub const NAMES: &[&str] = &["ld06"];

/// One measurement of a decoded stream: as the sensor itself gives it, and as the library's beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Turns begun before it.
    pub scan: u32,
    /// When it was measured (µs, the sensor's clock where it has one).
    pub time_us: u32,
    /// In the sensor's own sense (degrees).
    pub angle_deg: f32,
    /// Distance (mm), if there is one.
    pub range_mm: Option<f32>,
    /// Strength of the return in the sensor's own unit.
    pub quality: u16,
    /// The same for matching.
    pub beam: Beam,
    /// Whether it is the first of a turn.
    pub turn_starts: bool,
}

/// What a whole stream held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Summary {
    /// Frames that passed every check.
    pub packets: u32,
    /// Complete frames that failed their check code.
    pub check_errors: u32,
    /// Bytes that belong to no accepted frame.
    pub skipped_bytes: u32,
    /// Bytes at the end that may begin a frame.
    pub tail_bytes: u32,
    /// Turns begun.
    pub scans: u32,
    /// Measurements, with or without a range.
    pub points: u32,
}

/// There is no sensor of this name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownLidar(pub String);

impl fmt::Display for UnknownLidar {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self(name) = self;
        write!(f, "unknown lidar '{name}'; known: {}", NAMES.join(" "))
    }
}

impl std::error::Error for UnknownLidar {}

/// Decodes `bytes` of the sensor called `name`; each measurement goes to `sink` in order.
pub fn decode(
    name: &str,
    bytes: &[u8],
    sink: &mut dyn FnMut(Row),
) -> Result<Summary, UnknownLidar> {
    match name {
        "ld06" => Ok(run(ld06::Parser::new(), bytes, sink)),
        _ => Err(UnknownLidar(name.into())),
    }
}

/// Drives one parser over the stream.
fn run<P: Protocol>(mut parser: P, bytes: &[u8], sink: &mut dyn FnMut(Row)) -> Summary {
    let mut summary = Summary::default();
    let mut take = |packet: P::Packet| {
        for (k, (sample, beam)) in packet.samples().zip(packet.beams()).enumerate() {
            let turn_starts = packet.turn_start() == Some(k);
            summary.scans += u32::from(turn_starts);
            summary.points += 1;
            let Sample {
                angle_deg,
                range_mm,
                quality,
            } = sample;
            sink(Row {
                scan: summary.scans,
                time_us: beam.time_us,
                angle_deg,
                range_mm,
                quality,
                beam,
                turn_starts,
            });
        }
    };
    for &byte in bytes {
        if let Some(packet) = parser.push(byte) {
            take(packet);
        }
    }
    while let Some(packet) = parser.pull() {
        take(packet);
    }
    let Counters {
        packets,
        check_errors,
        skipped_bytes,
        ..
    } = parser.counters();
    Summary {
        packets,
        check_errors,
        skipped_bytes,
        tail_bytes: parser.pending_bytes() as u32,
        ..summary
    }
}
