//! Host side of beamfix: simulator, readers, pictures.

pub mod decode;
pub mod encoder;
pub mod readers;
pub mod sim;
