//! Host side of beamfix: file formats, the emulated boards, reports, and the pipeline on a PC.

#[cfg(not(target_family = "wasm"))]
pub mod board;
#[cfg(not(target_family = "wasm"))]
pub mod bringup;
pub mod decode;
pub mod formats;
#[cfg(not(target_family = "wasm"))]
pub mod golden;
#[cfg(not(target_family = "wasm"))]
pub mod learn;
pub mod mapping;
pub mod matcher;
#[cfg(not(target_family = "wasm"))]
pub mod particles;
pub mod pipeline;
#[cfg(not(target_family = "wasm"))]
pub mod regress;
pub mod report;
pub mod shared;
pub mod size;
#[cfg(not(target_family = "wasm"))]
pub mod tuning;
#[cfg(not(target_family = "wasm"))]
pub mod watch;
