//! Iterative closest point, for scans of one lidar: [`projective`], fast and in integers, and [`modular`], with every
//! stage a choice.

pub mod modular;
pub mod projective;

pub use projective::{IcpConfig, Line, Reference, Search, align, align_observed, smooth_towards};
