//! The golden runs on this machine, in this build: debug and release must give the bits that are kept.
//!
//! The emulated boards are compared by `beamfix verify`.

use host_tests::golden;

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
