//! `live`: simulated lidars at the other end of a pseudo-terminal, as if they were plugged in.

use std::io::{ErrorKind, Read, Write};
use std::thread;
use std::time::{Duration, Instant};

use beamfix::lidar::Model;
use beamfix_sim::drive::{Settings, drive};
use beamfix_sim::encoder;
use serialport::{SerialPort, TTYPort};

use crate::common::tool::{beamfix, folder, json, text};

/// What a sensor is asked, and answers.
pub struct Answers<'a> {
    /// A request's bytes, and what the sensor sends for it.
    answers: &'a [(&'a [u8], &'a [u8])],
    /// The request after which it measures; none: it measures from the start.
    scan: Option<&'a [u8]>,
}

/// A sensor that sends by itself, and hears nothing.
pub static SILENT: Answers<'static> = Answers {
    answers: &[],
    scan: None,
};

/// What a unit of YDLIDAR's G2 adds to its angles by its own calibration (0.25°).
const ADDED: i32 = -37;

/// Plays a lidar until nobody listens any more: answers, and sends what it measures at its own pace. Gives the requests.
pub fn play(mut line: TTYPort, model: &'static Model, answers: &Answers<'_>) -> Vec<u8> {
    let settings = Settings {
        seconds: 40.0,
        ..Settings::DEFAULT
    };
    let measured = drive(&settings, encoder::for_model(model).as_mut());
    line.set_timeout(Duration::from_millis(1)).expect("a line");
    let (mut asked, mut answered) = (Vec::new(), 0);
    let mut began = answers.scan.is_none().then(Instant::now);
    let (mut sent, mut frame) = (0, 0);
    // What is to be sent, and how much of it is on the line: a full line takes the rest later.
    let (mut out, mut written) = (Vec::new(), 0);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        match line.write(&out[written..]) {
            Ok(count) => written += count,
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            // Whoever listened has closed the line.
            Err(_) => break,
        }
        let mut bytes = [0; 256];
        match line.read(&mut bytes) {
            Ok(n) => asked.extend_from_slice(&bytes[..n]),
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            // Whoever listened has closed the line.
            Err(_) => break,
        }
        for (request, answer) in answers.answers {
            if asked[answered..].ends_with(request) {
                answered = asked.len();
                out.extend_from_slice(answer);
            }
        }
        if answers.scan.is_some_and(|scan| asked.ends_with(scan)) {
            began.get_or_insert_with(Instant::now);
        }
        let now_us = began.map_or(0.0, |began| began.elapsed().as_secs_f64() * 1e6);
        while let Some(&(end, _)) = measured.frames.get(frame).filter(|next| next.1 < now_us) {
            out.extend_from_slice(&measured.bytes[sent..end]);
            (sent, frame) = (end, frame + 1);
        }
    }
    asked
}

/// Follows a lidar that is played; gives what the tool said, what it was asked, and what it said about the lidar.
fn follow(
    model: &'static Model,
    name: &str,
    answers: &'static Answers<'static>,
) -> (serde_json::Value, Vec<u8>, String) {
    let (master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    let path = slave.name().expect("its name");
    let recording = folder("live").join(format!("{}-{name}.rec", model.name));
    let lidar = thread::spawn(move || play(master, model, answers));
    let output = beamfix(&[
        "live",
        &path,
        "--lidar",
        name,
        "--scans",
        "25",
        "--record",
        text(&recording),
        "--json",
    ]);
    let said = json(&output);
    drop(slave);
    let asked = lidar.join().expect("the lidar");
    // What was recorded gives the same poses again.
    let replayed = json(&beamfix(&[
        "replay",
        text(&recording),
        "--scans",
        "25",
        "--json",
    ]));
    assert_eq!(
        said["pose_hash"], replayed["pose_hash"],
        "{said} {replayed}"
    );
    assert_eq!(said["lidar"], replayed["lidar"]);
    (
        said,
        asked,
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

#[test]
fn a_lidar_that_sends_by_itself_is_heard_named_and_followed() {
    let (said, _, lines) = follow(&Model::LDROBOT_LD06, "auto", &SILENT);
    assert!(lines.contains("ld06 at"), "{lines}");
    assert_eq!(said["scans"], 25);
    assert_eq!(said["refused"], 0, "{said}");
    // No terminal: a line now and then.
    assert!(lines.contains("scans, 0 refused"), "{lines}");
}

#[test]
fn a_lidar_that_waits_for_a_command_gets_it() {
    // HLS-LDS01: the letter b.
    static STARTED: Answers<'static> = Answers {
        answers: &[],
        scan: Some(b"b"),
    };
    let (said, asked, _) = follow(&Model::HLS_LDS01, "lds01", &STARTED);
    assert_eq!(asked, b"b");
    assert_eq!(said["scans"], 25);
    assert_eq!(said["refused"], 0, "{said}");
}

#[test]
fn a_lidar_that_is_asked_as_an_rplidar_is_read_as_what_it_is() {
    // YDLIDAR X4: information, health, scan; the answer to the last is of the kind that an RPLIDAR's standard scan has.
    static ASKED: Answers<'static> = Answers {
        answers: &[
            (
                &[0xa5, 0x90],
                &[
                    0xa5, 0x5a, 20, 0, 0, 0, 4, 6, 1, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                    0, 0, 0,
                ],
            ),
            (&[0xa5, 0x91], &[0xa5, 0x5a, 3, 0, 0, 0, 6, 0, 0, 0]),
            (&[0xa5, 0x92], &[0xa5, 0x5a, 3, 0, 0, 0, 6, 0, 0, 0]),
            (&[0xa5, 0x60], &[0xa5, 0x5a, 5, 0, 0, 0x40, 0x81]),
        ],
        scan: Some(&[0xa5, 0x60]),
    };
    let (said, asked, _) = follow(&Model::YDLIDAR_X4, Model::YDLIDAR_X4.name, &ASKED);
    assert!(asked.ends_with(&[0xa5, 0x60]), "{asked:x?}");
    assert_eq!(said["scans"], 25, "{said}");
    assert_eq!(said["refused"], 0, "{said}");
}

/// Its zero looks elsewhere than a G2's: by 9.25°, in `live`, in what is recorded and in what is decoded.
#[test]
fn the_zero_that_a_unit_keeps_is_asked_for_applied_and_recorded() {
    static ASKED: Answers<'static> = Answers {
        answers: &[
            (
                &[0xa5, 0x90],
                &[
                    0xa5, 0x5a, 20, 0, 0, 0, 4, 100, 1, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                    0, 0, 0, 0,
                ],
            ),
            (&[0xa5, 0x91], &[0xa5, 0x5a, 3, 0, 0, 0, 6, 0, 0, 0]),
            (
                &[0xa5, 0x93],
                &[0xa5, 0x5a, 4, 0, 0, 0, 4, ADDED as u8, 0xff, 0xff, 0xff],
            ),
            (&[0xa5, 0x60], &[0xa5, 0x5a, 5, 0, 0, 0x40, 0x81]),
        ],
        scan: Some(&[0xa5, 0x60]),
    };
    let model = &Model::YDLIDAR_G2;
    let (said, asked, lines) = follow(model, model.name, &ASKED);
    assert!(asked.ends_with(&[0xa5, 0x60]), "{asked:x?}");
    assert!(lines.contains("9.25° of its own look forward"), "{lines}");
    assert_eq!(said["scans"], 25, "{said}");
    let recording = folder("live").join(format!("{0}-{0}.rec", model.name));
    let file = std::fs::read(recording).expect("recorded");
    // The first beam's bearing with the zero and without.
    let bearing = |file: &[u8]| {
        let mut first = None;
        let mut keep = |row: host_tests::decode::Row| {
            first.get_or_insert(row.beam.bearing.radians().to_degrees());
        };
        host_tests::decode::decode(model.name, file, &mut keep).expect("a known lidar");
        first.expect("a beam")
    };
    let plain = host_tests::formats::capture::plain(&file);
    let turned = (bearing(&file) - bearing(&plain)).rem_euclid(360.0);
    assert!((turned - 9.25).abs() < 0.01, "{turned}");
}

#[test]
fn a_silent_line_is_told() {
    let (_master, slave) = TTYPort::pair().expect("a pseudo-terminal");
    let path = slave.name().expect("its name");
    let output = beamfix(&["live", &path, "--lidar", "ld06", "--timeout", "0.5"]);
    assert_eq!(output.status.code(), Some(2));
    let lines = String::from_utf8_lossy(&output.stderr);
    assert!(lines.contains("no revolution for 0.5 s"), "{lines}");
}
