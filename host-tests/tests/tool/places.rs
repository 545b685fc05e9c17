//! `simulate` in a place that is as nasty as it can be described.

use std::fs;

use crate::common::tool::{beamfix, folder, json, text};

/// All that a description knows of, but for the wheels of other robots.
const NASTY: &str = "rectangle 12 9
mirror -6 -1 -6 1
glass 2 -4.5 2 -1
black -2 4.49 2 4.49
box -3 -3 -1.5 -2.2
box 3.5 1.5 5 3
column -2 1.5 0.2
wall -6 3 -3.5 3
door -3.5 3  -3.5 3.9  10 14
person -5 0  0 0.4
start -4.5 -3.5 0
way -0.5 -3.5  1 0  4.8 0  4.8 -3.5  4.8 0  1 0  0 3  -2.8 2.8  -4.5 2  -4.5 -3.5
wheels 7
gyro 0.5 0.2
slip 1 30 100
lidar bias 0.01
lidar distance 0.003
lidar grazing 1
lidar width 0.3
lidar sway 0.01
";

#[test]
fn a_nasty_place_is_driven_and_replays_to_the_same_poses() {
    let folder = folder("places");
    for (name, more) in [
        ("nasty", ""),
        ("omni", "drive omni"),
        ("car", "drive ackermann 0.4"),
    ] {
        let (place, out) = (folder.join(name).with_extension("txt"), folder.join(name));
        fs::write(&place, format!("{NASTY}{more}\n")).expect("a description");
        let run = json(&beamfix(&[
            "simulate",
            "--world",
            text(&place),
            "--seconds",
            "60",
            "--out",
            text(&out),
            "--json",
        ]));
        let worst = run["max_error_m"].as_f64().expect("an error");
        let driven = run["distance_m"].as_f64().expect("a distance");
        println!(
            "{name}: {driven:.1} m, at worst {:.1} cm off, {} refused",
            100.0 * worst,
            run["refused"]
        );
        assert!(driven > 10.0, "{run}");
        let replayed = json(&beamfix(&[
            "replay",
            text(&out.join("lidar.rec")),
            "--json",
        ]));
        assert_eq!(run["pose_hash"], replayed["pose_hash"], "{name}");
    }
}
