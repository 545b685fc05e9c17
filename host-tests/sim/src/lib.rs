//! A robot with a lidar in a world of lines and circles: the same bits in every run on every machine.
//!
//! `f64`, the four operations, square roots and `libm`'s functions; random numbers from a seeded ChaCha.
//!
//! ```text
//! scenes ─▶ World ─▶ lidar ─▶ echoes ─▶ encoder ─▶ bytes
//!                    robot ─▶ truth, wheel odometry
//! ```

pub mod drive;
pub mod encoder;
pub mod home;
pub mod lidar;
pub mod noise;
pub mod pose;
pub mod robot;
pub mod scenes;
pub mod world;

pub use drive::{Drive, Moment, Settings, drive};
pub use lidar::{Ranging, Still};
pub use noise::Noise;
pub use pose::TruePose;
pub use world::World;
