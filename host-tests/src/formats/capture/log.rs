//! A capture as a log: bytes of a lidar, with times or without, decoded into whole revolutions.

use std::path::Path;

use anyhow::{Result, ensure};
use beamfix::geometry::Pose;
use beamfix::lidar::Model;
use beamfix::scan::{Assembler, Beam, Mount};

use super::super::{Capture, Log, Recorded, bytes, thinned};
use crate::decode::{self, Summary};
use crate::formats::capture::telemetry;
use crate::formats::capture::{self, Content};

/// Most beams of a revolution that are matched; of a finer sensor's, one for each of so many directions.
pub const MOST_BEAMS: usize = 1024;

/// One whole revolution of a stream.
#[derive(Debug, Clone)]
pub struct Revolution {
    /// Its beams in order; of more than [`MOST_BEAMS`] one for each direction.
    pub beams: Vec<Beam>,
    /// Whether it had more.
    pub is_thinned: bool,
    /// When its last beam was measured (µs), of a capture of any length.
    pub end_us: u64,
    /// Beams of the stream up to and with its last one.
    pub ends_at: usize,
    /// Number of the capture's piece whose bytes completed it.
    pub piece: usize,
    /// Where the wheels last said the robot was, if they said so during the revolution.
    pub wheels: Option<Pose>,
}

/// Room for the beams of one revolution of any lidar.
const ROOM: usize = 8192;

/// Decodes a stream of the sensor called `lidar` into whole revolutions, as a board's assembler does: the parts of a revolution at
/// either end are left out, and interrupted ones.
pub fn revolutions(lidar: &str, stream: &[u8]) -> Result<(Vec<Revolution>, Summary)> {
    let mut revolutions = Vec::new();
    let mut assembler = Box::new(Assembler::<ROOM>::new());
    // The beams since the last revolution, with their times to the microsecond.
    let mut recent: Vec<Beam> = Vec::new();
    let (mut count, mut last_us) = (0, 0);
    let summary = decode::decode(lidar, stream, &mut |row| {
        if assembler.push(row.beam, row.revolution_starts) {
            let first = recent.len().saturating_sub(assembler.scan().len());
            let beams = recent.split_off(first);
            revolutions.push(Revolution {
                is_thinned: beams.len() > MOST_BEAMS,
                beams: thinned(beams, MOST_BEAMS),
                end_us: last_us,
                ends_at: count,
                piece: row.piece,
                wheels: None,
            });
            recent.clear();
        }
        recent.push(row.beam);
        last_us = row.time_us;
        count += 1;
    })?;
    add_wheels(&mut revolutions, stream);
    Ok((revolutions, summary))
}

/// Gives each revolution the wheels' last pose before the piece that completed it.
pub(super) fn add_wheels(revolutions: &mut [Revolution], stream: &[u8]) {
    let mut wheels = capture::pieces(stream)
        .into_iter()
        .enumerate()
        .filter_map(|(k, piece)| match piece.content {
            Content::Wheels(pose) => Some((k, pose)),
            _ => None,
        })
        .peekable();
    for revolution in revolutions {
        while let Some((_, pose)) = wheels.next_if(|(k, _)| *k < revolution.piece) {
            revolution.wheels = Some(pose);
        }
    }
}

/// Reads a capture as a log; the stamps are the sensor's clock at each revolution's last beam.
pub fn read(path: &Path, lidar: &str) -> Result<Log> {
    let content = bytes::load(path)?;
    parse(&path.display().to_string(), content, lidar)
}

/// Reads a capture that was loaded already, or made.
pub fn parse(name: &str, mut content: bytes::Content, lidar: &str) -> Result<Log> {
    if let Some(capture) = telemetry::capture(&content.bytes) {
        content.bytes = capture;
    }
    let model = decode::model_of(name, lidar, &content.bytes)?;
    let decoded = revolutions(model.name, &content.bytes)?;
    of_revolutions(name, content, model, decoded)
}

/// A log of the revolutions that a capture was decoded into.
pub fn of_revolutions(
    name: &str,
    content: bytes::Content,
    model: &'static Model,
    (revolutions, summary): (Vec<Revolution>, Summary),
) -> Result<Log> {
    ensure!(
        summary.packets > 0,
        "{name}: no packet of the lidar {} in {} bytes; {} failed their check",
        model.name,
        content.bytes.len(),
        summary.check_errors
    );
    ensure!(
        !revolutions.is_empty(),
        "{name}: no whole revolution in {} packets, {} beams",
        summary.packets,
        summary.points
    );
    let mount = capture::pieces(&content.bytes)
        .into_iter()
        .find_map(|piece| match piece.content {
            Content::Mount(mount) => Some(mount),
            _ => None,
        });
    let mut log = Log {
        cut: content.cut.or_else(|| capture::cut(&content.bytes)),
        mount: mount.unwrap_or(Mount::DEFAULT),
        is_mount_told: mount.is_some(),
        source: format!("bytes of the lidar {}", model.name),
        lidar: Some(model.name.to_owned()),
        ..Log::default()
    };
    if summary.check_errors > 0 {
        log.skipped = summary.check_errors as usize;
        log.first_skipped = Some(format!(
            "frames that failed their check, {} bytes skipped",
            summary.skipped_bytes
        ));
    }
    // Finer ones are thinned first, which the pipeline does not.
    let fits = revolutions.iter().all(|revolution| !revolution.is_thinned);
    log.capture = fits.then_some(Capture {
        bytes: content.bytes,
        model,
    });
    log.scans = revolutions
        .into_iter()
        .map(|revolution| {
            let us = revolution.end_us;
            Recorded {
                stamp: format!("{}.{:06}", us / 1_000_000, us % 1_000_000),
                wheels: revolution.wheels,
                beams: revolution.beams,
            }
        })
        .collect();
    Ok(log)
}
