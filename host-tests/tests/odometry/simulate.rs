//! The simulated drive from ray casting to pose: the same in every run, and right.

use beamfix::geometry::Pose;
use beamfix::math::wrap_angle;
use beamfix::odometry::OdometryConfig;
use beamfix::scan::Mount;
use beamfix_sim::encoder::ld06::Sensor;
use beamfix_sim::{Drive, Settings, drive, scenes};
use beamfix_sim::{Noise, Still, TruePose};
use host_tests::formats::capture::log;
use host_tests::pipeline::Pipeline;
use host_tests::report::hash::Fnv1a;
use host_tests::report::score;

fn run(seed: u64, seconds: f64) -> Drive {
    let settings = Settings {
        seed,
        seconds,
        ..Settings::DEFAULT
    };
    drive(&settings, &mut Sensor::ld06())
}

/// The firmware's pipeline, with the lidar where the simulated robot has it.
fn pipeline() -> Box<Pipeline<456>> {
    Pipeline::new(OdometryConfig::DEFAULT.with_mount(Mount {
        robot_from_lidar: Settings::DEFAULT.mount.into(),
        ..Mount::DEFAULT
    }))
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hash = Fnv1a::EMPTY;
    hash.push(bytes);
    hash.0
}

#[test]
fn a_seed_gives_the_same_bytes_every_time_and_on_every_machine() {
    let (first, second) = (run(1, 10.0), run(1, 10.0));
    assert_eq!(first.bytes, second.bytes);
    assert_eq!(first.moments, second.moments);
    assert_ne!(hash(&first.bytes), hash(&run(2, 10.0).bytes));
    // Kept from the day it was made: another machine, another compiler must give it too.
    assert_eq!(
        hash(&first.bytes),
        0x6bfd_a734_62b7_0d6e,
        "{:#018x}",
        hash(&first.bytes)
    );
}

#[test]
fn the_drive_through_the_flat_ends_within_3_cm_and_half_a_degree() {
    let run = run(Settings::DEFAULT.seed, Settings::DEFAULT.seconds);
    let (revolutions, summary) = log::revolutions("ld06", &run.bytes).expect("an LD06");
    assert_eq!((summary.check_errors, summary.skipped_bytes), (0, 0));
    let last = run.moments[run.moments.len() - 1];
    assert!(
        last.time >= 60.0 && run.distance >= 30.0,
        "{} s, {} m",
        last.time,
        run.distance
    );
    let mut pipeline = pipeline();
    let origin = run.moments[revolutions[0].ends_at - 1].truth;
    let mut error = (0.0, 0.0);
    for revolution in &revolutions {
        let now = run.moments[revolution.ends_at - 1];
        let pose = pipeline
            .step(&revolution.beams, Some(now.wheels.into()))
            .pose;
        error = score::error(pose, origin.between(now.truth).into());
    }
    let counters = pipeline.counters();
    println!(
        "{} scans, {counters:?}: final error {:.4} m, {:.3}°",
        revolutions.len(),
        error.0,
        error.1
    );
    assert_eq!(counters.scans as usize, revolutions.len());
    assert_eq!(pipeline.refused_beams(), 0);
    assert!(
        error.0 < 0.03 && error.1 < 0.5,
        "final error {} m, {}°",
        error.0,
        error.1
    );
}

/// How far off the odometry is, and how far off it says it may be.
#[test]
#[cfg_attr(debug_assertions, ignore = "eight drives of a minute")]
fn the_pose_is_as_far_off_as_it_says() {
    let (mut count, mut metres, mut degrees, mut normalised) = (0.0, 0.0, 0.0, 0.0);
    for seed in 1..=8 {
        let run = run(seed, 60.0);
        let (revolutions, _) = log::revolutions("ld06", &run.bytes).expect("an LD06");
        let mut pipeline = pipeline();
        let origin = run.moments[revolutions[0].ends_at - 1].truth;
        for (number, revolution) in revolutions.iter().enumerate() {
            let now = run.moments[revolution.ends_at - 1];
            let step = pipeline.step(&revolution.beams, Some(now.wheels.into()));
            // At first there is hardly any error.
            if number < revolutions.len() / 2 {
                continue;
            }
            let truth: Pose = origin.between(now.truth).into();
            let off = [
                step.pose.x - truth.x,
                step.pose.y - truth.y,
                wrap_angle(step.pose.theta - truth.theta),
            ];
            let information = step.covariance.information().expect("a covariance").0;
            let error = score::error(step.pose, truth);
            count += 1.0;
            metres += error.0;
            degrees += error.1;
            normalised += f64::from(information.quadratic(off));
        }
    }
    let (metres, degrees, normalised) = (metres / count, degrees / count, normalised / count);
    println!(
        "second half of 8 drives: {:.2} cm, {degrees:.3}°; normalised squared error {normalised:.2}",
        100.0 * metres
    );
    assert!(metres < 0.014 && degrees < 0.12);
    // 3 where the covariance says the truth; less, as it allows for more at turns than goes wrong there.
    assert!(normalised > 1.2 && normalised < 5.0);
}

#[test]
fn a_gap_between_scans_is_bridged_by_the_wheels() {
    let run = run(1, 30.0);
    let (revolutions, _) = log::revolutions("ld06", &run.bytes).expect("an LD06");
    let mut pipeline = pipeline();
    let origin = run.moments[revolutions[0].ends_at - 1].truth;
    let mut before = origin;
    for (number, revolution) in revolutions.iter().enumerate() {
        // Longer than the two seconds after which the clock no longer tells a velocity.
        if (150..180).contains(&number) {
            continue;
        }
        let now = run.moments[revolution.ends_at - 1];
        let moved = score::error(Pose::IDENTITY, before.between(now.truth).into());
        before = now.truth;
        let step = pipeline.step(&revolution.beams, Some(now.wheels.into()));
        let (metres, degrees) = score::error(step.pose, origin.between(now.truth).into());
        if number == 180 {
            assert!(moved.0 > 0.5, "{moved:?} in the gap");
        }
        // The first scan after the gap is not bent back by any velocity: some centimetres.
        assert!(
            metres < 0.1 && degrees < 1.5,
            "scan {number}: {metres} m, {degrees}°"
        );
    }
}

#[test]
fn wheels_alone_are_much_worse() {
    // Otherwise the drive would test the wheels, not the matcher.
    let run = run(1, 120.0);
    let first = run.moments[0];
    let errors = run.moments.iter().map(|now| {
        let (wheels, truth): (Pose, Pose) = (
            first.wheels.between(now.wheels).into(),
            first.truth.between(now.truth).into(),
        );
        score::error(wheels, truth)
    });
    let (metres, degrees) = errors.fold((0.0f64, 0.0f64), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    assert!(metres > 0.3 && degrees > 10.0, "{metres} m, {degrees}°");
}

#[test]
fn scenes_look_as_they_are_named() {
    let mut noise = Noise::new(1, 0);
    let still = Still::full_turn(360);
    //   scene                what the beams find: beams with a range, nearest, farthest (mm)
    for (name, world, found, nearest, farthest) in [
        ("corridor", scenes::corridor(), 330..=345, 960, 12_000),
        ("circle", scenes::circle(), 360..=360, 2_950, 3_050),
        ("wall", scenes::wall(), 155..=165, 1_960, 12_000),
        ("room", scenes::room(), 360..=360, 1_960, 3_250),
        ("empty", scenes::empty(), 0..=0, 0, 0),
    ] {
        let scan = still.scan(&world, TruePose::default(), &mut noise);
        let mm: Vec<u16> = scan
            .iter()
            .filter_map(|beam| beam.range.mm().ok())
            .collect();
        assert!(
            found.contains(&mm.len()),
            "{name}: {} beams have a range",
            mm.len()
        );
        for mm in mm {
            assert!((nearest..=farthest).contains(&mm), "{name}: {mm} mm");
        }
    }
    for seed in 0..20 {
        let office = scenes::office(seed);
        let place = scenes::office_place(&office, 0.4, &mut noise);
        assert!(office.clearance([place.x, place.y]) >= 0.4, "office {seed}");
        let seen = still
            .scan(&office, place, &mut noise)
            .iter()
            .filter(|beam| beam.range.is_some())
            .count();
        assert!(seen > 340, "office {seed}: {seen} beams have a range");
    }
}
