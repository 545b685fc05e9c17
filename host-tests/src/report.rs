//! What a run leaves behind: pictures, scores, pose hashes, tracks and MCAP files.

#[cfg(not(target_family = "wasm"))]
pub mod foxglove;
#[cfg(not(target_family = "wasm"))]
pub mod live;
#[cfg(not(target_family = "wasm"))]
pub mod mcap;
#[cfg(not(target_family = "wasm"))]
pub mod picture;
pub mod relations;
#[cfg(not(target_family = "wasm"))]
pub mod ros;
#[cfg(not(target_family = "wasm"))]
pub mod rosbag;
#[cfg(not(target_family = "wasm"))]
pub mod run;
#[cfg(not(target_family = "wasm"))]
pub mod sample;
pub mod scene;
pub mod score;
#[cfg(not(target_family = "wasm"))]
pub mod terminal;
#[cfg(not(target_family = "wasm"))]
pub mod track;

pub use beamfix_selftest::hash;
