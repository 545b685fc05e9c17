//! MAVLink as an independent implementation, pymavlink, reads it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use beamfix_app::{App, AppConfig, CONFIG, Output, mavlink, telemetry::Reset};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::ld06::Sensor;
use host_tests::board::{MAVLINK, Replay, commands::Commands, stream::Stream};
use serde_json::Value;

/// Python with pymavlink, in a folder of its own; `None`, after a line that says why, where it cannot be had.
fn python() -> Option<PathBuf> {
    let venv = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pymavlink");
    let python = venv.join("bin/python");
    let works = || {
        Command::new(&python)
            .args(["-c", "import pymavlink"])
            .output()
            .is_ok_and(|output| output.status.success())
    };
    let run = |command: &mut Command| command.output().is_ok_and(|output| output.status.success());
    let made = works()
        || run(Command::new("python3").arg("-m").arg("venv").arg(&venv))
            && run(Command::new(&python).args(["-m", "pip", "install", "-q", "pymavlink==2.4.50"]))
            && works();
    if !made {
        println!(
            "left out: pymavlink cannot be installed (python3 with venv, and the package index, are needed)"
        );
    }
    made.then_some(python)
}

fn ld06() -> Vec<u8> {
    let settings = Settings {
        seconds: 3.0,
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06()).bytes
}

/// What pymavlink reads.
fn parsed(python: &Path, name: &str, bytes: &[u8]) -> Vec<Value> {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&file, bytes).expect("the test's file");
    let output = Command::new(python)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/boards/mavlink.py"))
        .arg(&file)
        .output()
        .expect("python starts");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

fn of<'a>(messages: &'a [Value], name: &str) -> Vec<&'a Value> {
    messages
        .iter()
        .filter(|message| message["mavpackettype"] == name)
        .collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

#[test]
fn pymavlink_reads_poses_and_obstacles() {
    let Some(python) = python() else { return };
    let bytes = ld06();
    let mut app = Box::new(App::<{ beamfix_app::BEAMS }>::new(AppConfig {
        output: Output::Mavlink,
        ..CONFIG
    }));
    let mut sent = app.ready(Reset::Power).to_vec();
    for (k, &byte) in bytes.iter().enumerate() {
        app.set_time(k as u32 * 57);
        sent.extend_from_slice(app.tick());
        app.lidar_all(&[byte], |out| sent.extend_from_slice(out));
    }
    let messages = parsed(&python, "host.mavlink", &sent);
    let mut commands = Commands::new();
    commands.lidar(&bytes);
    let here = Replay::on_host(&commands, beamfix_app::BEAMS);
    let poses: Vec<_> = here.poses().collect();
    let odometry = of(&messages, "ODOMETRY");
    let obstacles = of(&messages, "OBSTACLE_DISTANCE");
    assert!(poses.len() >= 27);
    assert_eq!(
        (odometry.len(), obstacles.len()),
        (poses.len(), poses.len())
    );
    assert!(!of(&messages, "HEARTBEAT").is_empty());
    assert!(of(&messages, "BAD_DATA").is_empty());
    assert!(of(&messages, "HEARTBEAT").len() >= 3);
    // pymavlink's own counter of lost messages takes one sequence a link for granted.
    for (k, message) in messages.iter().enumerate() {
        assert_eq!(message["sequence"], k as u8 as u64, "{message}");
    }
    for (found, pose) in odometry.iter().zip(&poses) {
        let [x, y, theta] = pose.pose.map(f64::from);
        let [xx, xy, yy, xt, yt, tt] = pose.covariance.map(f64::from);
        // Forward, right, down: y and the heading change their sign.
        let yaw = 2.0 * libm::atan2(number(&found["q"][3]), number(&found["q"][0]));
        let covariance = &found["pose_covariance"];
        for (what, got, wanted) in [
            ("x", number(&found["x"]), x),
            ("y", number(&found["y"]), -y),
            ("yaw", yaw, -theta),
            ("xx", number(&covariance[0]), xx),
            ("xy", number(&covariance[1]), -xy),
            ("x yaw", number(&covariance[5]), -xt),
            ("yy", number(&covariance[6]), yy),
            ("y yaw", number(&covariance[10]), yt),
            ("yaw yaw", number(&covariance[20]), tt),
        ] {
            assert!((got - wanted).abs() < 1e-5, "{what}: {got}, not {wanted}");
        }
        assert_eq!(
            (&found["frame_id"], &found["child_frame_id"]),
            (&20.into(), &12.into())
        );
        let quality = found["quality"].as_i64().expect("a number");
        assert!((-1..=100).contains(&quality) && quality != 0, "{quality}");
    }
    for found in &obstacles {
        let distances = found["distances"].as_array().expect("a list");
        assert_eq!(distances.len(), mavlink::SECTORS);
        let near = distances
            .iter()
            .filter(|cm| (5..1200).contains(&cm.as_i64().expect("a number")))
            .count();
        assert!(near > mavlink::SECTORS / 2, "{distances:?}");
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn pymavlink_reads_what_the_emulated_board_sends() {
    let Some(python) = python() else { return };
    let mut stream = Stream::start(&MAVLINK).unwrap_or_else(|error| panic!("{error:#}"));
    let mut sent = Vec::new();
    let mut bytes = [0; 4096];
    // The first heartbeat says that it listens.
    while sent.is_empty() {
        let n = stream.read_for(&mut bytes, Duration::from_secs(60));
        let n = n.unwrap_or_else(|error| panic!("{error:#}"));
        assert!(n > 0, "nothing for a minute");
        sent.extend_from_slice(&bytes[..n]);
    }
    for piece in ld06().chunks(1024) {
        stream
            .send(piece)
            .unwrap_or_else(|error| panic!("{error:#}"));
        let n = stream.read_for(&mut bytes, Duration::from_millis(100));
        sent.extend_from_slice(&bytes[..n.unwrap_or_else(|error| panic!("{error:#}"))]);
    }
    // Until nothing but heartbeats comes: one a second, of 21 bytes.
    let (mut since, mut before) = (Instant::now(), sent.len());
    loop {
        let n = stream.read_for(&mut bytes, Duration::from_millis(500));
        sent.extend_from_slice(&bytes[..n.unwrap_or_else(|error| panic!("{error:#}"))]);
        if since.elapsed() >= Duration::from_secs(2) {
            if sent.len() - before <= 4 * 21 {
                break;
            }
            (since, before) = (Instant::now(), sent.len());
        }
    }
    let messages = parsed(&python, "m4f.mavlink", &sent);
    assert!(of(&messages, "BAD_DATA").is_empty());
    let (poses, scans) = (
        of(&messages, "ODOMETRY"),
        of(&messages, "OBSTACLE_DISTANCE"),
    );
    println!("{} poses, {} scans", poses.len(), scans.len());
    assert!(poses.len() >= 27 && scans.len() == poses.len());
}
