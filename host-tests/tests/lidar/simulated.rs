//! Every lidar on the simulated robot: bytes, driver, odometry, pose.

use std::path::Path;

use crate::common::tool::{beamfix, json, text};
use beamfix::lidar::Model;

/// Drives every lidar for a minute; each may end so far off (m, °).
fn all_drive(prior: &str, allowed: (f64, f64)) {
    let out = std::env::temp_dir().join(format!("beamfix-lidars-{prior}-{}", std::process::id()));
    let mut too_far = Vec::new();
    for model in Model::ALL {
        println!("{}", model.name);
        let report = json(&beamfix(&[
            "simulate",
            "--lidar",
            model.name,
            "--prior",
            prior,
            "--seconds",
            "60",
            "--json",
            "--out",
            text(&out),
        ]));
        let number = |key: &str| report[key].as_f64().expect("number");
        let (metres, degrees) = (number("final_error_m"), number("final_error_deg"));
        println!(
            "{:<18} {:>5.1} cm {degrees:>6.2}°",
            model.name,
            100.0 * metres
        );
        if metres > allowed.0 || degrees > allowed.1 {
            too_far.push(model.name);
        }
        assert!(
            number("distance_m") > 20.0,
            "{}: it stood still",
            model.name
        );
    }
    std::fs::remove_dir_all(&out).expect("removed");
    assert!(too_far.is_empty(), "{too_far:?}");
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "a minute's drive for each of thirty sensors"
)]
fn every_lidar_finds_its_way() {
    all_drive("odometry", (0.05, 1.0));
}

/// Without wheels a sensor of 5 turns a second sees a hard turn only when it has begun.
#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "a minute's drive for each of thirty sensors"
)]
fn every_lidar_finds_its_way_without_wheels() {
    all_drive("none", (0.10, 3.5));
}

/// Without the time stamps, of which the sensor's own clock knows another zero.
fn poses(file: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(file).expect("written");
    let pose = |line: &str| line.split_once(' ').expect("stamp and pose").1.to_owned();
    text.lines().map(pose).collect()
}

#[test]
fn a_recorded_drive_replays_to_the_same_poses() {
    // With a clock, with 3200 beams a turn, without a clock, and in text.
    for lidar in ["ld06", "rplidar-dense", "xv11", "scip"] {
        let out =
            std::env::temp_dir().join(format!("beamfix-record-{}-{lidar}", std::process::id()));
        let file = |name: &str| out.join(name).to_str().expect("UTF-8").to_owned();
        let (folder, recording, replayed) = (file(""), file("lidar.rec"), file("replayed.txt"));
        let there = json(&beamfix(&[
            "simulate",
            "--lidar",
            lidar,
            "--seconds",
            "6",
            "--json",
            "--out",
            &folder,
        ]));
        let here = json(&beamfix(&[
            "replay",
            &recording,
            "--json",
            "--trajectory",
            &replayed,
        ]));
        assert_eq!(here["pose_hash"], there["pose_hash"], "{lidar}");
        assert!(here["scans"].as_u64() > Some(20), "{lidar}");
        assert_eq!(
            poses(&out.join("trajectory.txt")),
            poses(&out.join("replayed.txt")),
            "{lidar}"
        );
        // The recording names its sensor.
        let decoded = json(&beamfix(&[
            "decode", "--lidar", "auto", &recording, "--json",
        ]));
        assert_eq!(
            (&decoded["lidar"], &decoded["check_errors"]),
            (&lidar.into(), &0.into())
        );
        std::fs::remove_dir_all(&out).expect("removed");
    }
}
