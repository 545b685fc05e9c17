#!/usr/bin/env bash
# The Rust crate mavlink fills flags left to Default with their first flag: a default heartbeat says "armed".
#
# Whoever sends a HEARTBEAT beside a lidar's messages sets its type and leaves the rest to `..Default::default()`. The guess
# before running it: the rest is 0, as the fields of an embedded message are everywhere else, and flags are empty.
# Seen: numbers are 0, but a set of flags is the first flag of its list: base_mode is SAFETY_ARMED (128), SYS_STATUS tells a
# present, enabled and healthy gyroscope, ESTIMATOR_STATUS a good attitude, a position target ignores x. Enumerations are
# their first value too, which for ODOMETRY's frames is MAV_FRAME_GLOBAL, and its quaternion is 0 0 0 0.
# For who writes a companion in Rust: name all fields. Our heartbeat sets its flags empty.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "default-heartbeat"
version = "0.1.0"
edition = "2021"

[dependencies]
mavlink = { version = "=0.21.0", default-features = false, features = ["std", "dialect-common", "mav2-message-extensions"] }

[workspace]
TOML
cat > src/main.rs <<'RUST'
use mavlink::dialects::common::*;
use mavlink::{MavHeader, write_v2_msg};

fn main() {
    let heartbeat = HEARTBEAT_DATA { mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER, ..Default::default() };
    let mut wire = Vec::new();
    write_v2_msg(&mut wire, MavHeader::default(), &MavMessage::HEARTBEAT(heartbeat)).unwrap();
    let base_mode = wire[10 + 6];
    println!("HEARTBEAT's base_mode on the wire: {base_mode}");
    let status = SYS_STATUS_DATA::default().onboard_control_sensors_health.bits();
    let estimator = ESTIMATOR_STATUS_DATA::default().flags.bits();
    let target = SET_POSITION_TARGET_LOCAL_NED_DATA::default().type_mask.bits();
    println!("SYS_STATUS health {status}, ESTIMATOR_STATUS flags {estimator}, SET_POSITION_TARGET_LOCAL_NED type_mask {target}");
    let odometry = ODOMETRY_DATA::default();
    println!("ODOMETRY: {:?}, q {:?}", odometry.frame_id, odometry.q);
    if (base_mode, status, estimator, target) != (128, 1, 1, 1) || odometry.frame_id != MavFrame::MAV_FRAME_GLOBAL {
        println!("it behaves otherwise now");
        std::process::exit(1);
    }
}
RUST
echo "mavlink 0.21.0, $(rustc --version)"
CARGO_TARGET_DIR="$folder/target" cargo run --quiet
