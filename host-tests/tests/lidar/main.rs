//! Drivers on bytes: recorded, constructed, simulated and damaged.

#[path = "../common/mod.rs"]
mod common;
mod encoders;
mod faults;
mod golden;
mod identify;
mod noise;
mod simulated;
mod vectors;
