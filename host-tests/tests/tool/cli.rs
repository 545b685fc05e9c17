//! The tool as scripts meet it: exit statuses, one clear line for a bad file, one JSON object.

use std::fs;
use std::path::Path;
use std::process::Output;

use crate::common::tool::{beamfix, folder, json};
use beamfix_sim::encoder::ld06::Sensor;
use beamfix_sim::{Noise, Settings, Still, TruePose, drive, scenes};
use flate2::{Compression, write::GzEncoder};
use serde_json::Value;
use std::io::Write;

/// Writes `content`, runs the tool over it.
fn over(path: &Path, content: &[u8], arguments: &[&str]) -> Output {
    fs::write(path, content).expect("the test's file");
    let path = path.to_str().expect("a plain path");
    let arguments: Vec<&str> = arguments
        .iter()
        .map(|&a| if a == "FILE" { path } else { a })
        .collect();
    beamfix(&arguments)
}

/// Status 2, nothing on stdout, one line on stderr that holds all of `words`.
fn refused(name: &str, output: &Output, words: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{name}: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{name}: no {word:?} in {stderr}");
    }
}

/// A CARMEN log of `scans` scans while the robot rolls through an empty room.
fn log(scans: usize) -> String {
    let mut noise = Noise::new(5, 0);
    let still = Still {
        beams: 180,
        first: -core::f64::consts::FRAC_PI_2,
        step: core::f64::consts::PI / 180.0,
        ..Still::full_turn(180)
    };
    let (world, mut text) = (scenes::room(), String::from("# a test\n"));
    for k in 0..scans {
        let pose = TruePose::new(-1.0 + 0.05 * k as f64, 0.0, 0.02 * k as f64);
        text += "FLASER 180";
        for beam in still.scan(&world, pose, &mut noise) {
            text += &format!(" {}", f64::from(beam.range.mm().unwrap_or(0)) / 1000.0);
        }
        let TruePose { x, y, theta } = pose;
        text += &format!(
            " {x} {y} {theta} {x} {y} {theta} {}.{:03}00 host 0\n",
            k / 5,
            k % 5 * 200
        );
    }
    text
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

fn random_bytes(count: usize) -> Vec<u8> {
    let mut noise = Noise::new(9, 0);
    (0..count).map(|_| noise.even(0.0, 256.0) as u8).collect()
}

#[test]
fn bad_files_are_refused_in_one_line() {
    let dir = folder("bad");
    let decode: &[&str] = &["decode", "--lidar", "ld06", "FILE", "--json"];
    let replay: &[&str] = &["replay", "FILE", "--json"];
    let capture: &[&str] = &["replay", "FILE", "--lidar", "ld06", "--json"];
    //   name            content                            command  words
    for (name, content, arguments, words) in [
        ("empty.log", vec![], replay, &["empty"] as &[&str]),
        ("empty.bin", vec![], decode, &["empty"]),
        (
            "text.bin",
            b"What is this? Not a lidar.\n".to_vec(),
            decode,
            &["no packet", "27 bytes"],
        ),
        (
            "random.bin",
            random_bytes(20_000),
            decode,
            &["no packet", "20000 bytes"],
        ),
        (
            "random-2.bin",
            random_bytes(20_000),
            capture,
            &["no packet"],
        ),
        (
            "random.log",
            random_bytes(20_000),
            replay,
            &["no usable scan"],
        ),
        (
            "words.log",
            b"nothing\nof use\n".to_vec(),
            replay,
            &["no usable scan", "no FLASER"],
        ),
        (
            "cut-line.log",
            b"FLASER 180 1.0 1.1 1.2".to_vec(),
            replay,
            &["no usable scan", "line 1"],
        ),
        (
            "header.lscan",
            b"LSCN\x01\0\0\0".to_vec(),
            replay,
            &["40 bytes", "8"],
        ),
        (
            "version.lscan",
            [b"LSCN\x02\0\0\0" as &[u8], &[0; 40]].concat(),
            replay,
            &["version 2"],
        ),
        ("no.gz", vec![0x1f, 0x8b, 8, 0, 1, 2, 3], replay, &["gzip"]),
    ] {
        let path = dir.join(name);
        refused(
            name,
            &over(&path, &content, arguments),
            &[&[name], words].concat(),
        );
    }
    refused(
        "missing",
        &beamfix(&["replay", "/nowhere/x.log"]),
        &["/nowhere/x.log"],
    );
    refused(
        "model",
        &over(
            &dir.join("model.bin"),
            b"x",
            &["decode", "--lidar", "hal9000", "FILE"],
        ),
        &["hal9000", "ld06"],
    );
    assert_eq!(beamfix(&["no-such-command"]).status.code(), Some(2));
}

#[test]
fn a_replay_writes_a_line_a_scan_with_the_logs_own_stamps() {
    let dir = folder("replay");
    let (trajectory, text) = (dir.join("t.txt"), log(30));
    let path = trajectory.to_str().expect("a plain path");
    let output = over(
        &dir.join("good.log"),
        text.as_bytes(),
        &["replay", "FILE", "--trajectory", path, "--json"],
    );
    let result = json(&output);
    assert_eq!(
        (&result["scans"], &result["loops"]),
        (&30.into(), &0.into())
    );
    assert_eq!(result["pose_hash"].as_str().map(str::len), Some(16));
    let written = fs::read_to_string(&trajectory).expect("the trajectory");
    let stamps: Vec<&str> = written
        .lines()
        .filter_map(|line| line.split(' ').next())
        .collect();
    assert_eq!(
        (stamps.len(), stamps[0], stamps[29]),
        (30, "0.00000", "5.80000")
    );
    assert!(
        written.lines().all(|line| line.split(' ').count() == 4),
        "{written}"
    );

    // Packed, the same; twice, the same.
    let again = over(
        &dir.join("good.log.gz"),
        &packed(text.as_bytes()),
        &["replay", "FILE", "--json"],
    );
    assert_eq!(json(&again)["pose_hash"], result["pose_hash"]);
    let without = over(
        &dir.join("good.log"),
        text.as_bytes(),
        &["replay", "FILE", "--prior", "none", "--json"],
    );
    assert_eq!(json(&without)["scans"], 30);
}

#[test]
fn broken_lines_and_readings_are_counted_and_the_rest_is_used() {
    let dir = folder("counted");
    let good = log(10);
    // Two readings more than announced: nobody knows which are too many.
    let longer = good.replacen("FLASER 180 ", "FLASER 180 -1.5 nan ", 1);
    let result = json(&over(
        &dir.join("longer.log"),
        longer.as_bytes(),
        &["replay", "FILE", "--json"],
    ));
    assert_eq!(
        (&result["scans"], &result["skipped"]),
        (&9.into(), &1.into())
    );

    let line = good.lines().nth(1).expect("a scan");
    let mut words: Vec<&str> = line.split(' ').collect();
    (words[5], words[6], words[7]) = ("nan", "-3.25", "-inf");
    let marked = good.replacen(line, &words.join(" "), 1);
    let result = json(&over(
        &dir.join("nan.log"),
        marked.as_bytes(),
        &["replay", "FILE", "--json"],
    ));
    assert_eq!(
        (
            &result["scans"],
            &result["bad_readings"],
            &result["skipped"]
        ),
        (&10.into(), &2.into(), &0.into())
    );

    let cut = &good[..good.len() - 200];
    let output = over(
        &dir.join("cut.log"),
        cut.as_bytes(),
        &["replay", "FILE", "--json"],
    );
    let result = json(&output);
    assert_eq!(
        (&result["scans"], &result["skipped"]),
        (&9.into(), &1.into())
    );
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("line 11"),
        "the cut line is named"
    );
}

#[test]
fn what_comes_before_a_cut_is_kept() {
    let dir = folder("cut");
    let trajectory = dir.join("t.txt");
    let path = trajectory.to_str().expect("a plain path");
    let archive = packed(log(60).as_bytes());
    let arguments = ["replay", "FILE", "--trajectory", path];
    let output = over(
        &dir.join("cut.log.gz"),
        &archive[..archive.len() / 2],
        &arguments,
    );
    assert_eq!(output.status.code(), Some(2));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("breaks off"), "{stderr}");
    let lines = fs::read_to_string(&trajectory)
        .expect("the trajectory")
        .lines()
        .count();
    assert!((10..60).contains(&lines), "{lines} lines");
}

#[test]
fn a_simulated_capture_is_decoded_and_replayed() {
    let dir = folder("capture");
    let run = drive(
        &Settings {
            seconds: 3.0,
            ..Settings::DEFAULT
        },
        &mut Sensor::ld06(),
    );
    let csv = dir.join("beams.csv");
    let csv_path = csv.to_str().expect("a plain path");
    // Noise before and in between costs nothing but itself.
    let noisy = [
        &random_bytes(100)[..],
        &run.bytes[..4700],
        b"\x54\x2c",
        &run.bytes[4700..],
    ]
    .concat();
    let result = json(&over(
        &dir.join("noisy.bin"),
        &noisy,
        &[
            "decode", "--lidar", "ld06", "FILE", "--csv", csv_path, "--json",
        ],
    ));
    let packets = run.bytes.len() / 47;
    assert_eq!(
        (&result["packets"], &result["points"]),
        (&packets.into(), &(12 * packets).into())
    );
    assert_eq!(result["skipped_bytes"], 102);
    let table = fs::read_to_string(&csv).expect("the table");
    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("scan,time_us,angle_deg,range_mm,quality"));
    assert_eq!(rows.count(), 12 * packets);
    let result = json(&over(
        &dir.join("capture.bin"),
        &run.bytes,
        &["replay", "--lidar", "ld06", "FILE", "--json"],
    ));
    assert!(
        result["scans"].as_u64().is_some_and(|scans| scans >= 27),
        "{result}"
    );
}

#[test]
fn the_default_run_writes_its_files_and_repeats_itself() {
    let dir = folder("default");
    let out = dir.to_str().expect("a plain path");
    let first = json(&beamfix(&["--out", out, "--seconds", "5", "--json"]));
    let second = json(&beamfix(&[
        "simulate",
        "--out",
        out,
        "--seconds",
        "5",
        "--json",
    ]));
    assert_eq!(first, second);
    for key in [
        "final_error_m",
        "final_error_deg",
        "max_error_m",
        "max_error_deg",
        "distance_m",
        "seconds",
        "scans",
    ] {
        assert!(first[key].is_number(), "{key}: {first}");
    }
    let other = json(&beamfix(&[
        "--out",
        out,
        "--seconds",
        "5",
        "--seed",
        "2",
        "--json",
    ]));
    assert_ne!(first["pose_hash"], other["pose_hash"]);
    let map = image::open(dir.join("map.png")).expect("a picture");
    assert!(map.width() > 1000 && map.height() > 600);
    let chart = fs::read_to_string(dir.join("errors.svg")).expect("a chart");
    assert!(chart.starts_with("<svg") && chart.trim_end().ends_with("</svg>"));
    let recording = fs::read(dir.join("run.mcap")).expect("a recording");
    let messages = mcap::MessageStream::new(&recording).expect("an MCAP file");
    let scans = first["scans"].as_u64().expect("a number");
    let mut clouds = 0;
    for message in messages {
        let message = message.expect("whole messages");
        let kind = message
            .channel
            .schema
            .as_ref()
            .map_or(String::new(), |schema| schema.name.clone());
        clouds += u64::from(kind == "foxglove.PointCloud");
        let _: Value = serde_json::from_slice(&message.data).expect("JSON");
    }
    assert_eq!(clouds, scans);
    assert_eq!(
        fs::read_to_string(dir.join("trajectory.txt"))
            .expect("a file")
            .lines()
            .count() as u64,
        scans
    );
    refused(
        "too short",
        &beamfix(&["--out", out, "--seconds", "0.01"]),
        &["--seconds 0.01"],
    );
    refused(
        "negative",
        &beamfix(&["--out", out, "--seconds=-1"]),
        &["--seconds -1"],
    );
}

#[test]
fn pairs_writes_the_scorers_columns() {
    let dir = folder("pairs");
    let mut noise = Noise::new(3, 0);
    let (world, still) = (scenes::office(4), Still::full_turn(360));
    let from = scenes::office_place(&world, 0.6, &mut noise);
    let motion = TruePose::new(0.1, -0.05, 0.1);
    let mut scans = String::from("2 360 -3.141592653589793 0.017453292519943295 0.05 12\n");
    for (index, pose) in [from, from.then(motion)].into_iter().enumerate() {
        scans += &format!("{index} 0 0 0 0 0 0 0");
        for beam in still.scan(&world, pose, &mut noise) {
            scans += &format!(" {}", f64::from(beam.range.mm().unwrap_or(0)) / 1000.0);
        }
        scans += "\n";
    }
    let pairs = "pair,ref,sens,level,gx,gy,gth,tx,ty,tth\n7,0,1,0,0.08,-0.03,0.08,0.1,-0.05,0.1\n8,0,0,0,nan,0,0,0,0,0\n";
    let (a, b, out) = (
        dir.join("scans.txt"),
        dir.join("pairs.csv"),
        dir.join("result.csv"),
    );
    fs::write(&a, &scans).expect("a file");
    let [scans_path, pairs_path, out_path] =
        [&a, &b, &out].map(|path| path.to_str().expect("a plain path"));
    let pictures = dir.to_str().expect("a plain path");
    let arguments = [
        "pairs",
        scans_path,
        pairs_path,
        "--out",
        out_path,
        "--picture",
        "7",
        "--pictures",
        pictures,
        "--json",
    ];
    let result = json(&over(&b, pairs.as_bytes(), &arguments));
    assert_eq!(
        (&result["pairs"], &result["skipped"]),
        (&1.into(), &1.into())
    );
    assert_eq!(result["levels"][0]["right"], 1, "{result}");
    let table = fs::read_to_string(&out).expect("the result");
    let rows: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!(
        rows[0].join(","),
        "pair,x,y,th,ok,iterations,vxx,vxy,vyy,vxt,vyt,vtt"
    );
    assert_eq!(
        (rows.len(), rows[1].len(), rows[1][0], rows[1][4]),
        (2, 12, "7", "1")
    );
    assert!(dir.join("pair-7.png").is_file() && dir.join("pair-7.svg").is_file());

    refused(
        "no pairs",
        &over(&b, b"pair,ref\n1,2\n", &arguments),
        &["pairs.csv", "no column"],
    );
    refused(
        "no picture",
        &over(
            &b,
            pairs.as_bytes(),
            &["pairs", scans_path, pairs_path, "--picture", "9"],
        ),
        &["no pair 9"],
    );
}
