//! Host side of beamfix: simulator, readers, pictures.

pub mod sim;
