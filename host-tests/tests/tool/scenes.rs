//! The table of scenes: a short version, and what the command promises to scripts.

use super::common::tool::{beamfix, json};

/// Scenes that were never wrong and confident, and must not become so.
const HELD: [&str; 6] = [
    "flat",
    "hall",
    "corridor",
    "wheels-spin",
    "spin-on",
    "half-blind",
];

#[test]
fn what_held_holds() {
    let mut arguments = vec!["scenes", "--json", "--seeds", "1"];
    for name in HELD {
        arguments.extend(["--scene", name]);
    }
    let table = json(&beamfix(&arguments));
    let scenes = table["scenes"].as_array().expect("a list");
    let names: Vec<_> = scenes.iter().map(|row| row["scene"].as_str()).collect();
    assert_eq!(names.len(), HELD.len(), "{names:?}");
    for row in scenes {
        assert_eq!(row["wrong_and_confident"], 0, "{row}");
        assert_eq!(row["as_it_must_be"], true, "{row}");
        assert!(row["scans"].as_u64() > Some(100), "{row}");
    }
    assert_eq!(table["wrong_and_confident"], 0);
}

#[test]
fn an_unknown_scene_is_a_clear_error() {
    let output = beamfix(&["scenes", "--scene", "moon"]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("no scene has moon in its name"), "{text}");
}
