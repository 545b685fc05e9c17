//! Host side of beamfix: simulator, readers, pictures.

pub mod board;
pub mod decode;
pub mod golden;
pub mod hash;
pub mod learn;
pub mod map_file;
pub mod matcher;
pub mod picture;
pub mod pipeline;
pub mod readers;
pub mod recording;
pub mod score;
pub mod shared;
pub mod size;
pub mod telemetry_file;
pub mod timed;
pub mod watch;
