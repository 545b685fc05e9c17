//! Every lidar on the simulated robot: bytes, driver, odometry, pose.

use std::path::Path;
use std::process::Command;

use beamfix::lidar::Model;
use serde_json::Value;

/// What each of them may be off after a minute (m, °).
const ALLOWED: (f64, f64) = (0.05, 1.0);

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "a minute's drive for each of thirty sensors"
)]
fn every_lidar_finds_its_way() {
    let out = std::env::temp_dir().join(format!("beamfix-lidars-{}", std::process::id()));
    let mut too_far = Vec::new();
    for model in Model::ALL {
        let run = Command::new(env!("CARGO_BIN_EXE_beamfix"))
            .args([
                "simulate",
                "--lidar",
                model.name,
                "--seconds",
                "60",
                "--json",
                "--out",
            ])
            .arg(&out)
            .output()
            .expect("started");
        let errors = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{}: {errors}", model.name);
        let report: Value = serde_json::from_slice(&run.stdout).expect("one JSON object");
        let number = |key: &str| report[key].as_f64().expect("number");
        let (metres, degrees) = (number("final_error_m"), number("final_error_deg"));
        println!(
            "{:<18} {:>5.1} cm {degrees:>6.2}°",
            model.name,
            100.0 * metres
        );
        if metres > ALLOWED.0 || degrees > ALLOWED.1 {
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

/// Runs the tool; gives its JSON.
fn tool(arguments: &[&str]) -> Value {
    let run = Command::new(env!("CARGO_BIN_EXE_beamfix"))
        .args(arguments)
        .output()
        .expect("started");
    let errors = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{arguments:?}: {errors}");
    serde_json::from_slice(&run.stdout).expect("one JSON object")
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
        let there = tool(&[
            "simulate",
            "--lidar",
            lidar,
            "--seconds",
            "6",
            "--json",
            "--out",
            &folder,
        ]);
        let here = tool(&["replay", &recording, "--json", "--trajectory", &replayed]);
        assert_eq!(here["pose_hash"], there["pose_hash"], "{lidar}");
        assert!(here["scans"].as_u64() > Some(20), "{lidar}");
        assert_eq!(
            poses(&out.join("trajectory.txt")),
            poses(&out.join("replayed.txt")),
            "{lidar}"
        );
        // The recording names its sensor.
        let decoded = tool(&["decode", "--lidar", "auto", &recording, "--json"]);
        assert_eq!(
            (&decoded["lidar"], &decoded["check_errors"]),
            (&lidar.into(), &0.into())
        );
        std::fs::remove_dir_all(&out).expect("removed");
    }
}
