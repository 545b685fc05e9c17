//! CARMEN text logs: `FLASER`, `ROBOTLASER1`, `ODOM` and `PARAM` lines; other words are skipped.
//!
//! ```text
//! PARAM name value  ipc_host ipc_time
//! FLASER n r1..rn  x y theta  odom_x odom_y odom_theta  ipc_time host logger_time
//! ROBOTLASER1 type start fov resolution max_range accuracy remission n r1..rn m rem1..remm
//!             laser_x laser_y laser_theta  robot_x robot_y robot_theta  tv rv safety safety axis  ipc_time host time
//! ODOM x y theta tv rv accel  ipc_time host logger_time
//! ```

mod writer;

pub use writer::{WRITTEN, written};

use anyhow::{Context, Result, ensure};
use beamfix::scan::{Beam, Bearing, Mount};

use super::mirror::Mirror;
use super::no_return::{Limits, Rule};
use super::{Log, Recorded, clock::Clock};
use beamfix_sim::TruePose;

/// A laser line as it stands.
struct Line<'a> {
    stamp: &'a str,
    /// First bearing and step (rad).
    first: f64,
    step: f64,
    limits: Limits,
    readings: Vec<f32>,
    laser: TruePose,
    robot: TruePose,
}

/// Reads a log's laser lines.
#[must_use]
pub fn parse(text: &[u8]) -> Log {
    let mut log = Log::default();
    let mut lines = Vec::new();
    let mut wheels = None;
    let mut parameters = Parameters::default();
    for (number, line) in text.split(|&b| b == b'\n').enumerate() {
        let word_end = line
            .iter()
            .position(|b| b.is_ascii_whitespace())
            .unwrap_or(line.len());
        let parsed = match &line[..word_end] {
            b"PARAM" => {
                let words: Vec<_> = words(line).unwrap_or_default();
                parameters.take(words.get(1).copied(), words.get(2).copied());
                continue;
            }
            b"NEFF" => {
                parameters.is_corrected = true;
                continue;
            }
            b"FLASER" => words(line).and_then(|w| flaser(&w, &parameters)),
            b"ROBOTLASER1" => words(line).and_then(|w| robotlaser(&w)),
            b"ODOM" => match words(line).and_then(|w| pose(&w, 1)) {
                Ok(pose) => {
                    wheels = Some(pose);
                    continue;
                }
                Err(error) => Err(error),
            },
            _ => continue,
        };
        match parsed {
            Ok(mut line) => {
                // A laser line whose robot pose is not a number takes that of the last ODOM line.
                if !finite(line.robot) {
                    match wheels {
                        Some(pose) => line.robot = pose,
                        None => {
                            log.skip(
                                format!("line {}", number + 1),
                                "the robot's pose is not finite",
                            );
                            continue;
                        }
                    }
                }
                lines.push(line);
            }
            Err(error) => log.skip(format!("line {}", number + 1), format!("{error:#}")),
        }
    }
    let rule = Rule::of(lines.iter().map(|line| (&line.readings[..], line.limits)));
    (log.mount, log.is_mount_told) = mount(&lines, &parameters);
    log.source = match rule.plateau() {
        Some(metres) => format!("CARMEN log, no return from {metres:.2} m on"),
        None => "CARMEN log".into(),
    };
    let mut clock = Clock::new();
    for line in lines {
        let time_us = clock.at(line.stamp.parse().unwrap_or(f64::NAN));
        log.odd.count(&line.readings);
        let beams = line.beams(rule, time_us);
        log.scans.push(Recorded {
            stamp: line.stamp.to_owned(),
            wheels: Some(line.robot.into()),
            beams,
        });
    }
    log
}

impl Line<'_> {
    fn beams(&self, rule: Rule, time_us: u32) -> Vec<Beam> {
        let mirror = Mirror::of(self.readings.len(), self.step);
        let beam = |(k, &reading): (usize, &f32)| {
            let bearing = self.first + self.step * k as f64;
            Beam {
                bearing: Bearing::from_radians(bearing as f32),
                range: rule.range(reading, self.limits),
                time_us: time_us.wrapping_sub(mirror.age_us(k)),
                quality: 0,
            }
        };
        self.readings.iter().enumerate().map(beam).collect()
    }
}

/// What the `PARAM` lines say about the laser in front. A `ROBOTLASER1` line says more itself.
#[derive(Debug, Clone, Copy, Default)]
struct Parameters {
    /// Field of view (rad).
    field: Option<f64>,
    /// Step between two beams (rad).
    step: Option<f64>,
    /// Longest range (m).
    max_range: Option<f64>,
    offset: TruePose,
    is_flipped: bool,
    /// The log is a mapper's (GMapping writes a `NEFF` line after each scan): its poses are the laser's.
    is_corrected: bool,
}

impl Parameters {
    fn take(&mut self, name: Option<&str>, value: Option<&str>) {
        let (Some(name), Some(value)) = (name, value) else {
            return;
        };
        let number = value.parse().ok().filter(|value: &f64| value.is_finite());
        let positive = number.filter(|value| *value > 0.0);
        match name {
            // Radians; a full turn has 6.28 of them, so more are degrees.
            "laser_front_laser_fov" => {
                self.field = positive.map(|fov| if fov > 6.3 { fov.to_radians() } else { fov });
            }
            // Degrees; no laser has steps of less than 0.05 of them, so less are radians.
            "laser_front_laser_resolution" => {
                self.step = positive.map(|step| if step < 0.05 { step } else { step.to_radians() });
            }
            "robot_front_laser_max" => self.max_range = positive,
            "robot_frontlaser_offset" => self.offset.x = number.unwrap_or(0.0),
            "robot_frontlaser_side_offset" => self.offset.y = number.unwrap_or(0.0),
            "robot_frontlaser_angular_offset" => self.offset.theta = number.unwrap_or(0.0),
            "laser_front_laser_flipped" => self.is_flipped = number.is_some_and(|n| n != 0.0),
            _ => {}
        }
    }

    /// First bearing and step (rad) of `count` readings around straight ahead.
    ///
    /// 181 readings over 180° stand at both ends, 180 leave the last end out: the stated step tells which, else that
    /// the field of view is an even number of steps. Default: 180°.
    fn directions(&self, count: usize) -> (f64, f64) {
        let even = (count / 2 * 2) as f64;
        let field = match (self.field, self.step) {
            (Some(field), _) => field,
            (None, Some(step)) => step * even,
            (None, None) => core::f64::consts::PI,
        };
        let both = [field / (count - 1) as f64, field / count as f64];
        let off = |step: f64, stated: f64| libm::fabs(step - stated) / stated;
        let step = match self.step {
            Some(stated) if off(both[0], stated) < 0.001 => both[0],
            Some(stated) if off(both[1], stated) < 0.001 => both[1],
            _ => field / even,
        };
        (-0.5 * field, step)
    }
}

fn flaser<'a>(words: &[&'a str], parameters: &Parameters) -> Result<Line<'a>> {
    let count = count(words, 1)?;
    let readings = readings(words, 2, count)?;
    let rest = 2 + count;
    at_most(words, rest + 9)?;
    ensure!(count >= 2, "{count} readings");
    let (first, step) = parameters.directions(count);
    Ok(Line {
        stamp: stamp(words, rest + 6)?,
        first,
        step,
        limits: Limits::stated(
            0.0,
            parameters.max_range.map_or(f32::INFINITY, |m| m as f32),
        ),
        readings,
        laser: pose(words, rest)?,
        robot: pose(words, rest + 3)?,
    })
}

fn robotlaser<'a>(words: &[&'a str]) -> Result<Line<'a>> {
    let (first, step) = (number(words, 2)?, number(words, 4)?);
    ensure!(
        first.is_finite() && step.is_finite(),
        "the angles are not finite"
    );
    let max_range = number(words, 5)? as f32;
    let beams = count(words, 8)?;
    let readings = readings(words, 9, beams)?;
    let remissions = count(words, 9 + beams)?;
    let rest = 10 + beams + remissions;
    at_most(words, rest + 14)?;
    Ok(Line {
        stamp: stamp(words, rest + 11)?,
        first,
        step,
        limits: Limits::stated(0.0, max_range),
        readings,
        laser: pose(words, rest)?,
        robot: pose(words, rest + 3)?,
    })
}

/// Where the laser sits on the robot: by the lines, if they agree (corrected logs have poses of two origins there); by
/// the parameters, if no line tells the laser's pose from the robot's and no mapper wrote them.
fn mount(lines: &[Line], parameters: &Parameters) -> (Mount, bool) {
    let told = lines.first().map_or(TruePose::default(), |first| {
        let first = first.robot.between(first.laser);
        let agrees = lines.iter().all(|line| {
            let off = first.between(line.robot.between(line.laser));
            off.distance() < 0.01 && off.theta.abs() < 0.01
        });
        if agrees && first.distance() < 2.0 {
            first
        } else {
            TruePose::default()
        }
    });
    let is_told = parameters.is_corrected || lines.iter().any(|line| line.laser != line.robot);
    let place = if is_told { told } else { parameters.offset };
    let mount = Mount {
        robot_from_lidar: place.into(),
        upside_down: parameters.is_flipped,
    };
    (mount, place != TruePose::default() || parameters.is_flipped)
}

fn words(line: &[u8]) -> Result<Vec<&str>> {
    let text = std::str::from_utf8(line).context("bytes where text should be")?;
    Ok(text.split_ascii_whitespace().collect())
}

fn word<'a>(words: &[&'a str], at: usize) -> Result<&'a str> {
    words
        .get(at)
        .copied()
        .with_context(|| format!("{} words, at least {} wanted", words.len(), at + 1))
}

/// A line that is longer than it says has its readings and poses out of place.
fn at_most(words: &[&str], count: usize) -> Result<()> {
    ensure!(
        words.len() <= count,
        "{} words, at most {count} wanted",
        words.len()
    );
    Ok(())
}

fn number(words: &[&str], at: usize) -> Result<f64> {
    let text = word(words, at)?;
    text.parse()
        .with_context(|| format!("word {}: {text:?} is not a number", at + 1))
}

fn count(words: &[&str], at: usize) -> Result<usize> {
    let text = word(words, at)?;
    let count: usize = text
        .parse()
        .with_context(|| format!("word {}: {text:?} is not a count", at + 1))?;
    ensure!(
        count <= words.len(),
        "{count} readings announced, {} words in the line",
        words.len()
    );
    Ok(count)
}

fn readings(words: &[&str], from: usize, count: usize) -> Result<Vec<f32>> {
    let texts = words.get(from..from + count).with_context(|| {
        format!(
            "{count} readings announced, {} words in the line",
            words.len()
        )
    })?;
    texts
        .iter()
        .enumerate()
        .map(|(k, text)| {
            text.parse()
                .with_context(|| format!("reading {k}: {text:?} is not a number"))
        })
        .collect()
}

fn pose(words: &[&str], from: usize) -> Result<TruePose> {
    Ok(TruePose::new(
        number(words, from)?,
        number(words, from + 1)?,
        number(words, from + 2)?,
    ))
}

fn finite(pose: TruePose) -> bool {
    pose.x.is_finite() && pose.y.is_finite() && pose.theta.is_finite()
}

fn stamp<'a>(words: &[&'a str], at: usize) -> Result<&'a str> {
    let value = number(words, at)?;
    ensure!(value.is_finite(), "the time stamp is not finite");
    word(words, at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_laser_lines_are_read() {
        let text = b"# comment\nPARAM robot 1\n\
            FLASER 4 1.0 2.5 81.9 81.91 1.1 2 0.5 1 2 0.5 12.340 host 0.1\n\
            ROBOTLASER1 0 -1.5 3.0 1.0 5.6 0.1 0 3 1 5.6 -2 0 1.1 2 0.5 1 2 0.5 0 0 0 0 0 12.5400 host 0.2\n";
        let log = parse(text);
        assert_eq!(log.scans.len(), 2);
        assert_eq!(log.scans[0].stamp, "12.340");
        assert_eq!(log.scans[1].stamp, "12.5400");
        let mm = |k: usize| -> Vec<_> {
            log.scans[k]
                .beams
                .iter()
                .map(|b| b.range.mm().ok())
                .collect()
        };
        assert_eq!(mm(0), [Some(1000), Some(2500), None, None]);
        assert_eq!(mm(1), [Some(1000), None, None]);
        assert_eq!(log.odd.bad, 1);
        let degrees: Vec<f32> = log.scans[0]
            .beams
            .iter()
            .map(|b| b.bearing.radians().to_degrees())
            .collect();
        assert!((degrees[0] + 90.0).abs() < 0.01 && (degrees[1] + 45.0).abs() < 0.01);
        let mount = log.mount.robot_from_lidar;
        assert!(
            (mount.x - 0.1 * 0.877_583).abs() < 1e-5 && (mount.y + 0.1 * 0.479_426).abs() < 1e-5
        );
        assert_eq!(log.scans[1].beams[0].time_us, 200_000);
    }

    #[test]
    fn parameters_tell_directions_and_mount() {
        let degrees = |readings: usize, parameters: &str| -> (f32, f32) {
            let readings = format!("FLASER {readings}{}", " 1.5".repeat(readings));
            let log = parse(format!("{parameters}{readings} 1 2 0 1 2 0 3 h 3\n").as_bytes());
            let beams = &log.scans.first().expect("a scan").beams;
            let end = |beam: Option<&Beam>| beam.map_or(0.0, |b| b.bearing.radians().to_degrees());
            (end(beams.first()), end(beams.last()))
        };
        let fov = "PARAM laser_front_laser_fov";
        let step = "PARAM laser_front_laser_resolution";
        //   readings  parameters                                    first and last bearing
        for (readings, parameters, expected) in [
            (181, String::new(), (-90.0, 90.0)),
            (180, String::new(), (-90.0, 89.0)),
            (541, format!("{fov} 4.71239 h 0\n"), (-135.0, 135.0)),
            (
                541,
                format!("{fov} 270 h 0\n{step} 0.50 h 0\n"),
                (-135.0, 135.0),
            ),
            (541, format!("{step} 0.5 h 0\n"), (-135.0, 135.0)),
            // A step that the number of readings contradicts.
            (
                181,
                format!("{fov} 3.14159265 h 0\n{step} 0.5 h 0\n"),
                (-90.0, 90.0),
            ),
            (
                360,
                format!("{fov} 3.14159265 h 0\n{step} 0.5 h 0\n"),
                (-90.0, 89.5),
            ),
            (271, format!("{fov} nan h 0\n{step}\n"), (-90.0, 90.0)),
        ] {
            let found = degrees(readings, &parameters);
            let off = [found.0 - expected.0, found.1 - expected.1];
            assert!(
                off.iter().all(|off| off.abs() < 0.02),
                "{readings} {parameters}: {found:?}"
            );
        }
        let offsets =
            "PARAM robot_frontlaser_offset -0.04 h 0\nPARAM laser_front_laser_flipped 1 h 0\n";
        let line = "FLASER 2 1 1 1 2 0 1 2 0 3 h 3\n";
        let mount = parse(format!("{offsets}{line}").as_bytes()).mount;
        assert!(mount.upside_down && mount.robot_from_lidar.x == -0.04);
    }

    #[test]
    fn broken_lines_are_counted_and_the_first_is_named() {
        let text = b"FLASER 3 1 2 x 0 0 0 0 0 0 1 h 1\nFLASER 3 1 2\nFLASER\nODOM 1\n\
            FLASER 2 nan -1 0 0 0 0 0 0 1.0 h 1\nFLASER 2 1 1 0 0 0 nan 0 0 1.0 h 1\n";
        let log = parse(text);
        assert_eq!((log.scans.len(), log.skipped, log.odd.bad), (1, 5, 2));
        let first = log.first_skipped.expect("one");
        assert!(
            first.starts_with("the first at line 1: reading 2: \"x\" is not a number"),
            "{first}"
        );
    }
}
