//! Raw bytes of any supported sensor to rows of measurements.

use std::fmt;

use anyhow::{Context, Result, bail};
pub use beamfix::lidar::choice::{WithParser, with_parser};
use beamfix::lidar::{Counters, Family, Model, Packet, Protocol, identify};
use beamfix::scan::Beam;

use crate::formats::capture::{self, Content};
use crate::formats::unknown;

/// Names that [`decode`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    Model::ALL.iter().map(|model| model.name)
}

/// One measurement of a decoded stream: as the sensor itself gives it, and as the library's beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Revolutions begun before it.
    pub scan: u32,
    /// When it was measured (µs, the sensor's clock where it has one): of a capture of any length.
    pub time_us: u64,
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
pub fn model(name: &str, bytes: &[u8]) -> std::result::Result<&'static Model, DecodeError> {
    let name = match name {
        "auto" => named_by(bytes).unwrap_or(name),
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

/// The lidar that a capture names, where it is in the table: a firmware may have a row of its own, whose frames tell more.
fn named_by(bytes: &[u8]) -> Option<&str> {
    capture::lidar(bytes).filter(|name| Model::named(name).is_some())
}

/// As [`model`], for the bytes of the file called `file`: where `auto` finds no lidar's frames, the error says what the file
/// is instead, as far as its look tells.
pub fn model_of(file: &str, name: &str, bytes: &[u8]) -> Result<&'static Model> {
    // Frames in an archive that stores them as they are would be found, and cut by what lies between.
    if name == "auto"
        && let Some(what) = unknown::other_than_bytes(file, bytes)
    {
        bail!("{file}: auto: {what}");
    }
    let found = model(name, bytes);
    if let Err(DecodeError::NothingFits(_)) = found
        && let Some(what) = unknown::without_frames(file, bytes)
    {
        bail!("{file}: auto: {what}");
    }
    found.with_context(|| file.to_owned())
}

/// Names of other models that `bytes` may as well be from, where `auto` chose one by the bytes alone.
#[must_use]
pub fn alternatives(name: &str, bytes: &[u8]) -> Vec<&'static str> {
    if name != "auto" || named_by(bytes).is_some() {
        return Vec::new();
    }
    let bytes = capture::plain(bytes);
    let start = bytes.get(..100_000).unwrap_or(&bytes);
    let found = identify::identify(start);
    found.map_or_else(Vec::new, |found| {
        found.alternatives().map(|model| model.name).collect()
    })
}

/// Decodes `bytes` of the sensor called `name`, or of the one they are from for `auto`; each measurement goes to `sink`
/// in order. Where the bytes have times ([`capture`]), so have the measurements of sensors without a clock.
pub fn decode(
    name: &str,
    bytes: &[u8],
    sink: &mut dyn FnMut(Row),
) -> std::result::Result<Summary, DecodeError> {
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
        let mut clock = Unwrapped::default();
        let pieces = capture::pieces(self.bytes);
        for (k, piece) in pieces.iter().enumerate() {
            let bytes = match piece.content {
                Content::Bytes(bytes) => bytes,
                Content::Zero(zero_cdeg) => {
                    parser.set_zero(zero_cdeg);
                    continue;
                }
                _ => continue,
            };
            if let Some(time_us) = piece.time_us {
                parser.arrived(time_us as u32);
                clock.near(time_us);
            }
            for &byte in bytes {
                if let Some(packet) = parser.push(byte) {
                    summary.take(&packet, self.is_signed, k, &mut clock, self.sink);
                }
            }
        }
        while let Some(packet) = parser.pull() {
            summary.take(&packet, self.is_signed, pieces.len(), &mut clock, self.sink);
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
        clock: &mut Unwrapped,
        sink: &mut dyn FnMut(Row),
    ) {
        for (k, (sample, beam)) in packet.samples().zip(packet.beams()).enumerate() {
            let revolution_starts = packet.revolution_start() == Some(k);
            self.scans += u32::from(revolution_starts);
            self.points += 1;
            let turned = is_signed && sample.angle_deg >= 180.0;
            sink(Row {
                scan: self.scans,
                time_us: clock.at(beam.time_us),
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

/// A clock of 32 bits (µs), which wraps after 71.6 minutes, as one of 64.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwrapped {
    about_us: Option<u64>,
    last_us: Option<u64>,
}

impl Unwrapped {
    /// Says about when the first time will be, unless the clock has a zero of its own: then it is in its first round.
    pub fn near(&mut self, time_us: u64) {
        self.about_us.get_or_insert(time_us);
    }

    /// The next time, at most half a round before or after the one before it.
    pub fn at(&mut self, time_us: u32) -> u64 {
        /// A clock this far (µs) from when bytes came in is another one.
        const FAR: u32 = 60_000_000;

        let passed = |since: u64| time_us.wrapping_sub(since as u32) as i32;
        let about = self
            .about_us
            .filter(|about| passed(*about).unsigned_abs() < FAR);
        let now = match self.last_us.or(about) {
            Some(since) => since.saturating_add_signed(passed(since).into()),
            None => time_us.into(),
        };
        self.last_us = Some(now);
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrapped_clock_goes_on() {
        let mut clock = Unwrapped::default();
        let second = 1_000_000u64;
        for now in (0..20_000).map(|k| k * second) {
            assert_eq!(clock.at(now as u32), now);
            // A beam may be a little earlier than the one before.
            assert_eq!(clock.at((now + second / 2) as u32), now + second / 2);
        }
        let mut clock = Unwrapped::default();
        clock.near(9_000 * second);
        assert_eq!(clock.at((8_999 * second) as u32), 8_999 * second);
        let mut own = Unwrapped::default();
        own.near(9_000 * second);
        assert_eq!(own.at(500), 500);
    }
}
