//! Recordings as they are in the world: how they are read, what is said about them, how a replay ends.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use beamfix_sim::lidar::Ranging;
use beamfix_sim::{Noise, TruePose, World, scenes};
use host_tests::shared;
use serde_json::Value;

use crate::common::bag::{Bag, Scanner};
use crate::common::tool::{beamfix, folder, json, text};

/// Beams of a scan.
const BEAMS: usize = 360;
/// From one scan to the next (s).
const PERIOD: f64 = 0.1;

/// A full turn of beams, counter-clockwise from behind.
const SCANNER: Scanner = Scanner {
    frame: "laser",
    first: -PI,
    step: TAU / BEAMS as f64,
    time_step: 0.0,
    scan_time: 0.0,
    nearest: 0.05,
    farthest: 2.5,
};

/// The robot after `seconds`: half a metre a second on a circle of a metre, with a turn rate that swings.
fn truth(seconds: f64) -> TruePose {
    let along = 0.4 * seconds + 0.1 * (1.3 * seconds).sin();
    TruePose::new(-0.5, -0.5, 0.0).along_arc(along, along)
}

/// What the lidar sees of the room in the scan that starts at `start`, beam after beam `step` seconds apart, in the
/// order of measurement; clockwise if `backwards`.
fn scan(world: &World, farthest: f64, start: f64, step: f64, backwards: bool) -> Vec<Option<f64>> {
    let mut noise = Noise::new(3, (start * 1000.0) as u64);
    let ranging = Ranging {
        sigma: 0.005,
        nearest: 0.05,
        farthest,
        ..Ranging::DEFAULT
    };
    (0..BEAMS)
        .map(|k| {
            let element = if backwards { BEAMS - 1 - k } else { k };
            let bearing = SCANNER.first + SCANNER.step * element as f64;
            let place = truth(start + step * k as f64);
            let mm = ranging.measure(world, place, bearing, &mut noise)?;
            Some(mm.round() / 1000.0)
        })
        .collect()
}

/// Sixty scans at one moment each, with wheels that are right.
fn still_scans() -> Vec<(f64, TruePose, Vec<Option<f64>>)> {
    let world = scenes::room();
    let scans = (0..60).map(|k| {
        let time = 10.0 + PERIOD * k as f64;
        let start = PERIOD * k as f64;
        // Farther ranges would be too near the stated limit to be told from it.
        (time, truth(start), scan(&world, 2.45, start, 0.0, false))
    });
    scans.collect()
}

/// Those scans as a bag, each range that there is not written as `none`.
fn bag(scanner: &Scanner, none: f32) -> Bag {
    let mut bag = Bag::default();
    for (time, pose, ranges) in still_scans() {
        bag.odometry("/odom", "base_link", time, pose);
        let ranges: Vec<f32> = ranges
            .iter()
            .map(|r| r.map_or(none, |r| r as f32))
            .collect();
        bag.laser("/scan", time, scanner, &ranges);
    }
    bag
}

/// Runs `replay FILE … --json` over `content`.
fn replay(path: &Path, content: &[u8], arguments: &[&str]) -> Output {
    fs::write(path, content).expect("the test's file");
    beamfix(&[&["replay", text(path), "--json"], arguments].concat())
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn last_pose(result: &Value) -> TruePose {
    let number = |key: &str| result["last_pose"][key].as_f64().expect("a number");
    TruePose::new(number("x"), number("y"), number("theta"))
}

/// How far two poses are apart (m, degrees).
fn apart(one: TruePose, other: TruePose) -> (f64, f64) {
    let off = one.between(other);
    (off.distance(), off.theta.to_degrees().abs())
}

#[test]
fn no_return_is_told_however_a_bag_writes_it() {
    let dir = folder("no-return");
    let limits = |farthest: f32| Scanner {
        farthest,
        ..SCANNER
    };
    let right = json(&replay(
        &dir.join("inf.mcap"),
        &bag(&SCANNER, f32::INFINITY).mcap(None),
        &[],
    ));
    assert_eq!(
        (&right["refused"], &right["bad_readings"]),
        (&0.into(), &0.into())
    );
    let (metres, degrees) = apart(truth(0.0).between(truth(59.0 * PERIOD)), last_pose(&right));
    assert!(metres < 0.02 && degrees < 0.5, "{metres} m, {degrees}°");
    //   name            scanner        what is written for no return
    for (name, scanner, none) in [
        ("limit", SCANNER, 2.5),
        ("below-limit", SCANNER, 2.499),
        ("zero", SCANNER, 0.0),
        ("nan", SCANNER, f32::NAN),
        ("too-near", SCANNER, f32::NEG_INFINITY),
        ("limit-of-0", limits(0.0), f32::INFINITY),
        ("limit-nan", limits(f32::NAN), f32::INFINITY),
        ("other-limit", limits(25.0), 2.6),
    ] {
        let path = dir.join(format!("{name}.mcap"));
        let result = json(&replay(&path, &bag(&scanner, none).mcap(None), &[]));
        assert_eq!(result["pose_hash"], right["pose_hash"], "{name}");
        let near = name == "too-near";
        assert_eq!(
            result["too_near_readings"].as_u64() > Some(0),
            near,
            "{name}"
        );
        assert_eq!(
            result["bad_readings"].as_u64() > Some(0),
            name == "nan",
            "{name}"
        );
    }
}

#[test]
fn no_return_is_told_however_a_carmen_log_writes_it() {
    let dir = folder("no-return-carmen");
    let log = |none: &str| -> String {
        let line = |(time, pose, ranges): &(f64, TruePose, Vec<Option<f64>>)| {
            let words: Vec<String> = ranges[90..271]
                .iter()
                .map(|r| r.map_or(none.into(), |r| r.to_string()))
                .collect();
            let TruePose { x, y, theta } = pose;
            let pose = format!("{x} {y} {theta}");
            format!("FLASER 181 {} {pose} {pose} {time} h 0\n", words.join(" "))
        };
        still_scans().iter().map(line).collect()
    };
    let right = json(&replay(&dir.join("0.log"), log("0").as_bytes(), &[]));
    for none in ["81.91", "8.19", "5.6", "inf", "32.0", "50"] {
        let path = dir.join(format!("{none}.log"));
        let result = json(&replay(&path, log(none).as_bytes(), &[]));
        assert_eq!(result["pose_hash"], right["pose_hash"], "{none}");
    }
}

#[test]
fn the_order_of_a_scans_beams_is_found_out() {
    let dir = folder("order");
    let (world, step) = (scenes::room(), PERIOD / BEAMS as f64);
    let bag = |backwards: bool, is_reversed: bool, time_step: f64, scan_time: f64| {
        let mut bag = Bag::default();
        let scanner = Scanner {
            first: if backwards && !is_reversed {
                PI - SCANNER.step
            } else {
                SCANNER.first
            },
            step: if backwards && !is_reversed {
                -SCANNER.step
            } else {
                SCANNER.step
            },
            time_step,
            scan_time,
            farthest: 12.0,
            ..SCANNER
        };
        for k in 0..60 {
            let mut ranges = scan(&world, 11.0, PERIOD * k as f64, step, backwards);
            if is_reversed {
                ranges.reverse();
            }
            let ranges: Vec<f32> = ranges.iter().map(|r| r.map_or(0.0, |r| r as f32)).collect();
            // The stamp of a negative step is that of the first element, the last one in time.
            let late = if time_step < 0.0 { PERIOD - step } else { 0.0 };
            bag.laser("/scan", 10.0 + PERIOD * k as f64 + late, &scanner, &ranges);
        }
        bag.mcap(None)
    };
    let right = json(&replay(
        &dir.join("in-order.mcap"),
        &bag(true, false, step, PERIOD),
        &[],
    ));
    let (metres, degrees) = apart(
        truth(PERIOD).between(truth(60.0 * PERIOD)),
        last_pose(&right),
    );
    // Without wheels.
    assert!(metres < 0.05 && degrees < 1.5, "{metres} m, {degrees}°");
    //   name                  clockwise reversed  time_increment  scan_time  said
    for (name, backwards, reversed, time_step, scan_time, said) in [
        (
            "counter-clockwise",
            false,
            false,
            step,
            PERIOD,
            "beams in order",
        ),
        ("as-drivers", true, true, step, PERIOD, "beams reversed: so"),
        ("by-definition", true, true, -step, PERIOD, "beams reversed"),
    ] {
        let path = dir.join(format!("{name}.mcap"));
        let output = replay(&path, &bag(backwards, reversed, time_step, scan_time), &[]);
        let off = apart(last_pose(&right), last_pose(&json(&output)));
        // Another lidar, whose scans begin elsewhere and have other noise, only drives the same way.
        let allowed = if backwards { (0.02, 0.3) } else { (0.05, 1.5) };
        assert!(
            off.0 < allowed.0 && off.1 < allowed.1,
            "{name}: {off:?}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(said),
            "{name}: {}",
            stderr(&output)
        );
    }
    // Without a stated step, by the time of a scan.
    let output = replay(
        &dir.join("told.mcap"),
        &bag(true, true, 0.0, PERIOD),
        &["--beams", "reversed"],
    );
    let off = apart(last_pose(&right), last_pose(&json(&output)));
    assert!(off.0 < 0.02 && off.1 < 0.3, "told: {off:?}");
    let told = replay(
        &dir.join("told.mcap"),
        &bag(true, true, step, PERIOD),
        &["--beams", "in-order"],
    );
    let off = apart(last_pose(&right), last_pose(&json(&told)));
    assert!(
        off.0 > 0.02 || off.1 > 1.0,
        "the wrong order, as told, bends scans: {off:?}"
    );
}

#[test]
fn one_topic_of_each_kind_is_taken_and_named() {
    let dir = folder("topics");
    let mut bag = bag(&SCANNER, 0.0);
    for (time, pose, _) in still_scans() {
        // The same robot in a frame that is turned, and a lidar that sees nothing.
        let other = TruePose::new(7.0, -3.0, 2.0).then(pose);
        bag.odometry("/odometry/filtered", "base_link", time + 0.01, other);
        bag.laser("/rear/scan_raw", time, &SCANNER, &[f32::INFINITY; BEAMS]);
    }
    let path = dir.join("two.mcap");
    let content = bag.mcap(None);
    let alone = replay(
        &dir.join("one.mcap"),
        &self::bag(&SCANNER, 0.0).mcap(None),
        &[],
    );
    let output = replay(&path, &content, &[]);
    let result = json(&output);
    assert_eq!(result["pose_hash"], json(&alone)["pose_hash"]);
    assert_eq!(result["lidar"], "/scan");
    for words in [
        "scans /scan (not /rear/scan_raw)",
        "wheels /odom (not /odometry/filtered)",
    ] {
        assert!(stderr(&output).contains(words), "{}", stderr(&output));
    }
    let filtered = replay(&path, &content, &["--odom-topic", "odometry/filtered"]);
    assert_eq!(json(&filtered)["refused"], 0);
    assert!(stderr(&filtered).contains("wheels /odometry/filtered (not /odom)"));
    let blind = replay(&path, &content, &["--scan-topic", "/rear/scan_raw"]);
    assert_eq!(blind.status.code(), Some(2));
    assert!(
        stderr(&blind).contains("no beam of 60 scans has a range"),
        "{}",
        stderr(&blind)
    );
    let missing = replay(&path, &content, &["--scan-topic", "/front"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(
        stderr(&missing).contains("/scan /rear/scan_raw"),
        "{}",
        stderr(&missing)
    );
}

#[test]
fn static_transforms_are_the_mount_head_down_too() {
    let dir = folder("mounts");
    let half = (0.5f64).sqrt();
    let centre = json(&replay(
        &dir.join("centre.mcap"),
        &bag(&SCANNER, 0.0).mcap(None),
        &[],
    ));
    //   rotation of the lidar (x, y, z, w)     what the lidar sees of a robot's left   --mount
    for (name, rotation, turned, is_down, mount) in [
        ("behind", [0.0, 0.0, 1.0, 0.0], 180, false, "0,0,180"),
        ("left", [0.0, 0.0, half, half], 90, false, "0,0,90"),
        ("down", [1.0, 0.0, 0.0, 0.0], 0, true, "0,0,0,down"),
        (
            "down-and-behind",
            [0.0, 1.0, 0.0, 0.0],
            180,
            true,
            "0,0,180,down",
        ),
    ] {
        let (mut with, mut without) = (Bag::default(), Bag::default());
        with.fixed("base_link", "plate", [0.0, 0.0, 0.1], [0.0, 0.0, 0.0, 1.0]);
        with.fixed("plate", "laser", [0.0, 0.0, 0.05], rotation);
        for (time, pose, ranges) in still_scans() {
            let of = |k: usize| {
                // The bearing on the robot of the lidar's beam k.
                let own = if is_down { BEAMS - k } else { k };
                ranges[(own + turned) % BEAMS].map_or(0.0, |r| r as f32)
            };
            let seen: Vec<f32> = (0..BEAMS).map(of).collect();
            for bag in [&mut with, &mut without] {
                bag.odometry("/odom", "base_link", time, pose);
                bag.laser("/scan", time, &SCANNER, &seen);
            }
        }
        let path = dir.join(format!("{name}.mcap"));
        let output = replay(&path, &with.mcap(None), &[]);
        let off = apart(last_pose(&centre), last_pose(&json(&output)));
        // Bearings head down are a 65536th of a turn off; a turned lidar begins its scans elsewhere, so other beams
        // become the reference's.
        let allowed = if turned == 0 {
            (0.001, 0.01)
        } else {
            (0.02, 0.5)
        };
        assert!(
            off.0 < allowed.0 && off.1 < allowed.1,
            "{name}: {off:?}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains("by /tf_static, beams"),
            "{}",
            stderr(&output)
        );
        let told = replay(&path, &without.mcap(None), &["--mount", mount]);
        assert_eq!(
            json(&told)["pose_hash"],
            json(&output)["pose_hash"],
            "{name}"
        );
    }
}

#[test]
fn packed_and_cut_bags_are_read() {
    let dir = folder("packed");
    let bag = bag(&SCANNER, 0.0);
    let plain = bag.mcap(None);
    let right = json(&replay(&dir.join("plain.mcap"), &plain, &[]));
    for (name, content) in [
        ("zstd.mcap", bag.mcap(Some(mcap::Compression::Zstd))),
        ("lz4.mcap", bag.mcap(Some(mcap::Compression::Lz4))),
        (
            "file.mcap.zstd",
            zstd::encode_all(&plain[..], 3).expect("memory"),
        ),
    ] {
        let result = json(&replay(&dir.join(name), &content, &[]));
        assert_eq!(result["pose_hash"], right["pose_hash"], "{name}");
        // Also as the folder that rosbag2 makes.
        let inside = dir.join(format!("{name}.bag"));
        fs::create_dir_all(&inside).expect("a folder");
        let file = if name.ends_with("zstd") {
            "x_0.mcap.zstd"
        } else {
            "x_0.mcap"
        };
        fs::write(inside.join(file), &content).expect("written");
        let result = json(&beamfix(&["replay", text(&inside), "--json"]));
        assert_eq!(result["pose_hash"], right["pose_hash"], "{name}");
        // Most of it gives some of the scans, says so, and is no success.
        let trajectory = dir.join("cut.txt");
        let arguments = ["--trajectory", text(&trajectory)];
        let output = replay(
            &dir.join("cut.mcap"),
            &content[..content.len() * 19 / 20],
            &arguments,
        );
        assert_eq!(output.status.code(), Some(2), "{name}");
        let lines = fs::read_to_string(&trajectory)
            .expect("what came before the cut")
            .lines()
            .count();
        assert!(
            (5..60).contains(&lines),
            "{name}: {lines} scans: {}",
            stderr(&output)
        );
    }
    let output = beamfix(&[
        "replay",
        text(&dir.join("plain.mcap").with_extension("")),
        "--json",
    ]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn bags_of_the_python_package_rosbags_are_read() {
    let dir = folder("rosbags");
    let line = |(time, pose, ranges): &(f64, TruePose, Vec<Option<f64>>)| {
        let word = |(k, r): (usize, &Option<f64>)| match r {
            Some(r) if k % 31 != 0 => r.to_string(),
            _ if k % 2 == 0 => "81.91".into(),
            _ => "0".into(),
        };
        let words: Vec<String> = ranges[90..271].iter().enumerate().map(word).collect();
        let TruePose { x, y, theta } = pose;
        let pose = format!("{x} {y} {theta}");
        format!(
            "FLASER 181 {} {pose} {pose} {time:.2} h 0\n",
            words.join(" ")
        )
    };
    let log = dir.join("drive.log");
    let content: String = still_scans().iter().map(line).collect();
    let poses = |path: &Path| -> (Value, Vec<TruePose>) {
        let trajectory = dir.join("poses.txt");
        let arguments = [
            "replay",
            text(path),
            "--json",
            "--trajectory",
            text(&trajectory),
        ];
        let result = json(&beamfix(&arguments));
        let written = fs::read_to_string(&trajectory).expect("written");
        let pose = |line: &str| {
            let n: Vec<f64> = line
                .split(' ')
                .filter_map(|word| word.parse().ok())
                .collect();
            TruePose::new(n[1], n[2], n[3])
        };
        (result, written.lines().map(pose).collect())
    };
    fs::write(&log, content).expect("written");
    let bags = dir.join("bags");
    let _ = fs::remove_dir_all(&bags);
    fs::create_dir_all(&bags).expect("a folder");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tool/make_bags.py");
    let python = std::env::var("BEAMFIX_PYTHON").unwrap_or_else(|_| "python3".into());
    let made = Command::new(python)
        .args([script, text(&log), text(&bags)])
        .output();
    match &made {
        Ok(output) if output.status.success() => {}
        Ok(output) if !stderr(output).contains("No module named") => panic!("{}", stderr(output)),
        _ => {
            println!("left out: python3 has no package rosbags (pip install rosbags)");
            return;
        }
    }
    let (right, right_poses) = poses(&log);
    for name in ["upright", "messages", "file"] {
        let (result, _) = poses(&bags.join(name));
        assert_eq!(result["pose_hash"], right["pose_hash"], "{name}");
        assert_eq!(
            (&result["lidar"], &result["scans"]),
            (&"/scan".into(), &60.into()),
            "{name}"
        );
        assert!(
            result["bad_readings"].as_u64() > Some(0),
            "{name}: readings that are no number"
        );
    }
    let (result, down) = poses(&bags.join("down"));
    assert_eq!(result["mount"]["upside_down"], true);
    for (k, (one, other)) in right_poses.iter().zip(&down).enumerate() {
        let off = apart(*one, *other);
        assert!(off.0 < 0.001 && off.1 < 0.01, "scan {k}: {off:?}");
    }
    assert_eq!(right_poses.len(), down.len());
}

#[test]
fn a_replay_without_a_pose_is_no_success_and_marks_its_guesses() {
    let dir = folder("silent");
    let trajectory = dir.join("t.txt");
    let arguments = ["--trajectory", text(&trajectory)];
    let lines = || -> Vec<String> {
        let written = fs::read_to_string(&trajectory).expect("written");
        written.lines().map(str::to_owned).collect()
    };
    let guesses = || {
        lines()
            .iter()
            .filter(|line| line.ends_with(" # guess"))
            .count()
    };
    let mut covered = Bag::default();
    let mut sparse = Bag::default();
    let mut late = Bag::default();
    for (k, (time, pose, ranges)) in still_scans().into_iter().enumerate() {
        let ranges: Vec<f32> = ranges.iter().map(|r| r.map_or(0.0, |r| r as f32)).collect();
        for bag in [&mut covered, &mut sparse, &mut late] {
            bag.odometry("/odom", "base_link", time, pose);
        }
        covered.laser("/scan", time, &SCANNER, &[0.0; BEAMS]);
        let few: Vec<f32> = (0..BEAMS)
            .map(|k| if k % 90 == 0 { ranges[k] } else { 0.0 })
            .collect();
        sparse.laser("/scan", time, &SCANNER, &few);
        let uncovered = k >= 7;
        late.laser(
            "/scan",
            time,
            &SCANNER,
            if uncovered { &ranges } else { &[0.0; BEAMS] },
        );
    }
    for (name, bag, words) in [
        ("covered", covered, "no beam of 60 scans has a range"),
        (
            "sparse",
            sparse,
            "none of 60 scans became a reference; at most",
        ),
    ] {
        let output = replay(
            &dir.join(format!("{name}.mcap")),
            &bag.mcap(None),
            &arguments,
        );
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(
            stderr(&output).contains(words),
            "{name}: {}",
            stderr(&output)
        );
        let result: Value =
            serde_json::from_slice(&output.stdout).expect("the figures are printed all the same");
        assert_eq!((&result["refused"], guesses()), (&60.into(), 60), "{name}");
        assert!(
            lines().iter().all(|line| line.split(' ').count() == 6),
            "{name}"
        );
    }
    let output = replay(&dir.join("late.mcap"), &late.mcap(None), &arguments);
    assert_eq!((&json(&output)["refused"], guesses()), (&7.into(), 7));
    assert!(
        stderr(&output).contains("7 of 60 poses are guesses"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn what_is_no_log_is_named_with_the_way_to_read_it() {
    let dir = folder("unknown");
    let bytes = drive_bytes();
    let hex: String = bytes[..400]
        .iter()
        .map(|byte| format!("{byte:02x} "))
        .collect();
    for (name, content, words) in [
        (
            "raw.bin",
            &bytes[..20_000],
            &["raw bytes of a lidar", "--lidar ld06"] as &[&str],
        ),
        ("dump.txt", hex.as_bytes(), &["hex dump", "xxd -r -p"]),
        ("x.zip", b"PK\x03\x04\x14\0\0\0", &["zip"]),
        (
            "x.bag",
            b"#ROSBAG V2.0\n",
            &["ROS 1 bag", "rosbags-convert"],
        ),
        ("notes.txt", b"nothing of use\n", &["text", "no FLASER"]),
        (
            "x.mcap",
            &Bag::default().mcap(None),
            &["without a topic of sensor_msgs/msg/LaserScan"],
        ),
    ] {
        let output = replay(&dir.join(name), content, &[]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        for word in words {
            assert!(
                stderr(&output).contains(word),
                "{name}: {}",
                stderr(&output)
            );
        }
        assert_eq!(stderr(&output).trim_end().lines().count(), 1, "{name}");
    }
}

#[test]
fn a_file_without_a_lidars_frames_is_named_by_what_it_is() {
    let dir = folder("without-frames");
    let hex: String = drive_bytes()[..400]
        .chunks(16)
        .map(|row| {
            let bytes: Vec<String> = row.iter().map(|byte| format!("{byte:02x}")).collect();
            format!("00000010: {}  ................\n", bytes.join(""))
        })
        .collect();
    let bag = bag(&SCANNER, 0.0).mcap(None);
    // Archives that hold a capture as it is: its frames are found, and are cut by the archive's own bytes.
    let zip = [&b"PK\x03\x04\x0a\0\0\0\0\0"[..], &drive_bytes()].concat();
    let mut tar = vec![0; 512];
    tar[257..262].copy_from_slice(b"ustar");
    tar.extend(drive_bytes());
    for (name, content, words) in [
        ("stored.zip", &zip[..], "a zip archive"),
        ("x.tar", &tar, "a tar archive"),
        (
            "notes.txt",
            &b"nothing of use\n".repeat(40)[..],
            "it is text in which no lidar's frames are",
        ),
        ("dump.txt", hex.as_bytes(), "xxd -r dump.txt >"),
        (
            "x.log",
            b"FLASER 3 1.0 1.0 1.0 0 0 0\n",
            "it is a CARMEN log",
        ),
        ("x.mcap", &bag, "it is a ROS 2 bag"),
        ("x.bag", b"#ROSBAG V2.0\n", "ROS 1 bag"),
        ("x.png", b"\x89PNG\r\n\x1a\n", "a picture"),
    ] {
        let path = dir.join(name);
        fs::write(&path, content).expect("the test's file");
        for command in ["replay", "decode"] {
            let output = beamfix(&[command, text(&path), "--lidar", "auto"]);
            let said = stderr(&output).replace(&format!("{}/", text(&dir)), "");
            assert_eq!(output.status.code(), Some(2), "{command} {name}");
            assert!(said.contains(words), "{command} {name}: {said}");
            assert_eq!(said.trim_end().lines().count(), 1, "{command} {name}");
        }
    }
}

fn drive_bytes() -> Vec<u8> {
    use beamfix_sim::encoder::ld06::Sensor;
    use beamfix_sim::{Settings, drive};
    let settings = Settings {
        seconds: 5.0,
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06()).bytes
}

#[test]
fn what_is_read_is_never_written_over() {
    let dir = folder("spared");
    let (log, capture) = (dir.join("x.mcap"), dir.join("x.bin"));
    let linked = dir.join("link");
    let _ = fs::remove_file(&linked);
    let content = bag(&SCANNER, 0.0).mcap(None);
    fs::write(&log, &content).expect("written");
    fs::write(&capture, drive_bytes()).expect("written");
    fs::hard_link(&log, &linked).expect("a link");
    let (log, linked, bin) = (text(&log), text(&linked), text(&capture));
    let bag = dir.join("bag");
    fs::create_dir_all(&bag).expect("a folder");
    fs::write(bag.join("x.mcap"), &content).expect("written");
    let inside = bag.join("x.mcap");
    // A map whose picture has the name that the heat map of `field` would get.
    let map = dir.join("m.yaml");
    let yaml = "image: m.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    fs::write(&map, yaml).expect("written");
    fs::write(dir.join("m.png"), "a picture").expect("written");
    let (table, picture) = (dir.join("m.field"), dir.join("m.png"));
    let (map, table, picture) = (text(&map), text(&table), text(&picture));
    for arguments in [
        &["replay", log, "--trajectory", log] as &[&str],
        &["replay", text(&bag), "--trajectory", text(&inside)],
        &[
            "replay",
            log,
            "--mode",
            "localize",
            "--map",
            map,
            "--picture",
            picture,
        ],
        &["field", map, "--out", table],
        &["pairs", log, bin, "--out", bin],
        &["learn", log, "--picture", log],
        &["learn", log, "--keep-map", log],
        &["replay", log, "--trajectory", linked],
        &["decode", "--lidar", "ld06", bin, "--csv", bin],
        &["watch", bin, "--record", bin],
        &["watch", bin, "--quality", bin],
    ] {
        let output = beamfix(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(
            stderr(&output).contains("would be overwritten"),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
    assert_eq!(fs::read(log).expect("still there"), content);
    assert_eq!(fs::read(inside).expect("still there"), content);
    assert_eq!(fs::read(picture).expect("still there"), b"a picture");
    assert_eq!(fs::read(bin).expect("still there"), drive_bytes());
}

#[test]
fn hostile_files_end_in_a_line_and_not_in_memory() {
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;
    let dir = folder("hostile");
    let mut bomb = GzEncoder::new(Vec::new(), Compression::best());
    for _ in 0..200 {
        bomb.write_all(&[0; 1 << 20]).expect("memory");
    }
    let output = replay(
        &dir.join("bomb.log.gz"),
        &bomb.finish().expect("memory"),
        &[],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("unpacks to more than"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_simulated_run_replays_from_each_of_its_files() {
    let dir = folder("own-run");
    let out = text(&dir);
    for (lidar, recording, model) in [
        ("ld06", "lidar.rec", Value::from("ld06")),
        ("vl53l5cx-ring", "ring.log", Value::Null),
    ] {
        let simulated = ["--seconds", "8", "--lidar", lidar, "--out", out, "--json"];
        let run = json(&beamfix(&[&["simulate"], &simulated[..]].concat()));
        for name in [recording, "run.mcap"] {
            let result = json(&beamfix(&["replay", text(&dir.join(name)), "--json"]));
            for key in ["pose_hash", "scans", "refused", "keyframes", "lost"] {
                assert_eq!(result[key], run[key], "{lidar}, {name}: {key}");
            }
            assert_eq!(result["lidar"], model, "{name}");
        }
    }
    let capture = fs::read(dir.join("lidar.rec")).expect("written");
    let output = replay(&dir.join("cut.rec"), &capture[..capture.len() - 7], &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("breaks off inside a piece"),
        "{}",
        stderr(&output)
    );

    let tum = dir.join("t.tum");
    let arguments = [
        "replay",
        out,
        "--trajectory-format",
        "tum",
        "--trajectory",
        text(&tum),
    ];
    let rec = dir.join("lidar.rec");
    let arguments = arguments.map(|a| if a == out { text(&rec) } else { a });
    assert!(beamfix(&arguments).status.success());
    let written = fs::read_to_string(&tum).expect("written");
    let numbers = |line: &str| {
        line.split(' ')
            .filter(|word| word.parse::<f64>().is_ok())
            .count()
    };
    assert!(
        written
            .lines()
            .all(|line| line == "# guess" || numbers(line) == 8),
        "{written}"
    );
}

#[test]
fn a_board_that_says_nothing_is_given_up() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("tcp:{}", listener.local_addr().expect("an address"));
    let picture = folder("silent-board").join("live.png");
    let output = beamfix(&[
        "watch",
        &address,
        "--timeout",
        "0.3",
        "--out",
        text(&picture),
    ]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("nothing came for 0.3 s"),
        "{}",
        stderr(&output)
    );
}

/// The recordings that were made for the list of faults, with what they should end in.
#[test]
fn recordings_that_were_misread_end_where_they_should() {
    let hall = TruePose::new(0.19, 1.98, 170f64.to_radians());
    for (name, arguments) in [
        ("hall-max.mcap.gz", &[] as &[&str]),
        ("hall-inf.mcap.gz", &[]),
        ("rmax0.mcap.gz", &[]),
        ("two-odoms-mixed.mcap.gz", &[]),
        ("fov270.log.gz", &[]),
    ] {
        let Some(path) = shared::file(&format!("faults/{name}")) else {
            continue;
        };
        let result = json(&beamfix(
            &[&["replay", text(&path), "--json"], arguments].concat(),
        ));
        let off = apart(hall, last_pose(&result));
        assert!(off.0 < 0.02 && off.1 < 1.0, "{name}: {off:?}: {result}");
        assert_eq!(result["refused"], 0, "{name}");
    }
    let files = ["as-drivers", "in-order"]
        .map(|name| shared::file(&format!("faults/clockwise-{name}.mcap.gz")));
    if let [Some(drivers), Some(in_order)] = files {
        let end = |path: &PathBuf| {
            let arguments = [
                "replay",
                text(path),
                "--prior",
                "none",
                "--mount",
                "0.08,0,0",
                "--json",
            ];
            last_pose(&json(&beamfix(&arguments)))
        };
        let off = apart(end(&drivers), end(&in_order));
        assert!(off.0 < 0.02 && off.1 < 0.3, "{off:?}");
    }
}

/// Half of the beams end where the map is unexplored, or on people: the matches are right to millimetres, and are believed.
#[test]
fn beams_that_say_nothing_do_not_count_against_a_pose() {
    let trajectory = folder("quiet-beams").join("t.txt");
    for (log, map, doubtful) in [
        ("still.mcap.gz", "border-0.6.yaml", 4),
        ("people0.5.mcap.gz", "border9.yaml", 8),
    ] {
        let (Some(log), Some(map)) = (
            shared::file(&format!("faults/{log}")),
            shared::file(&format!("faults/maps/{map}")),
        ) else {
            continue;
        };
        let localize = |more: &[&str]| {
            let arguments = [
                "replay",
                text(&log),
                "--mode",
                "localize",
                "--map",
                text(&map),
            ];
            beamfix(&[&arguments[..], more].concat())
        };
        let result = json(&localize(&[
            "--start=-0.6,0.3,11.459",
            "--trajectory",
            text(&trajectory),
            "--json",
        ]));
        // Half of the beams are no evidence for one place among all: that is said, and what to do.
        let output = localize(&[]);
        assert_eq!(output.status.code(), Some(2));
        let said = stderr(&output);
        assert!(said.contains("places the best explains"), "{said}");
        assert!(said.contains("--start X,Y,DEG"), "{said}");
        // It stands where it starts.
        let place = TruePose::new(-0.6, 0.3, 11.459f64.to_radians());
        let off = apart(place, last_pose(&result));
        assert!(off.0 < 0.02 && off.1 < 0.5, "{off:?}: {result}");
        let doubts = result["doubtful"].as_u64().expect("a count");
        assert!(result["lost"] == 0 && doubts <= doubtful, "{result}");
    }
}

/// The maps that were made for the list of faults.
#[test]
fn maps_that_were_misread_become_fields() {
    let out = folder("maps-shared").join("x.field");
    for (name, said) in [
        ("keys-in-quotes", ""),
        ("mode-in-capitals", ""),
        ("occupied-from-1.0", ""),
        ("origin-as-a-block", ""),
        ("saved-by-ros2-before-2025-06", "free_thresh 0.25 makes"),
    ] {
        let Some(path) = shared::file(&format!("faults/maps/{name}.yaml")) else {
            continue;
        };
        let output = beamfix(&["field", text(&path), "--out", text(&out), "--json"]);
        let result = json(&output);
        assert!(result["occupied"].as_u64() > Some(0), "{name}: {result}");
        assert!(
            stderr(&output).contains(said),
            "{name}: {}",
            stderr(&output)
        );
        let corner = host_tests::formats::ros_map::read(&path)
            .expect("a map")
            .shape()
            .origin();
        let right = if name.starts_with("saved") {
            -0.15
        } else {
            -10.0
        };
        assert_eq!((corner.x, corner.y), (right, right), "{name}");
    }
}
