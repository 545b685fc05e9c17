//! `watch`: an emulated board is followed live, drawn, and recorded; the recording replays to the same bits.

use std::fs;
use std::path::Path;

use crate::common::tool::{beamfix, folder, json, text};
use beamfix::{geometry::Pose, lidar::Protocol, odometry::Odometry, scan::Mount};
use beamfix_app::{
    App, AppConfig, CONFIG, Firmware, Lidar as _, OdometryWith, Row, chosen, telemetry::Reset,
};
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder::{self, ld06::Sensor};
use host_tests::formats::capture::Content;

/// PNG, and large enough to hold a drawing.
fn is_picture(path: &Path) {
    let png = fs::read(path).expect("a picture");
    assert!(png.starts_with(b"\x89PNG"));
    assert!(png.len() > 10_000, "{} bytes", png.len());
}

/// A line for each pose: in a flat nearly every match is good, and says so.
fn are_qualities(file: &Path, poses: u64) {
    let list = fs::read_to_string(file).expect("a list");
    let mut lines = list
        .lines()
        .map(|line| line.split(',').collect::<Vec<&str>>());
    let names = lines.next().expect("names of the columns");
    let column = |name: &str| names.iter().position(|column| *column == name);
    let [verdict, score, inliers, beams, xx, number] =
        ["verdict", "score", "inliers", "beams", "xx", "number_1"]
            .map(|name| column(name).expect(name));
    let mut good = 0;
    let mut count = 0;
    for line in lines {
        assert_eq!(line.len(), names.len(), "{line:?}");
        count += 1;
        let value = |at: usize| line[at].parse::<f64>();
        match line[verdict] {
            "Measured" | "Keyframe" => {
                let (score, sigma) = (
                    value(score).expect("a number"),
                    value(xx).expect("a number").sqrt(),
                );
                let share = value(inliers).expect("a number") / value(beams).expect("a number");
                assert!(
                    (0.3..1.3).contains(&score) && (0.3..=1.0).contains(&share),
                    "{line:?}"
                );
                assert!((1e-4..0.1).contains(&sigma), "{line:?}");
                good += 1;
            }
            _ => assert!(value(score).is_err() && value(number).is_ok(), "{line:?}"),
        }
    }
    assert_eq!(count, poses);
    assert!(good * 10 > poses * 9, "{good} of {poses}");
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn a_board_is_drawn_and_its_recording_replays_to_the_same_bits() {
    let folder = folder("watch-board");
    let (picture, recording) = (folder.join("live.png"), folder.join("lidar.rec"));
    let qualities = folder.join("quality.csv");
    let _ = fs::remove_file(&picture);
    let watched = json(&beamfix(&[
        "watch",
        "--board",
        "m4f",
        "--seconds",
        "6",
        "--out",
        text(&picture),
        "--record",
        text(&recording),
        "--quality",
        text(&qualities),
        "--json",
    ]));
    println!("{watched}");
    let poses = watched["poses"].as_u64().expect("a number");
    assert!(poses >= 57, "{poses} poses");
    for (key, value) in [("missing", 0), ("damaged", 0), ("bytes_lost", 0)] {
        assert_eq!(watched[key], value, "{key}");
    }
    is_picture(&picture);
    are_qualities(&qualities, poses);
    let replayed = json(&beamfix(&["replay", text(&recording), "--json"]));
    assert_eq!(replayed["scans"], watched["poses"]);
    assert_eq!(replayed["pose_hash"], watched["pose_hash"]);
}

/// The bytes of a lidar in a drive of so many seconds, and what a board sends that gets them.
pub fn sent_in(seconds: f64) -> (Vec<u8>, Vec<u8>) {
    let settings = Settings {
        seconds,
        ..Settings::DEFAULT
    };
    let bytes = drive(&settings, &mut Sensor::ld06()).bytes;
    let app = App::<{ beamfix_app::BEAMS }>::new(recording(CONFIG));
    let sent = sent_by(app, &bytes);
    (bytes, sent)
}

/// The settings with all that may be sent.
fn recording(config: AppConfig) -> AppConfig {
    AppConfig {
        record: true,
        scans: true,
        quality: true,
        ..config
    }
}

/// What a board sends that gets these bytes.
fn sent_by<P: Protocol, const N: usize>(app: Firmware<P, Odometry<N>, N>, bytes: &[u8]) -> Vec<u8> {
    let mut app = Box::new(app);
    let mut sent = app.ready(Reset::Power).to_vec();
    for (k, &byte) in bytes.iter().enumerate() {
        // From just before the clock wraps.
        app.set_time((k as u32 * 57).wrapping_sub(1_000_000));
        app.lidar_all(&[byte], |out| sent.extend_from_slice(out));
    }
    sent
}

/// Lidar and mount stand in the recording, as the board tells them, and in what the board sends: nothing need be told.
#[test]
fn what_a_board_was_told_of_its_lidar_is_in_the_recording() {
    let folder = folder("watch-mounted");
    let mount = Mount {
        robot_from_lidar: Pose::new(0.08, -0.03, 2.5),
        upside_down: true,
    };
    let mounted = |config: AppConfig| {
        recording(AppConfig {
            odometry: config.odometry.with_mount(mount),
            ..config
        })
    };
    type Xv11 = Row<{ chosen("xv11") }>;
    let settings = Settings {
        seconds: 8.0,
        ..Settings::DEFAULT
    };
    let ld06 = drive(&settings, &mut Sensor::ld06()).bytes;
    let xv11 = drive(&settings, encoder::for_model(Xv11::MODEL).as_mut()).bytes;
    let boards = [
        (
            "ld06",
            sent_by(App::<{ beamfix_app::BEAMS }>::new(mounted(CONFIG)), &ld06),
        ),
        (
            "xv11",
            sent_by(
                OdometryWith::<Xv11, { Xv11::BEAMS }>::odometry(
                    mounted(Xv11::CONFIG),
                    Xv11::PARSER,
                ),
                &xv11,
            ),
        ),
    ];
    for (lidar, sent) in boards {
        let frames = folder.join(format!("{lidar}.frames"));
        let recording = folder.join(format!("{lidar}.rec"));
        fs::write(&frames, &sent).expect("the test's file");
        let watched = json(&beamfix(&[
            "watch",
            text(&frames),
            "--out",
            text(&folder.join("live.png")),
            "--record",
            text(&recording),
            "--json",
        ]));
        for file in [&frames, &recording] {
            let replayed = json(&beamfix(&["replay", text(file), "--json"]));
            assert_eq!(replayed["lidar"], lidar);
            let told = &replayed["mount"];
            let number = |key: &str| told[key].as_f64().expect("a number") as f32;
            assert_eq!(
                Pose::new(number("x"), number("y"), number("theta")),
                mount.robot_from_lidar
            );
            assert_eq!(told["upside_down"], true);
            assert_eq!(replayed["scans"], watched["poses"], "{lidar}");
            // An XV-11's board has settings for it; the tool replays all lidars with the same.
            if lidar == "ld06" {
                assert_eq!(replayed["pose_hash"], watched["pose_hash"]);
            }
        }
    }
}

/// Whoever ends it by Ctrl-C has what came until then.
#[cfg(unix)]
#[test]
fn what_came_before_an_interrupt_is_kept() {
    use std::io::Write;
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let folder = folder("watch-interrupt");
    let (qualities, recording) = (folder.join("qualities.csv"), folder.join("lidar.rec"));
    let _ = (fs::remove_file(&qualities), fs::remove_file(&recording));
    let (_, sent) = sent_in(3.0);
    let mut watch = Command::new(env!("CARGO_BIN_EXE_beamfix"))
        .args(["watch", "-", "--out", text(&folder.join("live.png"))])
        .args(["--quality", text(&qualities), "--record", text(&recording)])
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the tool");
    // The line stays open: nothing tells the tool that this was all.
    let mut line = watch.stdin.take().expect("a pipe");
    line.write_all(&sent).expect("the tool reads");
    line.flush().expect("the tool reads");
    let lines = || fs::read_to_string(&qualities).map_or(0, |text| text.lines().count());
    let given_up = Instant::now() + Duration::from_secs(60);
    // A head and 28 revolutions, of which the last may be in the pipe.
    while lines() < 20 && Instant::now() < given_up {
        std::thread::sleep(Duration::from_millis(20));
    }
    let interrupt = Command::new("kill")
        .args(["-INT", &watch.id().to_string()])
        .status();
    assert!(interrupt.expect("kill").success());
    assert!(!watch.wait().expect("ended").success());
    drop(line);
    assert!(lines() >= 20, "{} lines", lines());
    let file = fs::read(&recording).expect("a recording");
    let kept = host_tests::formats::capture::plain(&file).len();
    assert!(kept > 20 * 450 / 12 * 47, "{kept} bytes of the lidar");
}

#[test]
fn frames_of_a_file_are_drawn_and_recorded_to_the_byte() {
    let folder = folder("watch-file");
    let (bytes, sent) = sent_in(3.0);
    let frames = folder.join("frames.bin");
    fs::write(&frames, &sent).expect("the test's file");
    let (picture, recording) = (folder.join("live.png"), folder.join("lidar.rec"));
    let watched = json(&beamfix(&[
        "watch",
        text(&frames),
        "--out",
        text(&picture),
        "--record",
        text(&recording),
        "--json",
    ]));
    is_picture(&picture);
    assert_eq!(
        (&watched["damaged"], &watched["missing"]),
        (&0.into(), &0.into())
    );
    let file = fs::read(&recording).expect("a recording");
    let kept = host_tests::formats::capture::plain(&file);
    // The last packet may still wait for more.
    assert!(bytes.starts_with(&kept) && kept.len() + 47 >= bytes.len());
    let times: Vec<u64> = host_tests::formats::capture::pieces(&file)
        .iter()
        .filter(|piece| matches!(piece.content, Content::Bytes(_)))
        .filter_map(|piece| piece.time_us)
        .collect();
    assert!(times.is_sorted(), "{times:?}");
    // A piece is sent on with the first byte that comes more than 2 ms after its own first one.
    assert_eq!(times[1] - times[0], (2000 / 57 + 1) * 57);
}

#[test]
fn what_is_no_telemetry_is_refused() {
    let folder = folder("watch-noise");
    let noise = folder.join("noise.bin");
    fs::write(&noise, [7; 1000]).expect("the test's file");
    for (source, word) in [
        (text(&noise), "no pose"),
        ("/nowhere/at/all", "/nowhere"),
        ("tcp:127.0.0.1:1", "tcp:127.0.0.1:1"),
    ] {
        let output = beamfix(&["watch", source, "--out", text(&folder.join("live.png"))]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{source}: {stderr}");
        assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
        assert!(stderr.contains(word), "{source}: {stderr}");
    }
}
