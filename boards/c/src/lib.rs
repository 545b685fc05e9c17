//! beamfix for C and C++.
//!
//! ```text
//! map        mapping, and its map drawn
//! lidars     one static a lidar: its model, and the functions of its protocol
//! object     the caller's memory: a pipeline, and the odometry or the localization behind it
//! place      large values made where they stay
//! task       what a pipeline's estimator does, whichever it is
//! startup    what a lidar must be sent before it measures
//! types      what passes between C and Rust
//! ```
//!
//! Everything goes through [`Pipeline`](beamfix_core::Pipeline), as on every other board. The only `unsafe` code of the project
//! besides the boards' registers is here, because a C caller hands over plain pointers.
// A fuzzer has a panic handler of its own.
#![cfg_attr(not(fuzzing), no_std)]

mod lidars;
mod map;
mod object;
mod panic;
mod place;
mod startup;
mod task;
mod types;

pub use lidars::*;
pub use map::*;
pub use object::*;
pub use startup::*;
pub use types::*;
