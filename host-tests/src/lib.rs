//! Host side of beamfix: file formats, the emulated boards, reports, and the pipeline on a PC.

pub mod board;
pub mod decode;
pub mod formats;
pub mod golden;
pub mod learn;
pub mod mapping;
pub mod matcher;
pub mod pipeline;
pub mod regress;
pub mod report;
pub mod shared;
pub mod size;
pub mod tuning;
pub mod watch;
