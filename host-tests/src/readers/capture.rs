//! Raw serial captures: the bytes as they came out of the sensor.

use std::path::Path;

use anyhow::{Result, ensure};
use beamfix::scan::Beam;

use super::{Log, Recorded, bytes};
use crate::decode::{self, Summary};

/// One whole turn of a stream.
#[derive(Debug, Clone)]
pub struct Turn {
    /// Its beams in order.
    pub beams: Vec<Beam>,
    /// Beams of the stream up to and with its last one.
    pub ends_at: usize,
}

/// Decodes a stream of the sensor called `lidar` into whole turns; the parts of a turn at either end are left out.
pub fn turns(lidar: &str, stream: &[u8]) -> Result<(Vec<Turn>, Summary)> {
    let mut turns = Vec::new();
    let mut present: Option<Vec<Beam>> = None;
    let mut count = 0;
    let summary = decode::decode(lidar, stream, &mut |row| {
        if row.turn_starts {
            if let Some(beams) = present.take().filter(|beams| !beams.is_empty()) {
                turns.push(Turn {
                    beams,
                    ends_at: count,
                });
            }
            present = Some(Vec::new());
        }
        if let Some(beams) = &mut present {
            beams.push(row.beam);
        }
        count += 1;
    })?;
    Ok((turns, summary))
}

/// Reads a capture as a log; the stamps are the sensor's clock at each turn's last beam.
pub fn read(path: &Path, lidar: &str) -> Result<Log> {
    let content = bytes::load(path)?;
    let name = path.display();
    let (turns, summary) = turns(lidar, &content.bytes)?;
    ensure!(
        summary.packets > 0,
        "{name}: no packet of an {lidar} in {} bytes; {} failed their check",
        content.bytes.len(),
        summary.check_errors
    );
    ensure!(
        !turns.is_empty(),
        "{name}: no whole turn in {} packets, {} beams",
        summary.packets,
        summary.points
    );
    let mut log = Log {
        cut: content.cut,
        ..Log::default()
    };
    if summary.check_errors > 0 {
        log.skipped = summary.check_errors as usize;
        log.first_skipped = Some(format!(
            "frames that failed their check, {} bytes skipped",
            summary.skipped_bytes
        ));
    }
    log.scans = turns
        .into_iter()
        .map(|turn| {
            let us = turn.beams.last().map_or(0, |beam| beam.time_us);
            Recorded {
                stamp: format!("{}.{:06}", us / 1_000_000, us % 1_000_000),
                wheels: None,
                beams: turn.beams,
            }
        })
        .collect();
    Ok(log)
}
