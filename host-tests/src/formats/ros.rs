//! ROS 2 recordings: MCAP files with `sensor_msgs/msg/LaserScan` and `nav_msgs/msg/Odometry` in CDR.
//!
//! The first laser topic of the file is read; odometry is the last message before a scan. Packed chunks (zstd, lz4) are
//! refused: `mcap compress --compression none` unpacks them.

use anyhow::{Context, Result, ensure};
use beamfix::scan::{Beam, Bearing, NoReturn, Range};

use super::{Log, Recorded, clock::Clock};
use beamfix_sim::TruePose;

/// The first bytes of such a file.
pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Reads the scans of the first laser topic.
#[must_use]
pub fn parse(bytes: &[u8]) -> Log {
    let mut log = Log::default();
    let mut clock = Clock::new();
    let (mut wheels, mut topic) = (None, None);
    let mut seen = 0;
    let messages = match mcap::MessageStream::new(bytes) {
        Ok(messages) => messages,
        Err(error) => {
            log.cut = Some(error.to_string());
            return log;
        }
    };
    for (number, message) in messages.enumerate() {
        let message = match message {
            Ok(message) => message,
            Err(error) => {
                log.cut = Some(format!("after {number} messages: {error}"));
                break;
            }
        };
        seen += 1;
        let channel = &message.channel;
        let kind = channel
            .schema
            .as_ref()
            .map_or("", |schema| schema.name.as_str());
        match kind {
            "nav_msgs/msg/Odometry" => match odometry(&message.data) {
                Ok(pose) => wheels = Some(pose),
                Err(error) => log.skip(format!("message {number}"), format!("{error:#}")),
            },
            "sensor_msgs/msg/LaserScan"
                if topic.get_or_insert_with(|| channel.topic.clone()) == &channel.topic =>
            {
                match laser(&message.data) {
                    Ok(scan) => {
                        log.bad_readings += scan
                            .ranges
                            .iter()
                            .filter(|r| r.is_nan() || **r < 0.0)
                            .count();
                        let beams = scan.beams(clock.at(scan.seconds()));
                        let stamp = format!("{}.{:09}", scan.sec, scan.nanosec);
                        log.scans.push(Recorded {
                            stamp,
                            wheels: wheels.map(TruePose::into),
                            beams,
                        });
                    }
                    Err(error) => log.skip(format!("message {number}"), format!("{error:#}")),
                }
            }
            _ => {}
        }
    }
    if topic.is_none() && log.cut.is_none() {
        log.cut = Some(format!(
            "no sensor_msgs/msg/LaserScan among {seen} messages"
        ));
    }
    log
}

/// A `LaserScan`.
struct Laser {
    sec: u32,
    nanosec: u32,
    first: f32,
    step: f32,
    /// From one beam to the next (s).
    time_step: f32,
    nearest: f32,
    farthest: f32,
    ranges: Vec<f32>,
}

impl Laser {
    fn seconds(&self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }

    /// The stamp is that of the first beam.
    fn beams(&self, first_us: u32) -> Vec<Beam> {
        let beam = |(k, &range): (usize, &f32)| {
            let bearing = f64::from(self.first) + f64::from(self.step) * k as f64;
            let age_us = f64::from(self.time_step) * 1e6 * k as f64;
            Beam {
                bearing: Bearing::from_radians(bearing as f32),
                range: if range > self.farthest {
                    Range::none(NoReturn::TooFar)
                } else if range < self.nearest {
                    Range::none(NoReturn::TooNear)
                } else {
                    Range::from_metres(range)
                },
                time_us: first_us.wrapping_add(age_us as u32),
                quality: 0,
            }
        };
        self.ranges.iter().enumerate().map(beam).collect()
    }
}

fn laser(message: &[u8]) -> Result<Laser> {
    let mut cdr = Cdr::new(message)?;
    let (sec, nanosec) = (cdr.u32()?, cdr.u32()?);
    cdr.skip_text()?;
    let mut number = || cdr.u32().map(f32::from_bits);
    let (first, _last, step) = (number()?, number()?, number()?);
    let (time_step, _scan_time, nearest, farthest) = (number()?, number()?, number()?, number()?);
    ensure!(
        first.is_finite() && step.is_finite(),
        "angles from {first} in steps of {step}"
    );
    let count = cdr.u32()? as usize;
    ensure!(count <= 65_536, "{count} ranges");
    let ranges = (0..count)
        .map(|_| cdr.u32().map(f32::from_bits))
        .collect::<Result<_>>()?;
    // Some drivers leave it 0 or write rubbish: then all beams count as measured at once.
    let time_step = if (0.0..0.01).contains(&time_step) {
        time_step
    } else {
        0.0
    };
    Ok(Laser {
        sec,
        nanosec,
        first,
        step,
        time_step,
        nearest,
        farthest,
        ranges,
    })
}

fn odometry(message: &[u8]) -> Result<TruePose> {
    let mut cdr = Cdr::new(message)?;
    cdr.u32()?;
    cdr.u32()?;
    cdr.skip_text()?;
    cdr.skip_text()?;
    let [x, y, _z] = [cdr.f64()?, cdr.f64()?, cdr.f64()?];
    let [qx, qy, qz, qw] = [cdr.f64()?, cdr.f64()?, cdr.f64()?, cdr.f64()?];
    let theta = libm::atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz));
    ensure!(
        x.is_finite() && y.is_finite() && theta.is_finite(),
        "the pose is not finite"
    );
    Ok(TruePose::new(x, y, theta))
}

/// Little-endian CDR: every number lies at a multiple of its size, counted after the first four bytes.
struct Cdr<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Cdr<'a> {
    fn new(message: &'a [u8]) -> Result<Self> {
        let (kind, body) = message
            .split_at_checked(4)
            .context("a message of less than 4 bytes")?;
        ensure!(
            kind[..2] == [0, 1],
            "not little-endian CDR: it begins with {kind:02x?}"
        );
        Ok(Self { body, at: 0 })
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let start = self.at.next_multiple_of(N);
        let bytes = self.body.get(start..start + N);
        self.at = start + N;
        bytes
            .and_then(|bytes| bytes.try_into().ok())
            .with_context(|| format!("the message ends after {} bytes", self.body.len()))
    }

    fn u32(&mut self) -> Result<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn skip_text(&mut self) -> Result<()> {
        let length = self.u32()? as usize;
        ensure!(
            length <= self.body.len(),
            "a text of {length} bytes in a message of {}",
            self.body.len()
        );
        self.at += length;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// CDR being written.
    #[derive(Default)]
    struct Out(Vec<u8>);

    impl Out {
        fn put<const N: usize>(&mut self, bytes: [u8; N]) -> &mut Self {
            self.0.resize(self.0.len().next_multiple_of(N), 0);
            self.0.extend(bytes);
            self
        }

        fn text(&mut self, text: &str) -> &mut Self {
            self.put((text.len() as u32 + 1).to_le_bytes());
            self.0.extend(text.bytes().chain([0]));
            self
        }

        fn message(&self) -> Vec<u8> {
            [&[0, 1, 0, 0], &self.0[..]].concat()
        }
    }

    fn laser_message(sec: u32, ranges: &[f32]) -> Vec<u8> {
        let mut out = Out::default();
        out.put(sec.to_le_bytes())
            .put(5u32.to_le_bytes())
            .text("laser");
        for value in [-1.5f32, 1.5, 0.5, 0.001, 0.1, 0.1, 8.0] {
            out.put(value.to_le_bytes());
        }
        out.put((ranges.len() as u32).to_le_bytes());
        for range in ranges {
            out.put(range.to_le_bytes());
        }
        out.message()
    }

    fn odometry_message(x: f64, theta: f64) -> Vec<u8> {
        let mut out = Out::default();
        out.put(1u32.to_le_bytes())
            .put(0u32.to_le_bytes())
            .text("odom")
            .text("base");
        for value in [
            x,
            2.0,
            0.0,
            0.0,
            0.0,
            (0.5 * theta).sin(),
            (0.5 * theta).cos(),
        ] {
            out.put(value.to_le_bytes());
        }
        out.message()
    }

    fn file(messages: &[(&str, &str, Vec<u8>)]) -> Vec<u8> {
        let options = mcap::WriteOptions::new().compression(None);
        let mut writer = options.create(Cursor::new(Vec::new())).expect("memory");
        for (sequence, (topic, kind, data)) in messages.iter().enumerate() {
            let schema = writer.add_schema(kind, "ros2msg", b"").expect("memory");
            let channel_id = writer
                .add_channel(schema, topic, "cdr", &Default::default())
                .expect("memory");
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: sequence as u32,
                log_time: 0,
                publish_time: 0,
            };
            writer
                .write_to_known_channel(&header, data)
                .expect("memory");
        }
        writer.finish().expect("memory");
        writer.into_inner().into_inner()
    }

    #[test]
    fn scans_and_odometry_are_read() {
        let (laser, odom) = ("sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry");
        let bytes = file(&[
            (
                "/scan",
                laser,
                laser_message(7, &[1.0, f32::NAN, 9.0, 0.05]),
            ),
            ("/odom", odom, odometry_message(1.0, 0.5)),
            ("/other", laser, laser_message(7, &[3.0])),
            ("/scan", laser, laser_message(8, &[1.0, 2.0])),
            ("/scan", laser, laser_message(9, &[1.0])[..58].to_vec()),
        ]);
        let log = parse(&bytes);
        assert_eq!(
            (log.scans.len(), log.skipped, log.bad_readings, log.cut),
            (2, 1, 1, None)
        );
        let first = &log.scans[0];
        assert_eq!((first.stamp.as_str(), first.wheels), ("7.000000005", None));
        let mm: Vec<_> = first.beams.iter().map(|beam| beam.range.mm()).collect();
        assert_eq!(
            mm,
            [
                Ok(1000),
                Err(NoReturn::Nothing),
                Err(NoReturn::TooFar),
                Err(NoReturn::TooNear)
            ]
        );
        assert_eq!(first.beams[3].time_us - first.beams[0].time_us, 3000);
        assert_eq!(log.scans[1].beams[0].time_us, 1_000_000);
        let wheels = log.scans[1].wheels.expect("odometry came before");
        assert!((wheels.theta - 0.5).abs() < 1e-6 && wheels.x == 1.0 && wheels.y == 2.0);
        // A cut file gives what came before the cut, or at least says that it is cut.
        let cut = parse(&bytes[..bytes.len() / 2]);
        assert!(cut.cut.is_some());
    }
}
