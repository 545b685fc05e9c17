//! The three messages that are read: `sensor_msgs/LaserScan`, `nav_msgs/Odometry`, `tf2_msgs/TFMessage`.

use anyhow::{Result, ensure};
use beamfix_sim::TruePose;

use super::decoder::{Decoder, Layout};

/// What a topic's messages are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `sensor_msgs/LaserScan`.
    Laser,
    /// `nav_msgs/Odometry`.
    Odometry,
    /// `tf2_msgs/TFMessage` of the topic `/tf_static`.
    Static,
}

impl Kind {
    /// The kind of a topic by the name of its type, ROS 1's (`nav_msgs/Odometry`) or ROS 2's; `None` for all others.
    #[must_use]
    pub fn of(type_name: &str, topic: &str) -> Option<Self> {
        match type_name.replace("/msg/", "/").as_str() {
            "sensor_msgs/LaserScan" => Some(Self::Laser),
            "nav_msgs/Odometry" => Some(Self::Odometry),
            "tf2_msgs/TFMessage" if topic.ends_with("tf_static") => Some(Self::Static),
            _ => None,
        }
    }
}

/// Stamp and frame of a message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Header {
    /// Seconds of the stamp.
    pub sec: u32,
    /// Nanoseconds of the stamp.
    pub nanosec: u32,
    /// The frame that the message is in, without a leading slash.
    pub frame: String,
}

impl Header {
    fn read(decoder: &mut Decoder, layout: Layout) -> Result<Self> {
        if layout == Layout::Ros1 {
            // A sequence number.
            decoder.u32()?;
        }
        Ok(Self {
            sec: decoder.u32()?,
            nanosec: decoder.u32()?,
            frame: frame(decoder)?,
        })
    }

    /// The stamp (s).
    #[must_use]
    pub fn seconds(&self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

fn frame(decoder: &mut Decoder) -> Result<String> {
    Ok(decoder.text()?.trim_start_matches('/').to_owned())
}

/// A `LaserScan`.
#[derive(Debug, Clone, PartialEq)]
pub struct Laser {
    /// Stamp of the first beam, and the lidar's frame.
    pub header: Header,
    /// Bearing of the array's first element (rad).
    pub first: f32,
    /// From one element to the next (rad).
    pub step: f32,
    /// From one element to the next (s), as the file says.
    pub time_step: f32,
    /// From one scan to the next (s), as the file says.
    pub scan_time: f32,
    /// Shortest range (m), as the file says.
    pub nearest: f32,
    /// Longest range (m), as the file says.
    pub farthest: f32,
    /// The array (m).
    pub ranges: Vec<f32>,
}

impl Laser {
    /// Reads a message.
    pub fn read(message: &[u8], layout: Layout) -> Result<Self> {
        let mut decoder = Decoder::new(message, layout)?;
        let header = Header::read(&mut decoder, layout)?;
        let (first, _last, step) = (decoder.f32()?, decoder.f32()?, decoder.f32()?);
        ensure!(
            first.is_finite() && step.is_finite(),
            "angles from {first} in steps of {step}"
        );
        let (time_step, scan_time) = (decoder.f32()?, decoder.f32()?);
        let (nearest, farthest) = (decoder.f32()?, decoder.f32()?);
        let count = decoder.count(4)?;
        ensure!(count <= 65_536, "{count} ranges");
        let ranges = (0..count).map(|_| decoder.f32()).collect::<Result<_>>()?;
        Ok(Self {
            header,
            first,
            step,
            time_step,
            scan_time,
            nearest,
            farthest,
            ranges,
        })
    }
}

/// An `Odometry`: the pose of a frame of the robot in a frame of the wheels' own.
#[derive(Debug, Clone, PartialEq)]
pub struct Odometry {
    /// Stamp, and the frame that the pose is in.
    pub header: Header,
    /// The robot's frame.
    pub child: String,
    /// The robot's pose.
    pub pose: TruePose,
}

impl Odometry {
    /// Reads a message.
    pub fn read(message: &[u8], layout: Layout) -> Result<Self> {
        let mut decoder = Decoder::new(message, layout)?;
        let header = Header::read(&mut decoder, layout)?;
        let child = frame(&mut decoder)?;
        let [x, y, _z] = decoder.f64s()?;
        let [qx, qy, qz, qw] = decoder.f64s()?;
        let theta = libm::atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz));
        ensure!(
            x.is_finite() && y.is_finite() && theta.is_finite(),
            "the pose is not finite"
        );
        Ok(Self {
            header,
            child,
            pose: TruePose::new(x, y, theta),
        })
    }
}

/// A transform: where `child` stands in `parent`.
#[derive(Debug, Clone, PartialEq)]
pub struct Transform {
    /// The frame that it is in.
    pub parent: String,
    /// The frame that is placed.
    pub child: String,
    /// Place (m).
    pub translation: [f64; 3],
    /// Attitude as a unit quaternion: x, y, z, w.
    pub rotation: [f64; 4],
}

impl Transform {
    /// Reads a message of several.
    pub fn read_all(message: &[u8], layout: Layout) -> Result<Vec<Self>> {
        let mut decoder = Decoder::new(message, layout)?;
        let count = decoder.count(72)?;
        let mut one = || {
            let header = Header::read(&mut decoder, layout)?;
            let child = frame(&mut decoder)?;
            let translation: [f64; 3] = decoder.f64s()?;
            let rotation: [f64; 4] = decoder.f64s()?;
            let norm = libm::sqrt(rotation.iter().map(|q| q * q).sum());
            ensure!(
                translation.iter().all(|v| v.is_finite()) && norm.is_finite() && norm > 0.5,
                "the transform to {child} is not finite"
            );
            Ok(Self {
                parent: header.frame,
                child,
                translation,
                rotation: rotation.map(|q| q / norm),
            })
        };
        (0..count).map(|_| one()).collect()
    }
}
