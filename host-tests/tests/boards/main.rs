//! The firmware: its protocol, its supervision, and the emulated boards that run it.

mod bench;
mod bits;
mod c;
mod card;
mod chosen;
#[path = "../common/mod.rs"]
mod common;
mod demo;
mod every_lidar;
mod fields;
mod flood;
mod lidar_cost;
mod localize;
mod mavlink;
mod mavlink_rules;
mod on_target;
mod python_link;
mod readme;
mod supervisor;
mod telemetry;
mod text;
mod tiers;
mod trouble;
mod uart;
