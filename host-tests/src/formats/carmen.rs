//! CARMEN text logs: `FLASER`, `ROBOTLASER1` and `ODOM` lines; other words are skipped.
//!
//! ```text
//! FLASER n r1..rn  x y theta  odom_x odom_y odom_theta  ipc_time host logger_time
//! ROBOTLASER1 type start fov resolution max_range accuracy remission n r1..rn m rem1..remm
//!             laser_x laser_y laser_theta  robot_x robot_y robot_theta  tv rv safety safety axis  ipc_time host time
//! ODOM x y theta tv rv accel  ipc_time host logger_time
//! ```

use anyhow::{Context, Result, ensure};
use beamfix::geometry::Pose;
use beamfix::scan::{Beam, Bearing, NoReturn, Range};

use super::{Log, Recorded, clock::Clock};
use beamfix_sim::TruePose;

/// From here on the largest reading of a log stands for "no return": 50.0, 51.2, 81.83, 81.91 are in use.
const NO_RETURN_FROM: f32 = 49.0;
/// How far below the largest a reading still means the same.
const JUST_BELOW: f32 = 0.1;

/// A laser line as it stands.
struct Line<'a> {
    stamp: &'a str,
    /// First bearing and step (rad).
    first: f64,
    step: f64,
    /// Readings from here on (m) are no returns.
    max_range: f32,
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
    for (number, line) in text.split(|&b| b == b'\n').enumerate() {
        let word_end = line
            .iter()
            .position(|b| b.is_ascii_whitespace())
            .unwrap_or(line.len());
        let parsed = match &line[..word_end] {
            b"FLASER" => words(line).and_then(|w| flaser(&w)),
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
    let largest = lines
        .iter()
        .flat_map(|line| line.readings.iter().copied())
        .filter(|reading| reading.is_finite())
        .fold(0.0f32, |a, b| if b > a { b } else { a });
    let no_return = if largest >= NO_RETURN_FROM {
        largest - JUST_BELOW
    } else {
        f32::INFINITY
    };
    log.robot_from_lidar = mount(&lines);
    let mut clock = Clock::new();
    for line in lines {
        let time_us = clock.at(line.stamp.parse().unwrap_or(f64::NAN));
        log.bad_readings += line
            .readings
            .iter()
            .filter(|r| r.is_nan() || **r < 0.0)
            .count();
        let beams = line.beams(no_return, time_us);
        log.scans.push(Recorded {
            stamp: line.stamp.to_owned(),
            wheels: Some(line.robot.into()),
            beams,
        });
    }
    log
}

impl Line<'_> {
    fn beams(&self, no_return: f32, time_us: u32) -> Vec<Beam> {
        let beam = |(k, &reading): (usize, &f32)| {
            let bearing = self.first + self.step * k as f64;
            let range = if reading >= no_return || reading >= self.max_range {
                Range::none(NoReturn::TooFar)
            } else {
                Range::from_metres(reading)
            };
            Beam {
                bearing: Bearing::from_radians(bearing as f32),
                range,
                time_us,
                quality: 0,
            }
        };
        self.readings.iter().enumerate().map(beam).collect()
    }
}

fn flaser<'a>(words: &[&'a str]) -> Result<Line<'a>> {
    let count = count(words, 1)?;
    let readings = readings(words, 2, count)?;
    let rest = 2 + count;
    at_most(words, rest + 9)?;
    ensure!(count >= 2, "{count} readings");
    // 180 or 181 readings are 1° apart, 360 or 361 half a degree: 180° over the next lower even number.
    let step = core::f64::consts::PI / (count / 2 * 2) as f64;
    Ok(Line {
        stamp: stamp(words, rest + 6)?,
        first: -core::f64::consts::FRAC_PI_2,
        step,
        max_range: f32::INFINITY,
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
        max_range: if max_range > 0.0 {
            max_range
        } else {
            f32::INFINITY
        },
        readings,
        laser: pose(words, rest)?,
        robot: pose(words, rest + 3)?,
    })
}

/// Where the laser sits on the robot, if the lines agree; corrected logs have poses of two origins there.
fn mount(lines: &[Line]) -> Pose {
    let Some(first) = lines.first().map(|line| line.robot.between(line.laser)) else {
        return Pose::IDENTITY;
    };
    let agrees = lines.iter().all(|line| {
        let off = first.between(line.robot.between(line.laser));
        off.distance() < 0.01 && off.theta.abs() < 0.01
    });
    if agrees && first.distance() < 2.0 {
        first.into()
    } else {
        Pose::IDENTITY
    }
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
        assert_eq!(log.bad_readings, 1);
        let degrees: Vec<f32> = log.scans[0]
            .beams
            .iter()
            .map(|b| b.bearing.radians().to_degrees())
            .collect();
        assert!((degrees[0] + 90.0).abs() < 0.01 && (degrees[1] + 45.0).abs() < 0.01);
        let mount = log.robot_from_lidar;
        assert!(
            (mount.x - 0.1 * 0.877_583).abs() < 1e-5 && (mount.y + 0.1 * 0.479_426).abs() < 1e-5
        );
        assert_eq!(log.scans[1].beams[0].time_us, 200_000);
    }

    #[test]
    fn broken_lines_are_counted_and_the_first_is_named() {
        let text = b"FLASER 3 1 2 x 0 0 0 0 0 0 1 h 1\nFLASER 3 1 2\nFLASER\nODOM 1\n\
            FLASER 2 nan -1 0 0 0 0 0 0 1.0 h 1\nFLASER 2 1 1 0 0 0 nan 0 0 1.0 h 1\n";
        let log = parse(text);
        assert_eq!((log.scans.len(), log.skipped, log.bad_readings), (1, 5, 2));
        let first = log.first_skipped.expect("one");
        assert!(
            first.starts_with("line 1: reading 2: \"x\" is not a number"),
            "{first}"
        );
    }
}
