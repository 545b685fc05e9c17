//! Foxglove's messages in JSON, as Foxglove and Lichtblick show them: for [`McapFile`](super::mcap::McapFile) and a live server.

use base64::{Engine, prelude::BASE64_STANDARD};
use beamfix::geometry::{Point, Pose};
use beamfix::grid::occupancy::{self, Cell};
use serde_json::{Value, json};

use crate::formats::ros_map::Map;

/// Encoding of the schemas.
pub const SCHEMA: &str = "jsonschema";
/// Encoding of the messages.
pub const MESSAGE: &str = "json";
/// The frame in which the robot started, or a map's.
const FRAME: &str = "map";
/// The robot's frame.
const ROBOT: &str = "robot";

/// What a channel carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Points: [`cloud`].
    Cloud,
    /// [`pose`].
    Pose,
    /// [`transform`].
    Transform,
    /// [`grid`].
    Grid,
}

impl Kind {
    /// The schema's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cloud => "foxglove.PointCloud",
            Self::Pose => "foxglove.PoseInFrame",
            Self::Transform => "foxglove.FrameTransform",
            Self::Grid => "foxglove.Grid",
        }
    }

    /// The schema.
    #[must_use]
    pub fn schema(self) -> Value {
        let properties = match self {
            Self::Cloud => cloud_schema(),
            Self::Pose => pose_schema(),
            Self::Transform => transform_schema(),
            Self::Grid => grid_schema(),
        };
        let mut schema = object(properties);
        schema["title"] = json!(self.name());
        schema
    }
}

/// Points in the robot's frame.
#[must_use]
pub fn cloud(seconds: f64, points_in_robot: &[Point]) -> Value {
    cloud_in(ROBOT, seconds, points_in_robot)
}

/// Points in the map's frame.
#[must_use]
pub fn cloud_in_map(seconds: f64, points_in_map: &[Point]) -> Value {
    cloud_in(FRAME, seconds, points_in_map)
}

fn cloud_in(frame: &str, seconds: f64, points: &[Point]) -> Value {
    let data: Vec<u8> = points
        .iter()
        .flat_map(|p| [p.x, p.y])
        .flat_map(f32::to_le_bytes)
        .collect();
    json!({
        "timestamp": stamp(seconds), "frame_id": frame, "pose": placed(Pose::IDENTITY), "point_stride": 8,
        "fields": [{"name": "x", "offset": 0, "type": 7}, {"name": "y", "offset": 4, "type": 7}],
        "data": BASE64_STANDARD.encode(data),
    })
}

/// A pose in the map's frame.
#[must_use]
pub fn pose(seconds: f64, pose: Pose) -> Value {
    json!({"timestamp": stamp(seconds), "frame_id": FRAME, "pose": placed(pose)})
}

/// Where the robot's frame lies in the map's.
#[must_use]
pub fn transform(seconds: f64, pose: Pose) -> Value {
    let placed = placed(pose);
    json!({
        "timestamp": stamp(seconds), "parent_frame_id": FRAME, "child_frame_id": ROBOT,
        "translation": placed["position"], "rotation": placed["orientation"],
    })
}

/// A map: 0 free, 100 occupied, 255 unknown.
#[must_use]
pub fn grid(seconds: f64, map: &Map) -> Value {
    let shape = map.shape();
    let value = |&byte: &u8| match occupancy::cell(byte) {
        Cell::Free => 0,
        Cell::Occupied => 100,
        Cell::Unknown => 255u8,
    };
    let data: Vec<u8> = map.cells().iter().map(value).collect();
    let side = shape.resolution();
    json!({
        "timestamp": stamp(seconds), "frame_id": FRAME, "pose": placed(shape.origin()),
        "column_count": shape.width(), "cell_size": {"x": side, "y": side},
        "row_stride": shape.width(), "cell_stride": 1,
        "fields": [{"name": "occupancy", "offset": 0, "type": 1}],
        "data": BASE64_STANDARD.encode(data),
    })
}

fn stamp(seconds: f64) -> Value {
    json!({"sec": seconds as u64, "nsec": (seconds.fract() * 1e9) as u64})
}

fn placed(pose: Pose) -> Value {
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

fn pose_schema() -> Value {
    json!({"timestamp": stamp_schema(), "frame_id": {"type": "string"}, "pose": placed_schema()})
}

fn transform_schema() -> Value {
    json!({
        "timestamp": stamp_schema(), "parent_frame_id": {"type": "string"}, "child_frame_id": {"type": "string"},
        "translation": numbers(&["x", "y", "z"]), "rotation": numbers(&["x", "y", "z", "w"]),
    })
}

fn cloud_schema() -> Value {
    let field = object(
        json!({"name": {"type": "string"}, "offset": {"type": "integer"}, "type": {"type": "integer"}}),
    );
    json!({
        "timestamp": stamp_schema(), "frame_id": {"type": "string"}, "pose": placed_schema(), "point_stride": {"type": "integer"},
        "fields": {"type": "array", "items": field}, "data": {"type": "string", "contentEncoding": "base64"},
    })
}

fn grid_schema() -> Value {
    let field = object(
        json!({"name": {"type": "string"}, "offset": {"type": "integer"}, "type": {"type": "integer"}}),
    );
    json!({
        "timestamp": stamp_schema(), "frame_id": {"type": "string"}, "pose": placed_schema(),
        "column_count": {"type": "integer"}, "cell_size": numbers(&["x", "y"]),
        "row_stride": {"type": "integer"}, "cell_stride": {"type": "integer"},
        "fields": {"type": "array", "items": field}, "data": {"type": "string", "contentEncoding": "base64"},
    })
}
