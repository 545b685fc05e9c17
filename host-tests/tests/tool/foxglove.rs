//! `--foxglove`: a client of its own reads scans and poses while they are found. `host-tests/foxglove/test` runs these.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread;
use std::time::Duration;

use beamfix::lidar::Model;
use beamfix_app::link::Receiver;
use beamfix_app::telemetry::Telemetry;
use serde_json::Value;
use serialport::{SerialPort, TTYPort};

use super::{live, watch};
use crate::common::tool::{folder, text};

/// Lines of a process until one starts with `with`; gives the rest of it.
fn line(lines: &mut BufReader<ChildStderr>, with: &str) -> String {
    let mut all = String::new();
    loop {
        let before = all.len();
        assert!(lines.read_line(&mut all).expect("text") > 0, "{all}");
        if let Some(rest) = all[before..].strip_prefix(with) {
            return rest.trim_end().to_owned();
        }
    }
}

/// A tool with a server, and a client that has subscribed to all of it.
fn served(mut tool: Child) -> (Child, Child) {
    let mut lines = BufReader::new(tool.stderr.take().expect("a pipe"));
    let address = line(&mut lines, "beamfix: Foxglove: ws://127.0.0.1:");
    // What it says later is read, so that it does not wait.
    thread::spawn(move || lines.lines().for_each(drop));
    let python = std::env::var("BEAMFIX_PYTHON").expect("host-tests/foxglove/test sets it");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("foxglove/client.py");
    let mut client = Command::new(python)
        .args([text(&script), &address])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("Python");
    let mut told = BufReader::new(client.stderr.take().expect("a pipe"));
    line(&mut told, "subscribed");
    thread::spawn(move || told.lines().for_each(drop));
    (tool, client)
}

/// What the client saw, checked as far as it does not depend on the source.
fn seen_by(client: Child) -> Value {
    let output = client.wait_with_output().expect("ended");
    let seen: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(seen["name"], "beamfix");
    for (topic, schema) in [
        ("/points", "foxglove.PointCloud"),
        ("/seen", "foxglove.PointCloud"),
        ("/pose/estimate", "foxglove.PoseInFrame"),
        ("/tf", "foxglove.FrameTransform"),
    ] {
        assert_eq!(seen["channels"][topic], schema, "{topic}");
    }
    let clouds = seen["clouds"].as_array().expect("clouds");
    let poses = seen["poses"].as_array().expect("poses");
    assert!(clouds.len() >= 15 && poses.len() >= 15, "{seen}");
    assert!(seen["transforms"].as_u64().expect("a number") >= 15);
    for cloud in clouds {
        let (count, farthest) = (cloud[1].as_u64(), cloud[2].as_f64());
        assert_eq!(cloud[0], "robot");
        // An LD06 in a flat.
        assert!(count > Some(300) && farthest < Some(12.0), "{cloud}");
    }
    let places = seen["seen"].as_array().expect("clouds");
    assert!(!places.is_empty() && places.iter().all(|cloud| cloud[0] == "map"));
    println!(
        "{} clouds, {} poses, {} times what was seen",
        clouds.len(),
        poses.len(),
        places.len()
    );
    seen
}

#[test]
fn what_a_board_sends_is_served() {
    let folder = folder("foxglove-watch");
    let (_, sent) = watch::sent_in(4.0);
    let mut receiver = Receiver::new();
    let poses: Vec<[f32; 3]> = sent
        .iter()
        .filter_map(|&byte| match receiver.push::<Telemetry>(byte) {
            Some(Telemetry::Pose(pose)) => Some(pose.pose),
            _ => None,
        })
        .collect();
    let tool = Command::new(env!("CARGO_BIN_EXE_beamfix"))
        .args(["watch", "-", "--out", text(&folder.join("live.png"))])
        .args(["--every", "0.2", "--foxglove=127.0.0.1:0"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("the tool");
    let (mut tool, client) = served(tool);
    let mut line = tool.stdin.take().expect("a pipe");
    for piece in sent.chunks(2048) {
        line.write_all(piece).expect("the tool reads");
        thread::sleep(Duration::from_millis(20));
    }
    thread::sleep(Duration::from_millis(500));
    drop(line);
    assert!(tool.wait().expect("ended").success());
    let seen = seen_by(client);
    // To the bit, the last ones may be lost with the connection.
    let mut sent = poses.iter();
    for pose in seen["poses"].as_array().expect("poses") {
        let number = |k: usize| pose[k].as_f64().expect("a number");
        let is_it = |[x, y, theta]: &[f32; 3]| {
            let half = 0.5 * f64::from(*theta);
            let places = [(number(0), *x), (number(1), *y)];
            places.iter().all(|(got, sent)| *got as f32 == *sent)
                && (number(2) - half.sin()).abs() < 1e-12
                && (number(3) - half.cos()).abs() < 1e-12
        };
        assert!(sent.any(is_it), "{pose} was not sent, or not then");
    }
}

#[test]
fn a_lidar_on_a_serial_line_is_served() {
    let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    let path = slave.name().expect("its name");
    let lidar = thread::spawn(move || live::play(master, &Model::LDROBOT_LD06, &live::SILENT));
    let tool = Command::new(env!("CARGO_BIN_EXE_beamfix"))
        .args(["live", &path, "--lidar", "ld06", "--foxglove=127.0.0.1:0"])
        .args(["--scans", "60", "--every", "0.2", "--json"])
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("the tool");
    let (mut tool, client) = served(tool);
    assert!(tool.wait().expect("ended").success());
    drop(slave);
    seen_by(client);
    lidar.join().expect("the lidar");
}
