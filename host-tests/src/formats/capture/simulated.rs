//! A simulated drive as a capture: what came over the lidar's line, and the wheels at the end of each revolution.

use anyhow::Result;
use beamfix::lidar::Model;
use beamfix::scan::{Beam, Mount};
use beamfix_sim::lidar::Ranging;
use beamfix_sim::ring::Ring;
use beamfix_sim::{Drive, Moment, Settings, TruePose};

use super::log::{self, Revolution};
use super::{Content, Recorder};
use crate::decode::Summary;
use crate::formats::{Log, Recorded};

/// The default drive with a lidar that ranges as `model` does.
pub fn settings(model: &Model) -> Settings {
    Settings {
        ranging: Ranging {
            nearest: f64::from(model.min_range_mm) * 1e-3,
            farthest: f64::from(model.max_range_mm) * 1e-3,
            ..Ranging::DEFAULT
        },
        ..Settings::DEFAULT
    }
}

/// Pieces before the first bytes.
const HEAD: usize = 2;

/// A capture of a drive with a lidar of `model` at `mount`, its revolutions, and what its decoder counted.
///
/// The wheels come in together with the bytes that complete a revolution, or at a rate of their own where the place says so;
/// a gyroscope where there is one.
pub fn capture(
    drive: &Drive,
    mount: TruePose,
    model: &Model,
) -> Result<(Vec<u8>, Vec<Revolution>, Summary)> {
    let write = |revolutions: &[Revolution]| -> Result<Vec<u8>> {
        let mut revolutions = revolutions.iter().peekable();
        let mut recorder = Recorder::new(Vec::new())?;
        recorder.push(0, Content::Lidar(model.name))?;
        let mount = Mount {
            robot_from_lidar: mount.into(),
            ..Mount::DEFAULT
        };
        recorder.push(0, Content::Mount(mount))?;
        let mut start = 0;
        let mut beside = beside(drive).into_iter().peekable();
        for (frame, &(end, measured_us)) in drive.frames.iter().enumerate() {
            let on_line_us = (end - start) as f64 * 1e7 / f64::from(model.baud);
            let time_us = (measured_us + on_line_us) as u64;
            while let Some((us, content)) = beside.next_if(|(us, _)| *us <= time_us) {
                recorder.push(us, content)?;
            }
            while let Some(revolution) =
                revolutions.next_if(|revolution| revolution.piece <= frame + HEAD)
            {
                if drive.nature.wheels_per_s.is_none()
                    && let Some(now) = moment(drive, revolution)
                {
                    recorder.push(time_us, Content::Wheels(now.wheels.into()))?;
                }
            }
            recorder.push(time_us, Content::Bytes(&drive.bytes[start..end]))?;
            start = end;
        }
        Ok(recorder.finish()?)
    };
    let (revolutions, summary) = log::revolutions(model.name, &write(&[])?)?;
    Ok((write(&revolutions)?, revolutions, summary))
}

/// What comes in at a rate of its own: wheels and gyroscope, with their times (µs).
fn beside(drive: &Drive) -> Vec<(u64, Content<'static>)> {
    let us = |seconds: f64| (seconds * 1e6) as u64;
    let mut all: Vec<(u64, Content<'static>)> = drive
        .gyro
        .iter()
        .map(|&(seconds, rate)| (us(seconds), Content::Gyro(rate as f32)))
        .collect();
    if let Some(rate) = drive.nature.wheels_per_s {
        let mut next = 0.0;
        for moment in &drive.moments {
            if moment.time >= next {
                all.push((us(moment.time), Content::Wheels(moment.wheels.into())));
                next += 1.0 / rate;
            }
        }
    }
    all.sort_by_key(|(us, _)| *us);
    all
}

/// The log of a drive with a ring of rangers at `mount`, which has no bytes: its scans, and the wheels at each.
#[must_use]
pub fn ring(drive: &Drive, ring: &Ring, mount: TruePose) -> Log {
    let scan = |(looks, beams): &(usize, Vec<Beam>)| {
        let now = drive.moments[looks - 1];
        Recorded {
            stamp: format!("{:.6}", now.time),
            wheels: Some(now.wheels.into()),
            beams: beams.clone(),
        }
    };
    Log {
        scans: ring.scans.iter().map(scan).collect(),
        mount: Mount {
            robot_from_lidar: mount.into(),
            ..Mount::DEFAULT
        },
        ..Log::default()
    }
}

/// The robot at a revolution's last beam.
#[must_use]
pub fn moment(drive: &Drive, revolution: &Revolution) -> Option<Moment> {
    drive
        .moments
        .get(revolution.ends_at.checked_sub(1)?)
        .copied()
}
