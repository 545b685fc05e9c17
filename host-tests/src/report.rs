//! What a run leaves behind: pictures, scores, pose hashes, tracks and MCAP files.

pub mod mcap;
pub mod picture;
pub mod relations;
pub mod rosbag;
pub mod run;
pub mod sample;
pub mod scene;
pub mod score;
pub mod terminal;
pub mod track;

pub use beamfix_selftest::hash;
