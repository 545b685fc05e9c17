//! Grids, fields, beam models, where a robot is in a map, and maps made by SLAM.

mod beam_model;
#[path = "../common/mod.rs"]
mod common;
mod fields;
mod golden;
mod grid;
mod localization;
mod particles;
mod presence;
mod slam;
