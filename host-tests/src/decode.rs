//! Raw bytes of any supported sensor to rows of measurements.

use std::fmt;

pub use beamfix::lidar::choice::{WithParser, with_parser};
use beamfix::lidar::{Counters, Family, Model, Packet, Protocol, identify};
use beamfix::scan::Beam;

use crate::formats::capture::{self, Content};

/// Names that [`decode`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    Model::ALL.iter().map(|model| model.name)
}

/// One measurement of a decoded stream: as the sensor itself gives it, and as the library's beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Revolutions begun before it.
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
    /// Whether it is the first of a revolution.
    pub revolution_starts: bool,
    /// Number of the recording's piece whose bytes completed it.
    pub piece: usize,
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
    /// Revolutions begun.
    pub scans: u32,
    /// Measurements, with or without a range.
    pub points: u32,
}

/// Why there is nothing to decode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DecodeError {
    /// There is no sensor of this name.
    UnknownLidar(String),
    /// `auto`, and no sensor's frames are in the bytes.
    NothingFits(Vec<String>),
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::UnknownLidar(name) => {
                let known: Vec<&str> = names().collect();
                write!(f, "unknown lidar '{name}'; known: {} auto", known.join(" "))
            }
            Self::NothingFits(hints) => write!(f, "auto: {}", hints.join("; ")),
        }
    }
}

impl std::error::Error for DecodeError {}

/// The model called `name`; for `auto`, the one that `bytes` name or are most likely from.
pub fn model(name: &str, bytes: &[u8]) -> Result<&'static Model, DecodeError> {
    let name = match name {
        "auto" => capture::lidar(bytes).unwrap_or(name),
        _ => name,
    };
    if name != "auto" {
        return Model::named(name).ok_or_else(|| DecodeError::UnknownLidar(name.into()));
    }
    // A second of the fastest line holds what there is to know.
    let bytes = capture::plain(bytes);
    let start = bytes.get(..100_000).unwrap_or(&bytes);
    match identify::identify(start) {
        Some(finding) => Ok(finding.model),
        None => {
            let hints = identify::hints(&Model::LDROBOT_LD06, start);
            Err(DecodeError::NothingFits(
                hints.map(|hint| hint.to_string()).collect(),
            ))
        }
    }
}

/// Decodes `bytes` of the sensor called `name`, or of the one they are from for `auto`; each measurement goes to `sink`
/// in order. Where the bytes have times ([`capture`]), so have the measurements of sensors without a clock.
pub fn decode(name: &str, bytes: &[u8], sink: &mut dyn FnMut(Row)) -> Result<Summary, DecodeError> {
    let model = model(name, bytes)?;
    // A scanner that does not see all around counts to both sides.
    let is_signed = matches!(model.family, Family::Scip(_));
    let decoding = Decoding {
        bytes,
        is_signed,
        sink,
    };
    Ok(with_parser(model, decoding))
}

/// One stream to decode.
struct Decoding<'a> {
    bytes: &'a [u8],
    is_signed: bool,
    sink: &'a mut dyn FnMut(Row),
}

impl WithParser for Decoding<'_> {
    type Output = Summary;

    fn run<P: Protocol>(self, mut parser: P) -> Summary {
        let mut summary = Summary::default();
        let pieces = capture::pieces(self.bytes);
        for (k, piece) in pieces.iter().enumerate() {
            let Content::Bytes(bytes) = piece.content else {
                continue;
            };
            if let Some(time_us) = piece.time_us {
                parser.arrived(time_us as u32);
            }
            for &byte in bytes {
                if let Some(packet) = parser.push(byte) {
                    summary.take(&packet, self.is_signed, k, self.sink);
                }
            }
        }
        while let Some(packet) = parser.pull() {
            summary.take(&packet, self.is_signed, pieces.len(), self.sink);
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
}

impl Summary {
    fn take(
        &mut self,
        packet: &impl Packet,
        is_signed: bool,
        piece: usize,
        sink: &mut dyn FnMut(Row),
    ) {
        for (k, (sample, beam)) in packet.samples().zip(packet.beams()).enumerate() {
            let revolution_starts = packet.revolution_start() == Some(k);
            self.scans += u32::from(revolution_starts);
            self.points += 1;
            let turned = is_signed && sample.angle_deg >= 180.0;
            sink(Row {
                scan: self.scans,
                time_us: beam.time_us,
                angle_deg: sample.angle_deg - if turned { 360.0 } else { 0.0 },
                range_mm: sample.range_mm,
                quality: sample.quality,
                beam,
                revolution_starts,
                piece,
            });
        }
    }
}
