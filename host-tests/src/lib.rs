//! Host side of beamfix: simulator, readers, pictures.
