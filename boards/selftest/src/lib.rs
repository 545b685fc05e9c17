//! What a board measures and proves itself by; no firmware needs it.
//!
//! - [`pairs`]: one match after the other, without odometry, for `bench`.
//! - [`hash`]: all poses of a run as one number.
//! - `demo`: a lidar that is simulated on the board, and `simulated`, which joins it to the firmware's loop (feature `demo`).
//! - `checks`: what a board checks about itself, for tests on the target (feature `demo`).
#![no_std]

#[cfg(feature = "demo")]
pub mod checks;
#[cfg(feature = "demo")]
pub mod demo;
pub mod hash;
pub mod pairs;
#[cfg(feature = "demo")]
pub mod simulated;
