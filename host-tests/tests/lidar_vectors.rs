//! Every parser against recorded and constructed bytes with known contents: `../shared/vectors` and
//! `../shared/datasets/serial`, left out with a line that says so where they are missing.

use std::path::PathBuf;

use beamfix::lidar::{Packet, Protocol, ld06};
use host_tests::decode;
use serde_json::Value;

/// The shared folder: `BEAMFIX_SHARED`, or beside the checkout.
fn shared(path: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("BEAMFIX_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared"),
        PathBuf::from,
    );
    let path = folder.join(path);
    if path.exists() {
        return Some(path);
    }
    println!("left out: {} is not there", path.display());
    None
}

fn vectors(family: &str) -> Vec<Value> {
    let Some(path) = shared(&format!("vectors/{family}.json")) else {
        return Vec::new();
    };
    let text = std::fs::read_to_string(path).expect("readable");
    let file: Value = serde_json::from_str(&text).expect("JSON");
    file["vectors"].as_array().expect("vectors").clone()
}

fn bytes(vector: &Value) -> Vec<u8> {
    if let Some(file) = vector["file"].as_str() {
        let path = shared(&format!("vectors/{file}")).expect("file of the vector");
        return std::fs::read(path).expect("readable");
    }
    let hex = vector["bytes_hex"].as_str().expect("bytes_hex").as_bytes();
    let digit = |c: u8| (c as char).to_digit(16).expect("hex digit") as u8;
    hex.chunks(2)
        .map(|pair| digit(pair[0]) << 4 | digit(pair[1]))
        .collect()
}

/// What a stream decodes to, in the terms of the vectors.
#[derive(Debug, Default, PartialEq)]
struct Decoded {
    points: Vec<(f32, Option<f32>, u16)>,
    scan_starts: Vec<usize>,
    frames: u32,
    skipped_bytes: u32,
    tail_bytes: usize,
}

/// Feeds the stream in one go.
fn decode<P: Protocol>(mut parser: P, bytes: &[u8]) -> Decoded {
    let mut decoded = Decoded::default();
    let mut take = |packet: P::Packet| {
        let first = decoded.points.len();
        decoded
            .scan_starts
            .extend(packet.turn_start().map(|k| first + k));
        let samples = packet.samples();
        decoded
            .points
            .extend(samples.map(|s| (s.angle_deg, s.range_mm, s.quality)));
        assert_eq!(packet.beams().count(), packet.samples().count());
    };
    for &byte in bytes {
        if let Some(packet) = parser.push(byte) {
            take(packet);
        }
    }
    while let Some(packet) = parser.pull() {
        take(packet);
    }
    decoded.frames = parser.counters().packets;
    decoded.skipped_bytes = parser.counters().skipped_bytes;
    decoded.tail_bytes = parser.pending_bytes();
    assert_eq!(parser.counters().turns as usize, decoded.scan_starts.len());
    decoded
}

fn number(value: &Value) -> Option<f64> {
    value.as_f64()
}

fn check_points(id: &str, decoded: &Decoded, expect: &Value) {
    let expected = expect["points"].as_array().expect("points");
    assert_eq!(decoded.points.len(), expected.len(), "{id}: points");
    for (k, (point, expected)) in decoded.points.iter().zip(expected).enumerate() {
        let &(angle, range, quality) = point;
        let off = (f64::from(angle) - number(&expected[0]).expect("angle") + 540.0)
            .rem_euclid(360.0)
            - 180.0;
        assert!(
            off.abs() <= 0.01,
            "{id}: point {k}: {point:?}, not {expected}"
        );
        assert!((0.0..360.0).contains(&angle), "{id}: point {k}: {angle}");
        match (range, number(&expected[1])) {
            (None, None) => {}
            (Some(mm), Some(expected_mm)) if (f64::from(mm) - expected_mm).abs() <= 0.25 => {}
            // Some vectors keep the zero that stands for "no return".
            (None, Some(0.0)) => {}
            _ => panic!("{id}: point {k}: {point:?}, not {expected}"),
        }
        if let Some(expected) = number(&expected[2]) {
            assert_eq!(f64::from(quality), expected, "{id}: point {k}: quality");
        }
    }
}

fn check_stream<P: Protocol>(new: impl Fn() -> P, vector: &Value) {
    let id = vector["id"].as_str().expect("id");
    let expect = &vector["expect"];
    let decoded = decode(new(), &bytes(vector));
    let count = |key: &str| expect[key].as_u64().map(|n| n as usize);
    assert_eq!(
        Some(decoded.frames as usize),
        count("frames"),
        "{id}: frames"
    );
    assert_eq!(
        Some(decoded.skipped_bytes as usize),
        count("skipped_bytes"),
        "{id}: skipped bytes"
    );
    assert_eq!(Some(decoded.tail_bytes), count("tail_bytes"), "{id}: tail");
    check_points(id, &decoded, expect);
    if let Some(starts) = expect["scan_starts"].as_array() {
        let starts: Vec<usize> = starts
            .iter()
            .map(|n| n.as_u64().expect("index") as usize)
            .collect();
        assert_eq!(decoded.scan_starts, starts, "{id}: scan starts");
    }
}

#[test]
fn ldrobot_vectors() {
    for vector in vectors("ldrobot47") {
        let rate = vector["config"]["sample_rate_hz"].as_u64().unwrap_or(4500);
        match vector["kind"].as_str().expect("kind") {
            "stream" | "corrupted-stream" => {
                check_stream(|| ld06::Parser::with_sample_rate(rate as u32), &vector);
            }
            "command" => {
                let bytes = bytes(&vector);
                let (code, body) = bytes.split_last().expect("bytes");
                assert_eq!(ld06::check_code(body), *code, "{}", vector["id"]);
            }
            "table" => {}
            kind => panic!("unknown kind {kind}"),
        }
    }
}

#[test]
fn ld19_capture() {
    let Some(path) = shared("datasets/serial/ld19-20240828.bin") else {
        return;
    };
    let bytes = std::fs::read(path).expect("readable");
    let mut without_range = 0;
    let mut last_us = 0;
    let summary = decode::decode("ld06", &bytes, &mut |row| {
        without_range += u32::from(row.range_mm.is_none());
        assert!(row.time_us >= last_us, "{} after {last_us}", row.time_us);
        last_us = row.time_us;
    })
    .expect("known");
    assert_eq!((summary.packets, summary.points), (1700, 20_400));
    assert_eq!((without_range, summary.scans), (4, 43));
    // 1821 places read 54 2C; 3 of them lie inside good frames.
    assert_eq!(summary.check_errors, 118);
    assert_eq!(
        summary.packets * 47 + summary.skipped_bytes + summary.tail_bytes,
        85_397
    );
}
