//! The firmware: its protocol, its supervision, and the emulated boards that run it.

mod bench;
mod bits;
mod c;
mod card;
#[path = "../common/mod.rs"]
mod common;
mod demo;
mod fields;
mod lidar_cost;
mod mavlink;
mod on_target;
mod readme;
mod supervisor;
mod telemetry;
mod text;
mod trouble;
mod uart;
