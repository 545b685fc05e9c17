//! ROS 2 bags, written message by message.

use std::io::Cursor;

use beamfix_sim::TruePose;

/// A bag in memory.
#[derive(Default, Clone)]
pub struct Bag(Vec<(String, &'static str, u64, Vec<u8>)>);

/// What stays the same in the scans of a `LaserScan` topic.
#[derive(Clone, Copy)]
pub struct Scanner {
    pub frame: &'static str,
    /// Bearing of the first element, and from one to the next (rad).
    pub first: f64,
    pub step: f64,
    /// From one element to the next, and from one scan to the next (s).
    pub time_step: f64,
    pub scan_time: f64,
    /// Stated limits (m).
    pub nearest: f32,
    pub farthest: f32,
}

impl Bag {
    pub fn laser(&mut self, topic: &str, seconds: f64, scanner: &Scanner, ranges: &[f32]) {
        let mut out = Cdr::with_header(seconds, scanner.frame);
        let last = scanner.first + scanner.step * (ranges.len() - 1) as f64;
        for value in [
            scanner.first,
            last,
            scanner.step,
            scanner.time_step,
            scanner.scan_time,
        ] {
            out.put((value as f32).to_le_bytes());
        }
        out.put(scanner.nearest.to_le_bytes())
            .put(scanner.farthest.to_le_bytes());
        out.put((ranges.len() as u32).to_le_bytes());
        for range in ranges {
            out.put(range.to_le_bytes());
        }
        out.put(0u32.to_le_bytes());
        self.push(topic, "sensor_msgs/msg/LaserScan", seconds, out);
    }

    pub fn odometry(&mut self, topic: &str, child: &str, seconds: f64, pose: TruePose) {
        let mut out = Cdr::with_header(seconds, "odom");
        out.text(child);
        out.f64s(&[pose.x, pose.y, 0.0]);
        out.f64s(&[0.0, 0.0, (0.5 * pose.theta).sin(), (0.5 * pose.theta).cos()]);
        out.f64s(&[0.0; 36 + 6 + 36]);
        self.push(topic, "nav_msgs/msg/Odometry", seconds, out);
    }

    /// Place and quaternion (x, y, z, w) of `child` in `parent`, once and for all.
    pub fn fixed(&mut self, parent: &str, child: &str, place: [f64; 3], rotation: [f64; 4]) {
        let mut out = Cdr::default();
        out.put(1u32.to_le_bytes());
        out.header(0.0, parent);
        out.text(child).f64s(&place).f64s(&rotation);
        self.push("/tf_static", "tf2_msgs/msg/TFMessage", 0.0, out);
    }

    fn push(&mut self, topic: &str, kind: &'static str, seconds: f64, out: Cdr) {
        let data = [&[0, 1, 0, 0], &out.0[..]].concat();
        self.0
            .push((topic.into(), kind, (seconds * 1e9) as u64, data));
    }

    pub fn mcap(&self, packed: Option<mcap::Compression>) -> Vec<u8> {
        // Small chunks: what is cut inside one is lost from its last block on.
        let options = mcap::WriteOptions::new()
            .compression(packed)
            .chunk_size(Some(16 << 10));
        let mut writer = options.create(Cursor::new(Vec::new())).expect("memory");
        for (sequence, (topic, kind, log_time, data)) in self.0.iter().enumerate() {
            let schema = writer.add_schema(kind, "ros2msg", b"").expect("memory");
            let channel_id = writer
                .add_channel(schema, topic, "cdr", &Default::default())
                .expect("memory");
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: sequence as u32,
                log_time: *log_time,
                publish_time: *log_time,
            };
            writer
                .write_to_known_channel(&header, data)
                .expect("memory");
        }
        writer.finish().expect("memory");
        writer.into_inner().into_inner()
    }
}

/// Little-endian CDR: every number lies at a multiple of its size.
#[derive(Default)]
struct Cdr(Vec<u8>);

impl Cdr {
    fn with_header(seconds: f64, frame: &str) -> Self {
        let mut out = Self::default();
        out.header(seconds, frame);
        out
    }

    fn header(&mut self, seconds: f64, frame: &str) {
        self.put((seconds as u32).to_le_bytes());
        self.put(((seconds.fract() * 1e9).round() as u32).to_le_bytes());
        self.text(frame);
    }

    fn put<const N: usize>(&mut self, bytes: [u8; N]) -> &mut Self {
        self.0.resize(self.0.len().next_multiple_of(N), 0);
        self.0.extend(bytes);
        self
    }

    fn f64s(&mut self, values: &[f64]) -> &mut Self {
        for value in values {
            self.put(value.to_le_bytes());
        }
        self
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.put((text.len() as u32 + 1).to_le_bytes());
        self.0.extend(text.bytes().chain([0]));
        self
    }
}
