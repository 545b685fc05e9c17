//! Whole drives, simulated and recorded, from bytes to poses.

#[path = "../common/mod.rs"]
mod common;
mod golden;
mod interrupted;
mod pipeline;
mod replay;
mod simulate;
mod soak;
mod sparse;
