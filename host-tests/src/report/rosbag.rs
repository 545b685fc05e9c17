//! ROS 2 bags as `ros2 bag` and the Python package rosbags read them: a folder with `metadata.yaml` and an MCAP file.
//!
//! Topics: `/scan`, `/odom` where there are wheels, `/pose` for the estimate, `/ground_truth` where it is known, `/tf`
//! (`map`, `odom`, `base_link`, as REP 105 has them), `/tf_static` for the lidar's mount, and `/map` at the end.

mod sweep;

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use beamfix::scan::{Mount, NoReturn};
use serde::Serialize;

use self::sweep::Sweep;
use crate::formats::Recorded;
use crate::formats::ros_map::Map;
use crate::report::mcap::next_header;
use crate::report::ros::message::{self, Covariance, Estimate, LaserScan, Odometry};
use crate::report::ros::{
    LIDAR, MAP, ODOM, ROBOT, cdr, header, mounted, not_known, occupied, placed, six_by_six, stamp,
    transform,
};
use crate::report::track::At;

/// Name of the file in the folder.
const FILE: &str = "run_0.mcap";

/// A topic of the bag.
struct Topic {
    name: &'static str,
    kind: &'static str,
    /// For late subscribers: the last message is kept.
    is_latched: bool,
    channel: Option<u16>,
    count: u64,
}

const fn topic(name: &'static str, kind: &'static str, is_latched: bool) -> Topic {
    Topic {
        name,
        kind,
        is_latched,
        channel: None,
        count: 0,
    }
}

/// Indices of [`RosBag::topics`].
const SCAN: usize = 0;
const WHEELS: usize = 1;
const POSE: usize = 2;
const TRUTH: usize = 3;
const TF: usize = 4;
const TF_STATIC: usize = 5;
const GRID: usize = 6;

/// A bag being written.
pub struct RosBag {
    writer: mcap::Writer<BufWriter<File>>,
    folder: PathBuf,
    topics: [Topic; 7],
    sequence: u32,
    mount: Mount,
    sweep: Sweep,
    /// Largest distance of a beam's time from the one that its place in the array says (us).
    time_shift_us: u32,
    /// Time of the first beam of the last scan: microseconds of 32 bits, and without their overflow (us).
    clock: Option<(u32, u64)>,
    /// When the first and the last message were written (ns).
    span: Option<(u64, u64)>,
}

impl RosBag {
    /// Starts a bag in a folder, over an older one of the same name.
    pub fn create(folder: &Path, mount: Mount) -> Result<Self> {
        let name = || folder.display().to_string();
        std::fs::create_dir_all(folder).with_context(name)?;
        let file = File::create(folder.join(FILE)).with_context(name)?;
        let options = mcap::WriteOptions::new().compression(None).profile("ros2");
        Ok(Self {
            writer: options.create(BufWriter::new(file)).with_context(name)?,
            folder: folder.to_owned(),
            topics: [
                topic("/scan", "sensor_msgs/LaserScan", false),
                topic("/odom", "nav_msgs/Odometry", false),
                topic("/pose", "geometry_msgs/PoseWithCovarianceStamped", false),
                topic(
                    "/ground_truth",
                    "geometry_msgs/PoseWithCovarianceStamped",
                    false,
                ),
                topic("/tf", "tf2_msgs/TFMessage", false),
                topic("/tf_static", "tf2_msgs/TFMessage", true),
                topic("/map", "nav_msgs/OccupancyGrid", true),
            ],
            sequence: 0,
            mount,
            sweep: Sweep::default(),
            time_shift_us: 0,
            clock: None,
            span: None,
        })
    }

    /// What a `LaserScan` cannot hold, which has equal steps of bearing and of time only.
    #[must_use]
    pub fn moved(&self) -> Option<String> {
        let degrees = self.sweep.largest_shift().to_degrees();
        let milliseconds = f64::from(self.time_shift_us) * 1e-3;
        let what = match (degrees > 0.0, self.time_shift_us > 0) {
            (true, false) => format!("bearings are moved by up to {degrees:.2}°"),
            (true, true) => format!(
                "bearings are moved by up to {degrees:.2}° and times of beams by up to {milliseconds:.3} ms"
            ),
            (false, true) => format!("times of beams are moved by up to {milliseconds:.3} ms"),
            (false, false) => return None,
        };
        Some(format!(
            "a LaserScan has equal steps only: {what}, and the bag's poses differ by as little from these"
        ))
    }

    /// Writes a scan with its wheels, and where the robot is at its end.
    pub fn push(&mut self, scan: &Recorded, at: &At) -> Result<()> {
        let (Some(first), Some(last)) = (scan.beams.first(), scan.beams.last()) else {
            return Ok(());
        };
        // A second after the epoch, so that no stamp is zero, which ROS takes for none.
        let start_us = self.clock.map_or(1_000_000, |(before, start_us)| {
            start_us + u64::from(first.time_us.wrapping_sub(before))
        });
        let scan_us = self
            .clock
            .map_or(0, |(before, _)| first.time_us.wrapping_sub(before));
        self.clock = Some((first.time_us, start_us));
        let sweep_us = last.time_us.wrapping_sub(first.time_us);
        let (start, end) = (stamp(start_us), stamp(start_us + u64::from(sweep_us)));
        let now = (start_us + u64::from(sweep_us)) * 1000;
        if self.topics[TF_STATIC].count == 0 {
            let mount = transform(start, [ROBOT, LIDAR], mounted(self.mount));
            self.write(TF_STATIC, now, &[mount].as_slice())?;
        }
        let (angle_min, angle_increment) = self.sweep.fit(&scan.beams);
        let gaps = scan.beams.len().saturating_sub(1).max(1) as f32;
        // Half a microsecond more: times that are rounded down are those that were written.
        let time_increment = if sweep_us == 0 {
            0.0
        } else {
            (sweep_us as f32 + 0.5) * 1e-6 / gaps
        };
        for (k, beam) in scan.beams.iter().enumerate() {
            let us = (f64::from(time_increment) * 1e6 * k as f64) as u32;
            let shift = beam.time_us.wrapping_sub(first.time_us).wrapping_sub(us);
            self.time_shift_us = self.time_shift_us.max(shift.cast_signed().unsigned_abs());
        }
        let range = |beam: &beamfix::scan::Beam| match beam.range.mm() {
            Ok(mm) => f32::from(mm) * 1e-3,
            Err(NoReturn::TooNear) => f32::NEG_INFINITY,
            Err(_) => f32::INFINITY,
        };
        let laser = LaserScan {
            header: header(start, LIDAR),
            angle_min,
            angle_max: angle_min + angle_increment * gaps,
            angle_increment,
            time_increment,
            scan_time: scan_us as f32 * 1e-6,
            range_min: 0.0,
            range_max: f32::from(beamfix::scan::Range::MAX_MM) * 1e-3,
            ranges: scan.beams.iter().map(range).collect(),
            intensities: scan
                .beams
                .iter()
                .map(|beam| f32::from(beam.quality))
                .collect(),
        };
        // Before the scan: a reader may take the last wheels that it has seen.
        if let Some(wheels) = scan.wheels {
            let odometry = Odometry {
                header: header(end, ODOM),
                child_frame_id: ROBOT,
                pose: placed(wheels),
                pose_covariance: Covariance::default(),
                twist: [[0.0; 3]; 2],
                twist_covariance: Covariance::default(),
            };
            self.write(WHEELS, now, &odometry)?;
        }
        self.write(SCAN, now, &laser)?;
        let odom_from_robot = scan.wheels.unwrap_or(at.estimate);
        let map_from_odom = at.estimate * odom_from_robot.inverse();
        let transforms = [
            transform(end, [MAP, ODOM], placed(map_from_odom)),
            transform(end, [ODOM, ROBOT], placed(odom_from_robot)),
        ];
        self.write(TF, now, &transforms.as_slice())?;
        let estimate = Estimate {
            header: header(end, MAP),
            pose: placed(at.estimate),
            covariance: at
                .covariance
                .map_or(not_known(), |known| six_by_six(known.to_array())),
        };
        self.write(POSE, now, &estimate)?;
        if let Some(truth) = at.truth {
            let truth = Estimate {
                pose: placed(truth),
                covariance: Covariance::default(),
                ..estimate
            };
            self.write(TRUTH, now, &truth)?;
        }
        Ok(())
    }

    /// Writes what was seen as a map.
    pub fn push_map(&mut self, map: &Map) -> Result<()> {
        let now = self.span.map_or(0, |(_, last)| last);
        let grid = occupied(map, stamp(now / 1000));
        self.write(GRID, now, &grid)
    }

    /// Closes the file and writes `metadata.yaml`, without which a bag cannot be opened.
    pub fn finish(mut self) -> Result<()> {
        let name = || self.folder.display().to_string();
        self.writer.finish().with_context(name)?;
        let metadata = self.metadata();
        std::fs::write(self.folder.join("metadata.yaml"), metadata).with_context(name)
    }

    fn write(&mut self, topic: usize, time: u64, message: &impl Serialize) -> Result<()> {
        let topic = &mut self.topics[topic];
        let channel_id = match topic.channel {
            Some(channel) => channel,
            None => {
                let kind = topic.kind.replace('/', "/msg/");
                let text = message::definition(topic.kind);
                let schema = self.writer.add_schema(&kind, "ros2msg", text.as_bytes())?;
                let quality = [("offered_qos_profiles".into(), quality(topic.is_latched))].into();
                let channel = self
                    .writer
                    .add_channel(schema, topic.name, "cdr", &quality)?;
                topic.channel = Some(channel);
                channel
            }
        };
        topic.count += 1;
        // Little-endian CDR.
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(cdr(message).with_context(|| topic.name)?);
        let header = next_header(channel_id, &mut self.sequence, time);
        self.span = Some((self.span.map_or(time, |(first, _)| first), time));
        self.writer.write_to_known_channel(&header, &bytes)?;
        Ok(())
    }

    /// As rosbag2 of ROS 2 Humble writes it: later ones read it too.
    fn metadata(&self) -> String {
        let (first, last) = self.span.unwrap_or((0, 0));
        let used = || self.topics.iter().filter(|topic| topic.count > 0);
        let count: u64 = used().map(|topic| topic.count).sum();
        let mut text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  \
             starting_time:\n    nanoseconds_since_epoch: {first}\n  message_count: {count}\n  \
             topics_with_message_count:\n",
            last - first
        );
        for topic in used() {
            text += &format!(
                "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n        \
                 offered_qos_profiles: \"{}\"\n      message_count: {}\n",
                topic.name,
                topic.kind.replace('/', "/msg/"),
                quality(topic.is_latched).replace('\n', "\\n"),
                topic.count
            );
        }
        text + &format!(
            "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {FILE}\n  files:\n    \
             - path: {FILE}\n      starting_time:\n        nanoseconds_since_epoch: {first}\n      duration:\n        \
             nanoseconds: {}\n      message_count: {count}\n",
            last - first
        )
    }
}

/// Quality of service as rosbag2 keeps it: reliable, the last ten or the last one kept.
fn quality(is_latched: bool) -> String {
    let (depth, durability) = if is_latched { (1, 1) } else { (10, 2) };
    let forever = "sec: 9223372036\n    nsec: 854775807";
    format!(
        "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline:\n    {forever}\n  \
         lifespan:\n    {forever}\n  liveliness: 1\n  liveliness_lease_duration:\n    {forever}\n  \
         avoid_ros_namespace_conventions: false\n"
    )
}
