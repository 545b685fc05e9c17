//! A simulated drive as a capture: what came over the lidar's line, and the wheels at the end of each revolution.

use anyhow::Result;
use beamfix::lidar::Model;
use beamfix_sim::{Drive, Moment, TruePose};

use super::log::{self, Turn};
use super::{Content, Recorder};
use crate::decode::Summary;

/// Pieces before the first bytes.
const HEAD: usize = 2;

/// A capture of a drive with a lidar of `model` at `mount`, its revolutions, and what its decoder counted.
///
/// The wheels come in together with the bytes that complete a revolution.
pub fn capture(
    drive: &Drive,
    mount: TruePose,
    model: &Model,
) -> Result<(Vec<u8>, Vec<Turn>, Summary)> {
    let write = |turns: &[Turn]| -> Result<Vec<u8>> {
        let mut turns = turns.iter().peekable();
        let mut recorder = Recorder::new(Vec::new())?;
        recorder.push(0, Content::Lidar(model.name))?;
        recorder.push(0, Content::Mount(mount.into()))?;
        let mut start = 0;
        for (frame, &(end, measured_us)) in drive.frames.iter().enumerate() {
            let on_line_us = (end - start) as f64 * 1e7 / f64::from(model.baud);
            let time_us = (measured_us + on_line_us) as u64;
            while let Some(turn) = turns.next_if(|turn| turn.piece <= frame + HEAD) {
                if let Some(now) = moment(drive, turn) {
                    recorder.push(time_us, Content::Wheels(now.wheels.into()))?;
                }
            }
            recorder.push(time_us, Content::Bytes(&drive.bytes[start..end]))?;
            start = end;
        }
        Ok(recorder.finish()?)
    };
    let (turns, summary) = log::turns(model.name, &write(&[])?)?;
    Ok((write(&turns)?, turns, summary))
}

/// The robot at a revolution's last beam.
#[must_use]
pub fn moment(drive: &Drive, turn: &Turn) -> Option<Moment> {
    drive.moments.get(turn.ends_at.checked_sub(1)?).copied()
}
