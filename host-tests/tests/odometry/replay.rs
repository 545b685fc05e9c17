//! Odometry over recorded logs, against relations that people checked by hand: `../shared`, where it exists.

use beamfix::geometry::Pose;
use beamfix::odometry::OdometryConfig;
use beamfix::scan::Mount;
use host_tests::formats::{self, Log};
use host_tests::pipeline::Pipeline;
use host_tests::report::relations::{self, Errors, Placed};
use host_tests::report::score;
use host_tests::{shared, size, sized};

fn replay<const N: usize>(log: &Log, wheels: bool) -> (Vec<Placed>, u32) {
    let mount = Mount {
        robot_from_lidar: log.mount.robot_from_lidar,
        ..Mount::DEFAULT
    };
    let mut pipeline = Pipeline::<N>::new(OdometryConfig::DEFAULT.with_mount(mount));
    let track = log.scans.iter().map(|scan| {
        let pose = pipeline
            .step(&scan.beams, scan.wheels.filter(|_| wheels))
            .pose;
        (scan.stamp.parse().expect("a number"), pose.into())
    });
    (track.collect(), pipeline.counters().refused)
}

fn track(log: &Log, wheels: bool) -> (Vec<Placed>, u32) {
    let size = size::fitting(log.scans.iter().map(|scan| &scan.beams[..]));
    sized!(size, replay(log, wheels))
}

#[test]
fn drift_over_recorded_logs_stays_below_what_was_asked_for() {
    //   log      scans   near relations  allowed (m, degrees) with wheels and without
    for (name, scans, relations, with_wheels, without) in [
        ("intel", 13_631, 1770, (0.016, 0.25), (0.025, 0.25)),
        ("fr079", 4934, 987, (0.030, 0.45), (0.030, 0.45)),
    ] {
        let Some(path) = shared::file(&format!("datasets/logs/{name}.log.gz")) else {
            continue;
        };
        let log = formats::read(&path).expect("the log");
        assert_eq!(
            (log.scans.len(), log.skipped, log.cut.is_none()),
            (scans, 0, true),
            "{name}"
        );
        for (wheels, allowed) in [(true, with_wheels), (false, without)] {
            let (track, refused) = track(&log, wheels);
            // What `tools/relations_eval.py` calls near.
            let relations_file = path.with_file_name(format!("{name}.relations"));
            let Errors {
                metres,
                degrees,
                used,
            } = relations::errors(track, &relations_file, 10.0).expect("the relations");
            println!(
                "{name}, wheels {wheels}: {used} relations, {metres:.4} m, {degrees:.3}°, {refused} scans refused"
            );
            assert_eq!(used, relations, "{name}");
            assert!(
                metres <= allowed.0 && degrees <= allowed.1,
                "{name}, wheels {wheels}: {metres} m, {degrees}°, allowed {allowed:?}"
            );
        }
    }
}

#[test]
fn the_binary_copy_of_a_log_gives_the_same_beams_and_stamps() {
    for name in ["intel", "fr079"] {
        let Some(path) = shared::file(&format!("datasets/logs/{name}.log.gz")) else {
            continue;
        };
        let text = formats::read(&path).expect("the log");
        let binary =
            formats::read(&path.with_file_name(format!("{name}.lscan"))).expect("its copy");
        assert_eq!(text.scans.len(), binary.scans.len());
        for (k, (a, b)) in text.scans.iter().zip(&binary.scans).enumerate() {
            assert_eq!(a.beams.len(), b.beams.len(), "{name}, scan {k}");
            let same = a
                .beams
                .iter()
                .zip(&b.beams)
                .all(|(a, b)| a.bearing == b.bearing && a.range.mm().ok() == b.range.mm().ok());
            let stamps: [f64; 2] =
                [&a.stamp, &b.stamp].map(|stamp| stamp.parse().expect("a number"));
            assert!(
                same && (stamps[0] - stamps[1]).abs() < 2e-6,
                "{name}, scan {k} at {} and {}",
                a.stamp,
                b.stamp
            );
        }
    }
}

#[test]
fn low_cost_lidars_are_read_with_their_place_on_the_robot() {
    //   log              scans beams  lidar ahead of the robot's middle (m)
    for (name, scans, beams, ahead) in [
        ("slambot-24jul14", 237, 360, -0.035),
        ("slambot-6aug14", 3936, 360, -0.035),
        ("tinyslam-exp2", 641, 682, 0.145),
        ("tinyslam-exp3", 525, 682, 0.145),
    ] {
        let Some(path) = shared::file(&format!("datasets/lowcost/{name}.log.gz")) else {
            continue;
        };
        let log = formats::read(&path).expect("the log");
        let mount = log.mount.robot_from_lidar;
        assert_eq!(
            (log.scans.len(), log.scans[0].beams.len(), log.skipped),
            (scans, beams, 0),
            "{name}"
        );
        assert!(
            (mount.x - ahead).abs() < 1e-3 && mount.y.abs() < 1e-3 && mount.theta.abs() < 1e-3,
            "{name}: {mount:?}"
        );
    }
}

#[test]
fn a_real_capture_of_an_ld19_stands_still() {
    let Some(path) = shared::file("datasets/serial/ld19-20240828.bin") else {
        return;
    };
    let log = formats::capture::log::read(&path, "ld06").expect("the capture");
    assert!(
        (41..=43).contains(&log.scans.len()),
        "{} turns",
        log.scans.len()
    );
    let (track, _) = track(&log, false);
    for (time, pose) in track {
        let (metres, degrees) = score::error(Pose::from(pose), Pose::IDENTITY);
        assert!(
            metres < 0.01 && degrees < 0.5,
            "at {time} s: {metres} m, {degrees}°"
        );
    }
}
