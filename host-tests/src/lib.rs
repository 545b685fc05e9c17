//! Host side of beamfix: simulator, readers, pictures.

pub mod readers;
pub mod sim;
