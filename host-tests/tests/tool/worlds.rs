//! `simulate --world`: places that are built in, described in a text, or taken from a ROS map.

use std::fs;

use crate::common::tool::{beamfix, folder, json, text};

#[test]
fn a_maps_walls_are_a_place_to_drive_in() {
    let folder = folder("worlds");
    let map = folder.join("flat.yaml");
    let out = folder.join("out");
    let written = [
        "simulate",
        "--seconds",
        "2",
        "--out",
        text(&out),
        "--ros-map",
        text(&map),
    ];
    assert!(beamfix(&written).status.success());
    // The same room of the same flat, by its walls and by the cells of its map.
    let place = folder.join("place.txt");
    let description =
        "ros-map flat.yaml  # 5 cm a cell\nstart 5.2 2.6 160\nway 3.3 2.6  3.05 4.15\n";
    fs::write(&place, description).expect("the description");
    let run = beamfix(&[
        "simulate",
        "--world",
        text(&place),
        "--out",
        text(&out),
        "--json",
    ]);
    let value = json(&run);
    let off = value["final_error_m"].as_f64().expect("an error");
    assert!(off < 0.03 && value["refused"] == 0, "{value}");
    let driven = value["distance_m"].as_f64().expect("a distance");
    assert!((3.0..4.5).contains(&driven), "{value}");
}

#[test]
fn a_place_that_is_not_there_is_refused_with_those_that_are() {
    let folder = folder("worlds-bad");
    let path = folder.join("place.txt");
    fs::write(&path, "wall 0 0 4 0\nstart 1 1 0\nway 1 -1\n").expect("the description");
    for (world, words) in [("moon", "aisles"), (text(&path), "comes within")] {
        let out = folder.join("out");
        let run = beamfix(&["simulate", "--world", world, "--out", text(&out)]);
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{said}");
        assert!(said.contains(words), "{said}");
    }
}

#[test]
fn nothing_is_wrong_and_confident_in_a_built_in_place() {
    // The whole table takes half a minute: `beamfix worlds`.
    let worlds = [
        "worlds", "--world", "flat", "--world", "hall", "--world", "maze", "--json",
    ];
    let table = json(&beamfix(&[&worlds[..], &["--seeds", "1"]].concat()));
    let rows = table["worlds"].as_array().expect("a list");
    assert_eq!(rows.len(), 3, "{table}");
    assert_eq!(table["wrong_and_confident"], 0, "{table}");
    for row in rows {
        assert!(
            row["scans"].as_u64().is_some_and(|scans| scans > 500),
            "{row}"
        );
    }
    // What `simulate` prints of the same drive.
    let out = folder("worlds-table");
    let run = json(&beamfix(&["--out", text(&out), "--json"]));
    for key in ["final_error_m", "max_error_m", "refused", "scans"] {
        let [found, told] = [&rows[0][key], &run[key]].map(|v| v.as_f64().expect(key));
        // One is computed in single precision.
        assert!((found - told).abs() < 1e-6, "{key}: {found}, {told}");
    }
}

#[test]
fn what_an_error_depends_on_is_drawn() {
    let picture = folder("teach").join("teach.svg");
    let out = ["teach", "--seeds", "1", "--out", text(&picture), "--json"];
    let value = json(&beamfix(&out));
    let drawn = fs::read_to_string(&picture).expect("a picture");
    let quantities = value["quantities"].as_array().expect("a list");
    assert_eq!(quantities.len(), 6, "{value}");
    for quantity in quantities {
        let name = quantity["quantity"].as_str().expect("a name");
        assert!(drawn.contains(name), "{name} is not drawn");
        let errors = |line: usize| -> Vec<f64> {
            let line = quantity["errors_cm"][line].as_array().expect("a line");
            line.iter()
                .map(|error| error.as_f64().expect("cm"))
                .collect()
        };
        if name.starts_with("wheel slip") {
            // Without wheels nothing slips.
            let blind = errors(1);
            assert!(blind.iter().all(|error| *error == blind[0]), "{blind:?}");
        }
        if name.starts_with("range noise") {
            // From exact ranges to 8 cm: far beyond what chance does.
            let with = errors(0);
            assert!(with[5] > 3.0 * with[0], "{with:?}");
        }
    }
}
