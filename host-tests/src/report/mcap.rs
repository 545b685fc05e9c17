//! MCAP files with Foxglove's schemas in JSON: open them in Foxglove or Lichtblick.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};
use base64::{Engine, prelude::BASE64_STANDARD};
use beamfix::geometry::{Point, Pose};
use beamfix::grid::occupancy::{self, Cell};
use mcap::records::MessageHeader;
use serde_json::{Value, json};

use crate::formats::ros_map::Map;

/// An MCAP file being written.
pub struct McapFile {
    writer: mcap::Writer<BufWriter<File>>,
    name: String,
    sequence: u32,
    clouds: u16,
    poses: Vec<(String, u16)>,
    transforms: u16,
    maps: u16,
    /// When the last message was written (s).
    last: f64,
}

const FRAME: &str = "map";

impl McapFile {
    /// Starts a file whose poses are named `poses`; the first one carries the lidar's points.
    pub fn create(path: &Path, poses: &[&str]) -> Result<Self> {
        let name = path.display().to_string();
        let file = File::create(path).with_context(|| name.clone())?;
        let options = mcap::WriteOptions::new()
            .compression(None)
            .library("beamfix");
        let mut writer = options
            .create(BufWriter::new(file))
            .with_context(|| name.clone())?;
        let mut channel = |topic: &str, kind: &str, schema: Value| -> Result<u16> {
            let id = writer.add_schema(kind, "jsonschema", schema.to_string().as_bytes())?;
            Ok(writer.add_channel(id, topic, "json", &Default::default())?)
        };
        let clouds = channel("/points", "foxglove.PointCloud", cloud_schema())?;
        let transforms = channel("/tf", "foxglove.FrameTransform", transform_schema())?;
        let maps = channel("/map", "foxglove.Grid", grid_schema())?;
        let poses = poses
            .iter()
            .map(|pose| {
                Ok((
                    (*pose).to_owned(),
                    channel(
                        &format!("/pose/{pose}"),
                        "foxglove.PoseInFrame",
                        pose_schema(),
                    )?,
                ))
            })
            .collect::<Result<_>>()?;
        Ok(Self {
            writer,
            name,
            sequence: 0,
            clouds,
            poses,
            transforms,
            maps,
            last: 0.0,
        })
    }

    /// Keeps a file's bytes inside, as they are.
    pub fn attach(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let attachment = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: name.to_owned(),
            media_type: "application/octet-stream".into(),
            data: bytes.into(),
        };
        self.writer
            .attach(&attachment)
            .with_context(|| self.name.clone())
    }

    /// Writes one moment: the points in the robot's frame, and the poses in the order given to [`McapFile::create`].
    pub fn push(
        &mut self,
        seconds: f64,
        points_in_robot: &[Point],
        poses_in_map: &[Pose],
    ) -> Result<()> {
        self.last = seconds;
        let stamp = stamp(seconds);
        let data: Vec<u8> = points_in_robot
            .iter()
            .flat_map(|p| [p.x, p.y])
            .flat_map(f32::to_le_bytes)
            .collect();
        let cloud = json!({
            "timestamp": stamp, "frame_id": "robot", "pose": pose_json(Pose::IDENTITY), "point_stride": 8,
            "fields": [{"name": "x", "offset": 0, "type": 7}, {"name": "y", "offset": 4, "type": 7}],
            "data": BASE64_STANDARD.encode(data),
        });
        self.write(self.clouds, seconds, &cloud)?;
        for (&pose, channel) in poses_in_map
            .iter()
            .zip(self.poses.iter().map(|(_, id)| *id).collect::<Vec<_>>())
        {
            let message = json!({"timestamp": stamp, "frame_id": FRAME, "pose": pose_json(pose)});
            self.write(channel, seconds, &message)?;
        }
        if let Some(&pose) = poses_in_map.first() {
            let placed = pose_json(pose);
            let message = json!({
                "timestamp": stamp, "parent_frame_id": FRAME, "child_frame_id": "robot",
                "translation": placed["position"], "rotation": placed["orientation"],
            });
            self.write(self.transforms, seconds, &message)?;
        }
        Ok(())
    }

    /// Writes what was seen as a map: 0 free, 100 occupied, 255 unknown.
    pub fn push_map(&mut self, map: &Map) -> Result<()> {
        let shape = map.shape();
        let value = |&byte: &u8| match occupancy::cell(byte) {
            Cell::Free => 0,
            Cell::Occupied => 100,
            Cell::Unknown => 255u8,
        };
        let data: Vec<u8> = map.cells().iter().map(value).collect();
        let side = shape.resolution();
        let message = json!({
            "timestamp": stamp(self.last), "frame_id": FRAME, "pose": pose_json(shape.origin()),
            "column_count": shape.width(), "cell_size": {"x": side, "y": side},
            "row_stride": shape.width(), "cell_stride": 1,
            "fields": [{"name": "occupancy", "offset": 0, "type": 1}],
            "data": BASE64_STANDARD.encode(data),
        });
        self.write(self.maps, self.last, &message)
    }

    /// Closes the file: without this it has no index.
    pub fn finish(mut self) -> Result<()> {
        self.writer
            .finish()
            .map(|_| ())
            .with_context(|| self.name.clone())
    }

    fn write(&mut self, channel_id: u16, seconds: f64, message: &Value) -> Result<()> {
        let time = (seconds * 1e9) as u64;
        let header = next_header(channel_id, &mut self.sequence, time);
        let bytes = message.to_string();
        self.writer
            .write_to_known_channel(&header, bytes.as_bytes())
            .with_context(|| self.name.clone())
    }
}

fn stamp(seconds: f64) -> Value {
    json!({"sec": seconds as u64, "nsec": (seconds.fract() * 1e9) as u64})
}

fn pose_json(pose: Pose) -> Value {
    let half = 0.5 * f64::from(pose.theta);
    json!({
        "position": {"x": pose.x, "y": pose.y, "z": 0},
        "orientation": {"x": 0, "y": 0, "z": libm::sin(half), "w": libm::cos(half)},
    })
}

fn object(properties: Value) -> Value {
    json!({"type": "object", "properties": properties})
}

fn numbers(names: &[&str]) -> Value {
    object(
        names
            .iter()
            .map(|name| ((*name).to_owned(), json!({"type": "number"})))
            .collect(),
    )
}

fn stamp_schema() -> Value {
    json!({"type": "object", "title": "time", "properties": {
        "sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
    }})
}

fn placed_schema() -> Value {
    object(
        json!({"position": numbers(&["x", "y", "z"]), "orientation": numbers(&["x", "y", "z", "w"])}),
    )
}

fn titled(title: &str, properties: Value) -> Value {
    let mut schema = object(properties);
    schema["title"] = json!(title);
    schema
}

fn pose_schema() -> Value {
    titled(
        "foxglove.PoseInFrame",
        json!({"timestamp": stamp_schema(), "frame_id": {"type": "string"}, "pose": placed_schema()}),
    )
}

fn transform_schema() -> Value {
    titled(
        "foxglove.FrameTransform",
        json!({
            "timestamp": stamp_schema(), "parent_frame_id": {"type": "string"}, "child_frame_id": {"type": "string"},
            "translation": numbers(&["x", "y", "z"]), "rotation": numbers(&["x", "y", "z", "w"]),
        }),
    )
}

fn cloud_schema() -> Value {
    let field = object(
        json!({"name": {"type": "string"}, "offset": {"type": "integer"}, "type": {"type": "integer"}}),
    );
    titled(
        "foxglove.PointCloud",
        json!({
            "timestamp": stamp_schema(), "frame_id": {"type": "string"}, "pose": placed_schema(), "point_stride": {"type": "integer"},
            "fields": {"type": "array", "items": field}, "data": {"type": "string", "contentEncoding": "base64"},
        }),
    )
}

fn grid_schema() -> Value {
    let field = object(
        json!({"name": {"type": "string"}, "offset": {"type": "integer"}, "type": {"type": "integer"}}),
    );
    titled(
        "foxglove.Grid",
        json!({
            "timestamp": stamp_schema(), "frame_id": {"type": "string"}, "pose": placed_schema(),
            "column_count": {"type": "integer"}, "cell_size": numbers(&["x", "y"]),
            "row_stride": {"type": "integer"}, "cell_stride": {"type": "integer"},
            "fields": {"type": "array", "items": field}, "data": {"type": "string", "contentEncoding": "base64"},
        }),
    )
}

/// The header of the next message of a file (ns).
pub(super) fn next_header(channel_id: u16, sequence: &mut u32, time: u64) -> MessageHeader {
    let header = MessageHeader {
        channel_id,
        sequence: *sequence,
        log_time: time,
        publish_time: time,
    };
    *sequence += 1;
    header
}
