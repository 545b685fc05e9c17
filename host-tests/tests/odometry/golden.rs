//! The golden runs on this machine, in this build: debug and release must give the bits that are kept.
//!
//! The emulated boards are compared by `beamfix verify`.

use crate::common::kept::Kept;
use beamfix_sim::catalogue;
use host_tests::golden;
use host_tests::report::scene::{self, Runs};

#[test]
fn every_pose_has_the_bits_that_are_kept() {
    let runs = golden::all().unwrap_or_else(|error| panic!("{error:#}"));
    if runs.len() < 2 {
        println!("left out: intel-1000, ../shared is not there");
    }
    for run in runs {
        let kept = run.kept().unwrap_or_else(|error| panic!("{error:#}"));
        let difference = golden::difference(&kept, &run.poses());
        assert_eq!(
            difference, None,
            "{}: if the change is meant, run `cargo run --release -- verify --bless` and commit host-tests/golden",
            run.name
        );
    }
}

/// Scenes of every kind: what steps of them hold, with covariances and refusals.
const SCENES: [&str; 20] = [
    "flat-no-wheels",
    "yard",
    "corridor-no-wheels",
    "wheels-start-over-often",
    "wheels-jitter-100-ms",
    "wheels-7-hz",
    "wheels-slip",
    "corridor-person-ahead",
    "own-mast-no-wheels",
    "crowd-one-way",
    "carried-far-under-a-cover",
    "covered-3-s-no-wheels",
    "outliers-30-percent-no-wheels",
    "beams-64",
    "drive-1-cm-and-2-percent",
    "lds-01",
    "turns-360-deg-per-s-no-wheels",
    "square-room-after-a-gap",
    "beams-by-bearing",
    "sick-0.5-deg-interleaved",
];

#[test]
fn every_step_of_the_scenes_has_the_bits_that_are_kept() {
    let mut kept = Kept::of("scenes");
    let mut run = |name: &str, runs, what: &str| {
        let all = catalogue::all();
        let entry = all.iter().find(|entry| entry.name == name);
        let entry = entry.unwrap_or_else(|| panic!("no scene {name}"));
        let push = |_, step: &_, _| kept.push(what, step);
        scene::run(entry, (1, runs), |config| config, push);
    };
    for name in SCENES {
        run(name, Runs::Odometry, name);
    }
    run("hall", Runs::Rolling, "hall, on a rolling map");
    kept.check();
}
