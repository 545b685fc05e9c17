//! What is published: messages, their topics, types and quality of service.

use anyhow::Result;
use host_tests::report::ros::cdr;
use host_tests::report::ros::message::{
    Diagnostics, Estimate, LaserScan, OccupancyGrid, Odometry, Transform,
};

/// A message for ROS 2.
#[derive(Debug, Clone)]
pub enum Message {
    /// Where the robot is by odometry.
    Odometry(Box<Odometry<'static>>),
    /// Where it is in the map.
    Pose(Box<Estimate<'static>>),
    /// What moves.
    Transforms(Vec<Transform<'static>>),
    /// The lidar on the robot.
    Mount(Transform<'static>),
    /// A revolution.
    Scan(LaserScan<'static>),
    /// The map that a file holds.
    Map(OccupancyGrid<'static>),
    /// How the board and its lidar are.
    Diagnostics(Diagnostics<'static>),
}

/// How a topic's messages are delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// A lost one is not sent again: sensor data.
    BestEffort,
    /// A lost one is sent again.
    Reliable,
    /// Who comes later gets the last one: "transient local".
    Latched,
}

/// A topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    /// As `ros2 topic list` shows it.
    pub name: &'static str,
    /// As `ros2 topic type` shows it.
    pub kind: &'static str,
    /// Quality of service.
    pub delivery: Delivery,
}

/// All topics; [`Message::index`] says which one is whose.
pub const TOPICS: [Topic; 7] = [
    topic("/odom", "nav_msgs/msg/Odometry", Delivery::Reliable),
    topic(
        "/pose",
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        Delivery::Reliable,
    ),
    topic("/tf", "tf2_msgs/msg/TFMessage", Delivery::Reliable),
    topic("/tf_static", "tf2_msgs/msg/TFMessage", Delivery::Latched),
    topic("/scan", "sensor_msgs/msg/LaserScan", Delivery::BestEffort),
    topic("/map", "nav_msgs/msg/OccupancyGrid", Delivery::Latched),
    topic(
        "/diagnostics",
        "diagnostic_msgs/msg/DiagnosticArray",
        Delivery::Reliable,
    ),
];

const fn topic(name: &'static str, kind: &'static str, delivery: Delivery) -> Topic {
    Topic {
        name,
        kind,
        delivery,
    }
}

impl Message {
    /// Of its topic in [`TOPICS`].
    #[must_use]
    pub fn index(&self) -> usize {
        match self {
            Self::Odometry(_) => 0,
            Self::Pose(_) => 1,
            Self::Transforms(_) => 2,
            Self::Mount(_) => 3,
            Self::Scan(_) => 4,
            Self::Map(_) => 5,
            Self::Diagnostics(_) => 6,
        }
    }

    /// In little-endian CDR, without the four bytes that say so.
    pub fn cdr(&self) -> Result<Vec<u8>> {
        match self {
            Self::Odometry(message) => cdr(message),
            Self::Pose(message) => cdr(message),
            Self::Transforms(transforms) => cdr(transforms),
            Self::Mount(transform) => cdr(&[transform].as_slice()),
            Self::Scan(message) => cdr(message),
            Self::Map(message) => cdr(message),
            Self::Diagnostics(message) => cdr(message),
        }
    }
}

/// A topic's name in DDS, as ROS 2 mangles it.
#[must_use]
pub fn dds_topic(name: &str) -> String {
    format!("rt/{}", name.trim_start_matches('/'))
}

/// A type's name in DDS, as ROS 2 mangles it.
#[must_use]
pub fn dds_type(kind: &str) -> String {
    match kind.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => kind.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_mangled_as_ros_2_does() {
        assert_eq!(dds_topic("/odom"), "rt/odom");
        assert_eq!(dds_topic("robot/odom"), "rt/robot/odom");
        let kinds: Vec<String> = TOPICS.iter().map(|topic| dds_type(topic.kind)).collect();
        assert_eq!(
            kinds,
            [
                "nav_msgs::msg::dds_::Odometry_",
                "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_",
                "tf2_msgs::msg::dds_::TFMessage_",
                "tf2_msgs::msg::dds_::TFMessage_",
                "sensor_msgs::msg::dds_::LaserScan_",
                "nav_msgs::msg::dds_::OccupancyGrid_",
                "diagnostic_msgs::msg::dds_::DiagnosticArray_",
            ]
        );
    }
}
