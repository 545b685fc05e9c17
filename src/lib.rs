//! From the bytes of a cheap laser rangefinder to a trustworthy pose, on a microcontroller.
//!
//! ```text
//! bytes ─▶ packet ─▶ beams ─▶ scan ─▶ points ─▶ match ─▶ pose
//!       lidar::*          scan               matching    odometry
//! ```
//!
//! Every arrow is a function that can be called and tested alone. Nothing here does I/O, allocates, waits,
//! keeps a `static` or panics; the same source gives the same bits on a PC and on a Cortex-M0.
//!
//! Frames and units: x forward, y left, angles counter-clockwise; metres, radians, seconds in `f32` at
//! the public doors. Inside, ranges and points are whole millimetres, bearings a 65536th of a turn.
#![no_std]
#![forbid(unsafe_code)]

pub mod config;
pub mod geometry;
pub mod grid;
pub mod keyframe;
pub mod lidar;
pub mod linalg;
pub mod localization;
pub mod matching;
pub mod math;
pub mod odometry;
pub mod pipeline;
pub mod scan;
pub mod sensor_model;

/// The README's example compiles.
#[cfg(all(doctest, feature = "embedded-io"))]
#[doc = include_str!("../README.md")]
struct Readme;
