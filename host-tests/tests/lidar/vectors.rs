//! Every parser against recorded and constructed bytes with known contents: `../shared/vectors` and
//! `../shared/datasets/serial`, left out with a line that says so where they are missing.

use beamfix::lidar::model::{Parallax, Samples, Sector};
use beamfix::lidar::rplidar::command;
use beamfix::lidar::scip::command::{Parameters, Part, Replies};
use beamfix::lidar::{Family, Model, Packet, Protocol, ld06, sick};
use beamfix_sim::encoder;
use host_tests::decode::{self, WithParser, with_parser};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use host_tests::shared;

fn vectors(family: &str) -> Vec<Value> {
    let Some(path) = shared::file(&format!("vectors/{family}.json")) else {
        return Vec::new();
    };
    let text = std::fs::read_to_string(path).expect("readable");
    let file: Value = serde_json::from_str(&text).expect("JSON");
    file["vectors"].as_array().expect("vectors").clone()
}

fn bytes(vector: &Value) -> Vec<u8> {
    if let Some(file) = vector["file"].as_str() {
        let path = shared::file(&format!("vectors/{file}")).expect("file of the vector");
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

/// Feeds the whole stream, the parser asked for held-back packets after pieces of random length as well.
struct Decode<'a> {
    bytes: &'a [u8],
    longest_piece: usize,
}

impl WithParser for Decode<'_> {
    type Output = Decoded;

    fn run<P: Protocol>(self, mut parser: P) -> Decoded {
        let mut decoded = Decoded::default();
        let mut rng = ChaCha8Rng::seed_from_u64(self.longest_piece as u64);
        let mut rest = self.bytes;
        while !rest.is_empty() {
            let length = rng.random_range(1..=self.longest_piece.min(rest.len()));
            let (piece, after) = rest.split_at(length);
            rest = after;
            for &byte in piece {
                if let Some(packet) = parser.push(byte) {
                    decoded.take(&packet);
                }
            }
            while let Some(packet) = parser.pull() {
                decoded.take(&packet);
            }
        }
        decoded.frames = parser.counters().packets;
        decoded.skipped_bytes = parser.counters().skipped_bytes;
        decoded.tail_bytes = parser.pending_bytes();
        assert_eq!(
            parser.counters().revolutions as usize,
            decoded.scan_starts.len()
        );
        decoded
    }
}

impl Decoded {
    fn take(&mut self, packet: &impl Packet) {
        let first = self.points.len();
        self.scan_starts
            .extend(packet.revolution_start().map(|k| first + k));
        let samples = packet.samples();
        self.points
            .extend(samples.map(|s| (s.angle_deg, s.range_mm, s.quality)));
        assert_eq!(packet.beams().count(), packet.samples().count());
    }
}

fn decoded(model: &Model, bytes: &[u8]) -> Decoded {
    let whole = bytes.len().max(1);
    let once = with_parser(
        model,
        Decode {
            bytes,
            longest_piece: whole,
        },
    );
    for longest_piece in [1, 7, 300] {
        let pieces = with_parser(
            model,
            Decode {
                bytes,
                longest_piece,
            },
        );
        assert!(pieces == once, "{}: pieces of {longest_piece}", model.name);
    }
    once
}

fn number(value: &Value) -> Option<f64> {
    value.as_f64()
}

fn check_points(id: &str, decoded: &Decoded, expect: &Value, has_quality: bool) {
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
        if let Some(expected) = number(&expected[2]).filter(|_| has_quality) {
            assert_eq!(f64::from(quality), expected, "{id}: point {k}: quality");
        }
    }
}

fn check_stream(model: &Model, vector: &Value) {
    let id = vector["id"].as_str().expect("id");
    let expect = &vector["expect"];
    let decoded = decoded(model, &bytes(vector));
    let count = |key: &str| expect[key].as_u64().map(|n| n as usize);
    let counts = [
        ("frames", decoded.frames as usize),
        ("skipped_bytes", decoded.skipped_bytes as usize),
        ("tail_bytes", decoded.tail_bytes),
    ];
    for (key, found) in counts {
        assert_eq!(Some(found), count(key), "{id}: {key}");
    }
    if expect["points"].is_array() {
        check_points(id, &decoded, expect, true);
    } else {
        check_digest(id, &decoded, expect);
    }
    if let Some(starts) = expect["scan_starts"].as_array() {
        let starts: Vec<usize> = starts
            .iter()
            .map(|n| n.as_u64().expect("index") as usize)
            .collect();
        assert_eq!(decoded.scan_starts, starts, "{id}: scan starts");
    }
    println!("{}: {id}: {} points", model.name, decoded.points.len());
}

/// Long recordings: a CRC over all points.
fn check_digest(id: &str, decoded: &Decoded, expect: &Value) {
    let mut digest = flate2::Crc::new();
    for &(angle, range, quality) in &decoded.points {
        // The recordings' angles are whole 1/64°; the digest rounds their halves of 0.001° to even.
        let exact = (f64::from(angle) * 64.0).round() / 64.0;
        let angle = (exact * 1000.0).round_ties_even() as u32 % 360_000;
        let range = range.map_or(u32::MAX, |mm| (f64::from(mm) * 100.0).round() as u32);
        digest.update(&angle.to_le_bytes());
        digest.update(&range.to_le_bytes());
        digest.update(&quality.to_le_bytes());
    }
    let total = expect["points_total"].as_u64().expect("points_total");
    assert_eq!(decoded.points.len() as u64, total, "{id}: points");
    let expected = expect["digest"].as_str().expect("digest");
    assert_eq!(format!("{:08x}", digest.sum()), expected, "{id}: digest");
}

/// Every stream of a family's vectors; `model` may follow what the vector says.
fn check_family(family: &str, model: impl Fn(&Value) -> Model) {
    for vector in vectors(family) {
        if vector["kind"].as_str().expect("kind").contains("stream") {
            check_stream(&model(&vector), &vector);
        }
    }
}

#[test]
fn ldrobot() {
    check_family("ldrobot47", |vector| Model {
        points_per_s: vector["config"]["sample_rate_hz"].as_u64().unwrap_or(4500) as u32,
        ..Model::LDROBOT_LD06
    });
}

#[test]
fn ldrobot_commands() {
    for vector in vectors("ldrobot47") {
        if vector["kind"] == "command" {
            let bytes = bytes(&vector);
            let (code, body) = bytes.split_last().expect("bytes");
            assert_eq!(ld06::check_code(body), *code, "{}", vector["id"]);
            let encoded = match vector["id"].as_str().expect("id") {
                "ld14p-start" => ld06::START,
                "ld14p-stop" => ld06::STOP,
                "ld14p-speed-2160dps" => ld06::set_speed(2160),
                id => panic!("unknown command {id}"),
            };
            assert_eq!(encoded[..], bytes);
        }
    }
}

#[test]
fn rplidar() {
    check_family("rplidar_scan", |_| Model::RPLIDAR_SCAN);
    check_family("rplidar_capsule", |_| Model::RPLIDAR_EXPRESS);
    check_family("rplidar_dense", |_| Model::RPLIDAR_DENSE);
    check_family("rplidar_ultra", |_| Model::RPLIDAR_ULTRA);
    check_family("rplidar_ultradense", |_| Model::RPLIDAR_ULTRADENSE);
    check_family("rplidar_hq", |_| Model::RPLIDAR_HQ);
}

#[test]
fn ydlidar() {
    check_family("ydlidar", |vector| {
        let variant = vector["config"]["variant"].as_str().expect("variant");
        let samples = match (variant, vector["config"]["sample_bytes"].as_u64()) {
            ("tmini", _) => Samples::TMINI,
            ("tof2", _) => Samples::TIME_OF_FLIGHT,
            (_, Some(3)) if variant.starts_with("T-mini") => Samples::TMINI,
            (_, Some(3)) => Samples::TRIANGLE_INTENSITY,
            _ => Samples::TRIANGLE,
        };
        Model {
            family: Family::Ydlidar(samples),
            ..Model::YDLIDAR_X4
        }
    });
}

#[test]
fn neato() {
    check_family("xv11", |vector| match vector["id"].as_str() {
        Some("old-firmware-5AA500C0") => Model::NEATO_XV11_EARLY,
        _ => Model::NEATO_XV11,
    });
}

#[test]
fn lds01() {
    check_family("lds01", |_| Model::HLS_LDS01);
}

#[test]
fn camsense() {
    check_family("camsense", |_| Model::CAMSENSE_X1);
}

#[test]
fn delta() {
    check_family("delta", |vector| Model {
        family: Family::Delta(match vector["config"]["frames_per_rev"].as_u64() {
            Some(15) => Sector::Fifteenth,
            _ => Sector::Sixteenth,
        }),
        ..Model::DELTA_2A
    });
}

#[test]
fn scip() {
    for vector in vectors("scip") {
        let id = vector["id"].as_str().expect("id");
        let expect = &vector["expect"];
        match id {
            "doc-encoding" => continue,
            "doc-pp" => {
                let mut parameters = Parameters::default();
                let mut replies = Replies::new();
                for byte in bytes(&vector) {
                    match replies.push(byte) {
                        Some(Part::Field { name, value }) => parameters.take(name, value),
                        Some(Part::Damaged) => panic!("{id}: damaged"),
                        _ => {}
                    }
                }
                let Parameters {
                    min_range_mm,
                    max_range_mm,
                    per_revolution,
                    first,
                    last,
                    front,
                    rpm,
                } = parameters;
                for (name, value) in [
                    ("DMIN", min_range_mm),
                    ("DMAX", max_range_mm),
                    ("ARES", per_revolution),
                    ("AMIN", first),
                    ("AMAX", last),
                    ("AFRT", front),
                    ("SCAN_rpm", rpm),
                ] {
                    assert_eq!(Some(u64::from(value)), expect[name].as_u64(), "{name}");
                }
            }
            "constructed-md" => {
                let found = decoded(&Model::HOKUYO_URG04LX, &bytes(&vector));
                let replies = expect["replies"].as_array().expect("replies");
                let scans = replies.iter().filter(|reply| reply["values"].is_array());
                let values = scans.flat_map(|reply| reply["values"].as_array().expect("values"));
                check_values(id, &found, values);
                assert_eq!((found.frames, found.skipped_bytes), (2, 0), "{id}");
            }
            "constructed-md-damaged" => {
                let found = decoded(&Model::HOKUYO_URG04LX, &bytes(&vector));
                let second = expect["second_scan_values"].as_array().expect("values");
                check_values(id, &found, second.iter());
                assert_eq!(found.frames, 1, "{id}");
            }
            _ => {
                let found = decoded(&Model::HOKUYO_URG04LX, &bytes(&vector));
                assert_eq!((found.frames, found.skipped_bytes), (1, 0), "{id}");
                check_points(id, &found, expect, false);
            }
        }
    }
}

/// Values as sent: below 20 they are error codes, not distances.
fn check_values<'a>(id: &str, found: &Decoded, values: impl Iterator<Item = &'a Value>) {
    let expected: Vec<Option<f32>> = values
        .map(|value| value.as_f64().expect("number") as f32)
        .map(|value| (value >= 20.0).then_some(value))
        .collect();
    let ranges: Vec<Option<f32>> = found.points.iter().map(|point| point.1).collect();
    assert_eq!(ranges, expected, "{id}");
}

#[test]
fn sick() {
    for vector in vectors("sick_lms2xx") {
        let bytes = bytes(&vector);
        if vector["kind"] != "command" {
            let found = decoded(&Model::SICK_LMS200, &bytes);
            let expect = &vector["expect"];
            assert_eq!(Some(u64::from(found.frames)), expect["frames"].as_u64());
            assert_eq!(
                Some(u64::from(found.skipped_bytes)),
                expect["skipped_bytes"].as_u64()
            );
            assert_eq!(Some(found.tail_bytes as u64), expect["tail_bytes"].as_u64());
            let values = expect["values"].as_array().expect("values");
            for (scan, points) in found.points.chunks(values.len()).enumerate() {
                for (k, ((angle, mm, _), value)) in points.iter().zip(values).enumerate() {
                    assert!((angle - 0.5 * k as f32).abs() < 0.01, "{scan} {k}: {angle}");
                    let expected = value.as_f64().filter(|mm| *mm > 0.0);
                    // The two scans of the vector differ; only the first is listed.
                    assert!(
                        scan > 0 || mm.map(f64::from) == expected,
                        "{k}: {mm:?} {value}"
                    );
                }
            }
            continue;
        }
        let id = vector["id"].as_str().expect("id");
        let payload = match id {
            "start-continuous" => &sick::START[..],
            "stop-continuous-request-mode" => &sick::STOP[..],
            "baud-38400" => &sick::BAUD_38400[..],
            "baud-9600" => &sick::BAUD_9600[..],
            "baud-500k" => &sick::BAUD_500K[..],
            "status-request" => &sick::STATUS[..],
            "variant-180deg-0.5" => &sick::HALF_DEGREES[..],
            "variant-180deg-1" => &sick::WHOLE_DEGREES[..],
            _ => panic!("unknown command {id}"),
        };
        assert_eq!(*sick::request(payload), bytes[..], "{id}");
    }
}

fn hex(vector: &Value, key: &str) -> Vec<u8> {
    let text = vector[key].as_str().expect("hex");
    let pairs = text.as_bytes().chunks(2);
    pairs
        .map(|pair| u8::from_str_radix(str::from_utf8(pair).expect("text"), 16).expect("hex"))
        .collect()
}

#[test]
fn rplidar_requests_and_answers() {
    for vector in vectors("rplidar_commands") {
        let id = vector["id"].as_str().expect("id");
        let bytes = bytes(&vector);
        if vector["kind"] == "command" {
            let code = vector["expect"]["cmd"].as_u64().expect("cmd") as u8;
            let payload = hex(&vector["expect"], "payload_hex");
            let request = command::request(code, &payload);
            assert_eq!(request.as_deref(), Some(&bytes[..]), "{id}");
            continue;
        }
        let mut answers = command::Answers::new();
        let answer = bytes.iter().find_map(|&byte| answers.push(byte)).expect(id);
        let expect = &vector["expect"]["decoded"];
        let number = |key: &str| expect[key].as_u64().expect("number");
        match id {
            "a1m8-get-info" => {
                let info = command::Info::from_answer(&answer).expect(id);
                let (major, minor) = info.firmware;
                assert_eq!(
                    format!("{major}.{minor}"),
                    expect["firmware"].as_str().expect("text")
                );
                assert_eq!(u64::from(info.model), number("model"));
                assert_eq!(u64::from(info.hardware), number("hardware"));
                assert_eq!(info.serial[..], hex(expect, "serial_hex"));
            }
            _ => {
                let health = command::Health::from_answer(&answer).expect(id);
                assert_eq!(u64::from(health.status), number("status"));
                assert_eq!(u64::from(health.code), number("error_code"));
            }
        }
    }
    for vector in vectors("ydlidar") {
        if vector["id"] == "tmini-info" {
            let mut answers = command::Answers::new();
            let answer = bytes(&vector).iter().find_map(|&byte| answers.push(byte));
            let info = answer.and_then(|answer| command::Info::from_answer(&answer));
            let model = info.map(|info| u64::from(info.model));
            assert_eq!(model, vector["expect"]["model"].as_u64());
        }
    }
}

#[test]
fn parallax_tables() {
    for vector in vectors("ldrobot47") {
        let parallax = match vector["id"].as_str() {
            Some("ld14-geometry") => Parallax::Ld14,
            Some("lds02-geometry") => Parallax::Lds02,
            _ => continue,
        };
        let model = Model {
            family: Family::Ldrobot(parallax),
            ..Model::LDROBOT_LD14
        };
        // One frame a row, all its points at the row's angle, so that shifts carry over as the table's do.
        let rows = vector["expect"]["rows"].as_array().expect("rows");
        let mut bytes = Vec::new();
        for row in rows {
            let cdeg = (row[0].as_f64().expect("angle") * 100.0).round() as u16;
            let frame = encoder::ld06::Frame {
                speed_deg_per_s: 2160,
                start_cdeg: cdeg,
                end_cdeg: cdeg,
                stamp_ms: 0,
                points: [(row[1].as_u64().expect("range") as u16, 200); 12],
            };
            bytes.extend(frame.bytes());
        }
        let found = decoded(&model, &bytes);
        assert_eq!(found.points.len(), 12 * rows.len());
        for (points, row) in found.points.chunks(12).zip(rows) {
            let (angle, range, _) = points[0];
            let off = f64::from(angle) - row[2].as_f64().expect("corrected");
            let off = (off + 540.0).rem_euclid(360.0) - 180.0;
            // The table's raw angles have finer steps than a frame's 0.01°.
            assert!(off.abs() < 0.01 + 0.005, "{row}: {angle}");
            if let Some(mm) = row[3].as_f64() {
                assert!(
                    (f64::from(range.expect("range")) - mm).abs() < 0.25,
                    "{row}: {range:?}"
                );
            }
        }
    }
}

/// What is in each recording, as the recordings' own description has it.
#[test]
fn captures() {
    //   file                         lidar              packets points without scans skipped tail
    for (file, lidar, packets, points, without_range, scans, skipped, tail) in [
        ("ld19-20240828.bin", "ld06", 1700, 20_400, 4, 43, 5484, 13),
        (
            "ydlidar-x4-b.bin",
            "ydlidar-x4",
            1243,
            43_129,
            5291,
            71,
            0,
            74,
        ),
        ("ydlidar-g2-packet-a.bin", "ydlidar-g2", 1, 39, 1, 0, 0, 0),
        (
            "rplidar-a1-standard.bin",
            "rplidar-scan",
            10_436,
            10_436,
            3703,
            33,
            1,
            0,
        ),
        (
            "rplidar-express-capsules.bin",
            "rplidar-express",
            5,
            128,
            5,
            1,
            0,
            0,
        ),
        (
            "xv11-fw24-first-half.bin",
            "xv11",
            5727,
            22_908,
            295,
            64,
            6,
            0,
        ),
        ("xv11-fw21-a.bin", "xv11-early", 21, 7560, 2787, 20, 0, 0),
        ("camsense-x1-a.bin", "camsense-x1", 24, 192, 136, 0, 0, 0),
        ("urg-04lx-md.txt", "scip", 1, 682, 166, 1, 0, 0),
        ("coin-d4-first-half.bin", "coin-d4", 2, 50, 2, 0, 36, 0),
        (
            "lds006-steady-first-half.bin",
            "lds006",
            185,
            740,
            504,
            2,
            9,
            17,
        ),
        (
            "lds006-spinup-first-half.bin",
            "lds006",
            146,
            0,
            0,
            0,
            7,
            15,
        ),
        (
            "xv11-in-log-text-first-half.bin",
            "xv11",
            263,
            1052,
            191,
            35,
            57_678,
            1,
        ),
        ("doc-ld06-frame.bin", "ld06", 1, 12, 0, 0, 0, 0),
        ("doc-delta-2a-frame.bin", "delta-2a", 1, 47, 5, 0, 0, 0),
    ] {
        let Some(path) = shared::file(&format!("datasets/serial/{file}")) else {
            continue;
        };
        let bytes = std::fs::read(path).expect("readable");
        let (mut without, mut last_us) = (0, 0u64);
        let summary = decode::decode(lidar, &bytes, &mut |row| {
            without += u32::from(row.range_mm.is_none());
            assert!(
                row.time_us >= last_us,
                "{file}: {} after {last_us}",
                row.time_us
            );
            last_us = row.time_us;
        });
        let summary = summary.expect("known");
        assert_eq!(
            (summary.packets, summary.points, without),
            (packets, points, without_range),
            "{file}"
        );
        assert_eq!(
            (summary.scans, summary.skipped_bytes, summary.tail_bytes),
            (scans, skipped, tail),
            "{file}"
        );
    }
}

/// Stopped and started between files: the old scan's rest, a descriptor, the new scan.
///
/// The first file holds another restart; a decoder that takes the descriptor there for a point counts 4157.
#[test]
fn rplidar_rooms() {
    for (file, descriptor, nodes, starts) in [
        ("rplidar-a1-room-0001.bin", 665, 4156, 14),
        ("rplidar-a1-room-0002.bin", 684, 1881, 7),
        ("rplidar-a1-room-0003.bin", 1322, 2073, 7),
        ("rplidar-a1-room-0004.bin", 292, 1958, 7),
    ] {
        let Some(path) = shared::file(&format!("datasets/serial/{file}")) else {
            continue;
        };
        let bytes = std::fs::read(path).expect("readable");
        let summary = decode::decode("rplidar-scan", &bytes[descriptor..], &mut |_| {});
        let summary = summary.expect("known");
        assert_eq!((summary.points, summary.scans), (nodes, starts), "{file}");
        println!("{file}: {} bytes skipped", summary.skipped_bytes);
    }
}

#[test]
fn express_capsules_as_the_makers_sdk() {
    let (Some(capsules), Some(nodes)) = (
        shared::file("datasets/serial/rplidar-express-capsules.bin"),
        shared::file("datasets/serial/rplidar-express-capsules.nodes.txt"),
    ) else {
        return;
    };
    let bytes = std::fs::read(capsules).expect("readable");
    let found = decoded(&Model::RPLIDAR_EXPRESS, &bytes);
    let text = std::fs::read_to_string(nodes).expect("readable");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let lines: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(' ')
                .map(|n| n.parse().expect("number"))
                .collect()
        })
        .collect();
    assert_eq!(found.points.len(), lines.len());
    for ((angle, range, _), line) in found.points.iter().zip(&lines) {
        let off = f64::from(*angle) - line[3] * 90.0 / 16384.0;
        assert!(off.abs() < 0.01, "{angle} {line:?}");
        assert_eq!(range.map_or(0.0, f64::from), line[4] / 4.0, "{line:?}");
    }
}
