//! MCAP files with Foxglove's schemas in JSON: open them in Foxglove or Lichtblick.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use anyhow::{Context, Result};
use beamfix::geometry::{Point, Pose};
use mcap::records::MessageHeader;
use serde_json::Value;

use super::foxglove::{self, Kind};
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
        let mut channel = |topic: &str, kind: Kind| -> Result<u16> {
            let schema = kind.schema().to_string();
            let id = writer.add_schema(kind.name(), foxglove::SCHEMA, schema.as_bytes())?;
            Ok(writer.add_channel(id, topic, foxglove::MESSAGE, &Default::default())?)
        };
        let clouds = channel("/points", Kind::Cloud)?;
        let transforms = channel("/tf", Kind::Transform)?;
        let maps = channel("/map", Kind::Grid)?;
        let poses = poses
            .iter()
            .map(|pose| {
                let id = channel(&format!("/pose/{pose}"), Kind::Pose)?;
                Ok(((*pose).to_owned(), id))
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
        self.write(
            self.clouds,
            seconds,
            &foxglove::cloud(seconds, points_in_robot),
        )?;
        let channels: Vec<u16> = self.poses.iter().map(|(_, id)| *id).collect();
        for (&pose, channel) in poses_in_map.iter().zip(channels) {
            self.write(channel, seconds, &foxglove::pose(seconds, pose))?;
        }
        if let Some(&pose) = poses_in_map.first() {
            self.write(
                self.transforms,
                seconds,
                &foxglove::transform(seconds, pose),
            )?;
        }
        Ok(())
    }

    /// Writes what was seen as a map: 0 free, 100 occupied, 255 unknown.
    pub fn push_map(&mut self, map: &Map) -> Result<()> {
        self.write(self.maps, self.last, &foxglove::grid(self.last, map))
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
