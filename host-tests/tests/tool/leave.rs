//! What a run leaves in its folder: pictures, an animation, a map, a recording.

use std::fs::{self, File};
use std::path::Path;

use host_tests::formats::ros_map;
use host_tests::shared;

use crate::common::tool::{beamfix, folder, json, text};

/// Frames of an animation; panics where one is not whole.
fn frames(path: &Path) -> usize {
    let file = File::open(path).expect("an animation");
    let mut decoder = gif::Decoder::new(file).expect("a GIF");
    let mut count = 0;
    while let Some(frame) = decoder.read_next_frame().expect("whole frames") {
        assert_eq!((frame.width, frame.height), (720, 760));
        count += 1;
    }
    count
}

#[test]
fn every_mode_leaves_pictures_that_are_whole() {
    let folder = folder("leave");
    let (drive, map) = (folder.join("drive"), folder.join("flat.yaml"));
    let simulated = [
        "--seconds",
        "12",
        "--out",
        text(&drive),
        "--ros-map",
        text(&map),
        "--json",
    ];
    json(&beamfix(&simulated));
    let recording = drive.join("lidar.rec");
    let localize = ["--mode", "localize", "--map", text(&map)];
    for (mode, extra, has_field) in [
        ("odometry", &[][..], false),
        ("slam", &["--mode", "slam"][..], false),
        ("localize", &localize[..], true),
    ] {
        let out = folder.join(mode);
        let mut arguments = vec!["replay", text(&recording), "--out", text(&out), "--json"];
        arguments.extend(extra);
        let _ = fs::remove_dir_all(&out);
        json(&beamfix(&arguments));
        for picture in ["map.png", "match.png"] {
            let picture = image::open(out.join(picture)).expect(mode);
            assert!(picture.width() >= 1500 && picture.height() > 600, "{mode}");
        }
        assert_eq!(out.join("field.png").exists(), has_field, "{mode}");
        // The guess, and at least a pass.
        assert!(frames(&out.join("match.gif")) >= 2, "{mode}");
        let seen = ros_map::read(&out.join("seen.yaml")).expect(mode);
        let walls = seen.cells().iter().filter(|byte| **byte > 128).count();
        assert!(walls > 200, "{mode}: {walls} cells of walls");
        assert!(out.join("run.mcap").exists(), "{mode}");
        // A graph states no covariance.
        let chart = fs::read_to_string(out.join("errors.svg")).ok();
        assert_eq!(chart.is_some(), mode != "slam", "{mode}");
        assert!(chart.is_none_or(|chart| chart.contains("standard deviations")));
    }
}

/// PNG or SVG by its ending, the map, errors, a match or a field by its name; of a lidar with more beams than are matched too.
#[test]
fn a_picture_is_what_its_name_says() {
    let folder = folder("leave-pictures");
    let out = folder.join("run");
    let names = ["drive", "errors", "match", "field"];
    let files: Vec<_> = names
        .iter()
        .flat_map(|name| [".png", ".svg"].map(|ending| folder.join(format!("{name}{ending}"))))
        .collect();
    let drawn: Vec<&str> = files
        .iter()
        .flat_map(|file| ["--picture", text(file)])
        .collect();
    let simulate = ["simulate", "--lidar", "stl27l", "--seconds", "6", "--out"];
    let run = beamfix(&[&simulate[..], &[text(&out)], &drawn].concat());
    let said = String::from_utf8_lossy(&run.stdout);
    for word in ["lidar.rec", "match.png", "match.gif", "pose hash"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let shows = [
        "measured points",
        "standard deviations",
        "at the guess",
        "likelihood field",
    ];
    for (pair, shows) in files.chunks(2).zip(shows) {
        let picture = image::open(&pair[0]).expect(shows);
        assert!(picture.width() >= 1300, "{shows}");
        let shapes = fs::read_to_string(&pair[1]).expect(shows);
        assert!(shapes.starts_with("<svg") && shapes.contains(shows));
        assert!(shapes.matches('<').count() > 100, "{shows}");
    }
    // What it recorded gives the same poses, from either file.
    let hash = said
        .split("pose hash ")
        .nth(1)
        .and_then(|rest| rest.lines().next());
    for name in ["lidar.rec", "run.mcap"] {
        let replayed = json(&beamfix(&["replay", text(&out.join(name)), "--json"]));
        assert_eq!(replayed["pose_hash"].as_str(), hash, "{name}");
    }
    // A field is of a map.
    let field = folder.join("none").join("field.png");
    let recording = out.join("lidar.rec");
    let run = beamfix(&["replay", text(&recording), "--picture", text(&field)]);
    let told = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && told.contains("not drawn"), "{told}");
}

#[test]
fn a_ros_bag_of_a_ros_bag_gives_its_poses() {
    // That rosbags reads it: host-tests/python/tests/test_recordings.py.
    let folder = folder("leave-bag");
    let as_bag = ["--recording-format", "ros2", "--json", "--out"];
    let simulated = ["--seconds", "10"];
    json(&beamfix(
        &[&simulated[..], &as_bag, &[text(&folder)]].concat(),
    ));
    let (bag, out) = (folder.join("bag"), folder.join("replay"));
    let replay = ["replay", text(&bag)];
    let first = json(&beamfix(&[&replay[..], &as_bag, &[text(&out)]].concat()));
    let bag = out.join("bag");
    let again = json(&beamfix(&["replay", text(&bag), "--json"]));
    assert_eq!(again, first);
}

#[test]
fn what_is_replayed_is_not_written_over() {
    let folder = folder("leave-over");
    let arguments = ["--seconds", "2", "--out", text(&folder)];
    assert!(beamfix(&arguments).status.success());
    let recording = folder.join("run.mcap");
    let before = fs::read(&recording).expect("a recording");
    let run = beamfix(&["replay", text(&recording), "--out", text(&folder)]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("overwritten"));
    assert_eq!(fs::read(&recording).expect("a recording"), before);
}

/// Pictures, recording and a line of summary: of a run into `folder`, by one command.
fn leaves_all(arguments: &[&str], folder: &Path) {
    let _ = fs::remove_dir_all(folder);
    let run = beamfix(&[arguments, &["--out", text(folder)]].concat());
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(said.contains("pose hash"), "{arguments:?}: {said}");
    for name in ["map.png", "errors.svg", "run.mcap"] {
        let bytes = fs::read(folder.join(name)).expect(name);
        assert!(bytes.len() > 1000, "{arguments:?}: {name}");
    }
}

#[test]
fn one_command_leaves_all_of_it_in_every_world_and_for_every_log() {
    let folder = folder("leave-all");
    for (world, _) in beamfix_sim::place::NAMES {
        leaves_all(&["--world", world, "--seconds", "5"], &folder);
    }
    let mut logs = 0;
    for kind in ["logs", "lowcost"] {
        let Some(shared) = shared::folder() else {
            println!("left out: the logs of ../shared/datasets/{kind} are not there");
            continue;
        };
        let path = shared.join("datasets").join(kind);
        for entry in fs::read_dir(path).expect("a folder") {
            let path = entry.expect("an entry").path();
            if [".log.gz", ".lscan"]
                .iter()
                .any(|end| text(&path).ends_with(end))
            {
                leaves_all(&["replay", text(&path), "--scans", "60"], &folder);
                logs += 1;
            }
        }
    }
    println!("{logs} logs replayed");
}

#[test]
fn a_ring_of_rangers_has_the_same_poses_from_its_log_and_from_its_bag() {
    let folder = folder("leave-ring");
    let simulated = ["--lidar", "vl53l5cx-ring", "--seconds", "20", "--json"];
    let as_bag = ["--recording-format", "ros2", "--out", text(&folder)];
    let run = json(&beamfix(&[&["simulate"], &simulated[..], &as_bag].concat()));
    for name in ["ring.log", "bag"] {
        let path = folder.join(name);
        let replayed = json(&beamfix(&["replay", text(&path), "--json"]));
        assert_eq!(run["pose_hash"], replayed["pose_hash"], "{name}");
    }
}
