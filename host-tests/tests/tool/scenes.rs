//! The table of scenes: a short version, and what the command promises to scripts.

use super::common::tool::{beamfix, json};

/// Scenes that were never wrong and confident, and must not become so.
const HELD: [&str; 5] = ["flat", "hall", "corridor", "wheels-spin", "spin-on"];

/// Scenes that were wrong and confident in build 37eafeb, most by metres, and are no more with this seed. Not among them is a person
/// ahead in a corridor without wheels: wrong and confident with most seeds, by metres.
const MENDED: [&str; 26] = [
    "wheels-start-over",
    "wheels-start-over-often",
    "wheels-jump",
    "wheels-in-utm",
    "corridor-person-ahead",
    "corridor-person-behind",
    "corridor-own-mast",
    "carried-under-a-cover",
    "carried-far-under-a-cover",
    "turned-under-a-cover",
    "covered-3-s-no-wheels",
    "covered-15-s-no-wheels",
    "square-room-after-a-gap",
    "hexagon-after-a-gap",
    "triangle-after-a-gap",
    "beams-by-bearing",
    "round-room-no-wheels",
    "turns-360-deg-per-s",
    "turns-180-deg-per-s-no-wheels",
    "turns-360-deg-per-s-no-wheels",
    "turns-180-deg-per-s-5-hz-no-wheels",
    "turns-90-deg-per-s-wheels-out-of-step",
    "covered-1-s-no-wheels",
    "own-mast-no-wheels",
    "board-behind-no-wheels",
    "fog-no-wheels",
];

#[test]
fn what_held_holds_and_what_was_mended_stays_so() {
    let all: Vec<&str> = HELD.into_iter().chain(MENDED).collect();
    let mut arguments = vec!["scenes", "--json", "--seeds", "1"];
    for name in &all {
        arguments.extend(["--scene", name]);
    }
    let table = json(&beamfix(&arguments));
    let scenes = table["scenes"].as_array().expect("a list");
    let names: Vec<_> = scenes.iter().map(|row| row["scene"].as_str()).collect();
    assert_eq!(names.len(), all.len(), "{names:?}");
    for row in scenes {
        assert_eq!(row["wrong_and_confident"], 0, "{row}");
        let held = HELD.iter().any(|name| row["scene"] == *name);
        assert!(!held || row["as_it_must_be"] == true, "{row}");
        assert!(row["scans"].as_u64() > Some(100), "{row}");
    }
    assert_eq!(table["wrong_and_confident"], 0);
}

#[test]
fn a_rolling_map_is_as_near_as_its_odometry_and_as_honest() {
    let scenes = [
        "flat",
        "hall",
        "wheels-spin",
        "own-mast",
        "corridor-person-ahead",
    ];
    let mut arguments = vec!["scenes", "--rolling", "--json", "--seeds", "2"];
    for name in scenes {
        arguments.extend(["--scene", name]);
    }
    let table = json(&beamfix(&arguments));
    let rows = table["scenes"].as_array().expect("a list");
    assert_eq!(rows.len(), scenes.len(), "{table}");
    for row in rows {
        assert_eq!(row["wrong_and_confident"], 0, "{row}");
        assert!(row["nees"].as_f64().is_some_and(|nees| nees < 3.0), "{row}");
    }
    arguments.remove(1);
    let odometry = json(&beamfix(&arguments));
    for (rolling, odometry) in rows
        .iter()
        .zip(odometry["scenes"].as_array().expect("a list"))
    {
        let off = |row: &serde_json::Value| row["max_error_m"].as_f64().expect("metres");
        // What moves along is left to odometry. Elsewhere both are off by 1 to 2 cm at most, by the motion within a scan: what drifts
        // in minutes is seen in recorded buildings (`maps slam::recorded`).
        let alone = ["flat", "hall", "wheels-spin"]
            .iter()
            .any(|name| rolling["scene"] == *name);
        assert!(
            !alone || off(rolling) < off(odometry) + 0.01,
            "{rolling} {odometry}"
        );
    }
}

#[test]
fn an_unknown_scene_is_a_clear_error() {
    let output = beamfix(&["scenes", "--scene", "moon"]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("no scene has moon in its name"), "{text}");
}
