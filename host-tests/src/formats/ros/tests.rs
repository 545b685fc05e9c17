use super::*;
use crate::formats::bytes::Content;
use beamfix::scan::NoReturn;
use std::io::Cursor;

fn read(bytes: &[u8]) -> Log {
    let content = Content {
        bytes: bytes.to_vec(),
        cut: None,
    };
    parse(Bag::of_file(content), &Options::default()).expect("no topic was asked for")
}

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
    let log = read(&bytes);
    assert_eq!(
        (log.scans.len(), log.skipped, log.odd.bad, log.cut),
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
    let cut = read(&bytes[..bytes.len() / 2]);
    assert!(cut.cut.is_some());
}
