//! What is on the line? From a second of bytes: the sensor's family, and plain words where something is wrong.
//!
//! Every family's frames are looked for; check codes tell them apart, and what they leave open (two packings of one
//! capsule, models of one family) the measurements do. Costs some passes over the bytes; meant for start-up and for
//! finding faults, not for every day.

mod finding;
mod hints;
mod refine;
mod search;

#[cfg(feature = "internals")]
pub use crate::lidar::wire::survey::Survey;
#[cfg(not(feature = "internals"))]
pub(crate) use crate::lidar::wire::survey::Survey;
pub use finding::{Finding, identify};
pub use hints::{Hint, hints};
#[cfg(feature = "internals")]
pub use search::survey_model;
#[cfg(not(feature = "internals"))]
pub(crate) use search::survey_model;

/// Line speeds at which to listen, the commonest first (bits/s).
pub const BAUDS: [u32; 8] = [
    115_200, 230_400, 128_000, 256_000, 460_800, 921_600, 1_000_000, 512_000,
];
