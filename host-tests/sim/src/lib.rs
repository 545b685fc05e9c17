//! A robot with a lidar in a world of lines and circles: the same bits in every run on every machine.
//!
//! `f64`, the four operations, square roots and `libm`'s functions; random numbers from a seeded ChaCha.
//!
//! ```text
//! scenes ─▶ World ─▶ lidar ─▶ echoes ─▶ encoder ─▶ bytes
//!                    robot ─▶ truth, wheel odometry
//! catalogue ─▶ Scene: world, things that move, course, sensor, wheels ─▶ revolutions of beams, wheels, truth
//! ```

pub mod catalogue;
pub mod course;
pub mod drive;
pub mod encoder;
pub mod home;
pub mod lidar;
pub mod noise;
pub mod place;
pub mod pose;
pub mod ring;
pub mod robot;
pub mod scene;
pub mod scenes;
pub mod sensor;
pub mod spaces;
pub mod things;
pub mod view;
pub mod wheels;
pub mod world;

pub use course::Course;
pub use drive::{Drive, Moment, Settings, Underway, drive, drive_in};
pub use lidar::{Ranging, Still};
pub use noise::Noise;
pub use place::Place;
pub use pose::TruePose;
pub use scene::{Revolution, Scene};
pub use world::World;
