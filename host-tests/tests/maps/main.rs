//! Grids, fields, beam models, and where a robot is in a map.

mod beam_model;
#[path = "../common/mod.rs"]
mod common;
mod fields;
mod grid;
mod localization;
mod presence;
