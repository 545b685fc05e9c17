//! A board's telemetry as ROS 2 topics, and the robot's wheels back to the board.
//!
//! ```text
//! board ─▶ convert ─▶ message ─▶ dds ─▶ /odom /tf /tf_static /scan /diagnostics; in a map /pose, /map
//!                             node ─▶ dds ─▶ ros_discovery_info
//! board ◀──────────── wheels ◀── dds ◀─ /wheel_odom
//! ```
//!
//! A crate of its own, so that the tool builds without DDS.

pub mod clock;
pub mod convert;
pub mod dds;
pub mod message;
pub mod node;
pub mod sweep;
