//! Iterative closest point, for scans of one lidar: [`projective`], fast and in integers, and [`modular`], with every
//! stage a choice.

#[cfg(not(feature = "modular"))]
pub(crate) mod modular;
#[cfg(feature = "modular")]
pub mod modular;
#[cfg(not(feature = "internals"))]
pub(crate) mod projective;
#[cfg(feature = "internals")]
pub mod projective;

pub use projective::{IcpConfig, Line, Reference, Search, align, align_observed, smooth_towards};
