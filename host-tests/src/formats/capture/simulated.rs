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

/// A capture of a drive with a lidar of `model` at `mount`, its revolutions, and what its decoder counted.
///
/// The wheels come in together with the bytes that complete a revolution, or at a rate of their own where the place says so;
/// a gyroscope where there is one.
pub fn capture(
    drive: &Drive,
    mount: TruePose,
    model: &Model,
) -> Result<(Vec<u8>, Vec<Revolution>, Summary)> {
    // The lidar's bytes alone, to see with which frame a revolution is complete.
    let (bytes, piece_of) = write(drive, mount, model, None)?;
    let (mut revolutions, summary) = log::revolutions(model.name, &bytes)?;
    let first = piece_of.first().copied().unwrap_or(0);
    let frames: Vec<usize> = revolutions.iter().map(|r| r.piece - first).collect();
    let wheels: Vec<_> = frames
        .iter()
        .zip(&revolutions)
        .filter_map(|(&frame, revolution)| Some((frame, moment(drive, revolution)?.wheels)))
        .collect();
    let (bytes, piece_of) = write(drive, mount, model, Some(&wheels))?;
    for (revolution, frame) in revolutions.iter_mut().zip(frames) {
        revolution.piece = piece_of[frame];
    }
    log::add_wheels(&mut revolutions, &bytes);
    Ok((bytes, revolutions, summary))
}

/// A drive's lidar as pieces, and what comes in beside it: the wheels with these frames, or at a rate of their own, and a
/// gyroscope. Gives the number of each frame's piece too.
fn write(
    drive: &Drive,
    mount: TruePose,
    model: &Model,
    wheels: Option<&[(usize, TruePose)]>,
) -> Result<(Vec<u8>, Vec<usize>)> {
    let mut recorder = Recorder::new(Vec::new())?;
    recorder.push(0, Content::Lidar(model.name))?;
    let mount = Mount {
        robot_from_lidar: mount.into(),
        ..Mount::DEFAULT
    };
    recorder.push(0, Content::Mount(mount))?;
    let (mut start, mut pieces) = (0, 2);
    let mut piece_of = Vec::with_capacity(drive.frames.len());
    let with_frames = wheels.filter(|_| drive.nature.wheels_per_s.is_none());
    let mut with_frames = with_frames.unwrap_or_default().iter().peekable();
    let beside = wheels.map_or_else(Vec::new, |_| beside(drive));
    let mut beside = beside.into_iter().peekable();
    for (frame, &(end, measured_us)) in drive.frames.iter().enumerate() {
        let on_line_us = (end - start) as f64 * 1e7 / f64::from(model.baud);
        let time_us = (measured_us + on_line_us) as u64;
        while let Some((us, content)) = beside.next_if(|(us, _)| *us <= time_us) {
            recorder.push(us, content)?;
            pieces += 1;
        }
        while let Some((_, pose)) = with_frames.next_if(|(with, _)| *with <= frame) {
            recorder.push(time_us, Content::Wheels((*pose).into()))?;
            pieces += 1;
        }
        recorder.push(time_us, Content::Bytes(&drive.bytes[start..end]))?;
        piece_of.push(pieces);
        pieces += 1;
        start = end;
    }
    Ok((recorder.finish()?, piece_of))
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

#[cfg(test)]
mod tests {
    use super::*;
    use beamfix_sim::encoder::ld06::Sensor;
    use beamfix_sim::{Place, drive_in};

    /// A gyroscope that tells a hundred times a second delays nothing.
    #[test]
    fn the_wheels_come_with_the_revolution_that_they_belong_to() {
        let empty = "rectangle 8 6\nstart -2 -2 0\nway 2 -2 2 2 -2 2";
        for rest in ["", "\ngyro 1 0.5"] {
            let place = Place::parse(&format!("{empty}{rest}"), &mut |_| Err("no map".into()));
            let settings = Settings {
                seconds: 20.0,
                ..Settings::DEFAULT
            };
            let drive = drive_in(place.expect("a place"), &settings, &mut Sensor::ld06());
            let (bytes, revolutions, _) =
                capture(&drive, settings.mount, &Model::LDROBOT_LD06).expect("memory");
            assert!(revolutions.len() > 150, "{}", revolutions.len());
            let (again, _) = log::revolutions("ld06", &bytes).expect("an LD06");
            for (revolution, again) in revolutions.iter().zip(&again) {
                let wheels = moment(&drive, revolution).map(|now| now.wheels.into());
                assert_eq!(revolution.wheels, wheels);
                assert_eq!((again.wheels, again.piece), (wheels, revolution.piece));
            }
        }
    }
}
