//! A ring of multi-zone rangers through the flat: its last scans together find the way.

use crate::common::kept::Kept;
use beamfix::geometry::Pose;
use beamfix::math::wrap_angle;
use beamfix::odometry::Step;
use beamfix::pipeline::Tracker;
use beamfix::scan::Mount;
use beamfix_sim::lidar::Ranging;
use beamfix_sim::ring::{Ring, RingModel};
use beamfix_sim::{Settings, drive};
use host_tests::{pipeline::sparse_odometry, report::score};

/// What came of a minute in the flat.
#[derive(Debug, Default)]
struct Outcome {
    /// At the end, and the largest (m, deg).
    last: (f64, f64),
    largest: (f64, f64),
    wheels: (f64, f64),
    refused: u32,
    /// Mean normalised squared error a degree of freedom: 1 is ideal.
    nees: f64,
    /// Scans off by more than 5 cm or 1° with a normalised squared error above 25.
    confident: u32,
}

fn minute(model: RingModel, seed: u64) -> Outcome {
    drive_and(model, seed, |_| ())
}

fn drive_and(model: RingModel, seed: u64, mut observe: impl FnMut(&Step)) -> Outcome {
    let settings = Settings {
        seed,
        seconds: 60.0,
        ranging: Ranging::TRUE,
        ..Settings::DEFAULT
    };
    let mut ring = Ring::new(model, seed);
    let run = drive(&settings, &mut ring);
    let mount = Mount {
        robot_from_lidar: settings.mount.into(),
        ..Mount::DEFAULT
    };
    let odometry = sparse_odometry(mount, model.width() as f32);
    let mut tracker = Box::new(Tracker::<_, 64>::new(odometry));
    let origin = run.moments[ring.scans[0].0 - 1];
    let (mut outcome, mut measured) = (Outcome::default(), 0.0);
    for (looks, beams) in &ring.scans {
        let now = run.moments[looks - 1];
        tracker.push_wheels(beams[0].time_us, now.wheels.into());
        let mut step: Option<Step> = None;
        tracker.push_scan(beams.iter().copied(), |revolution| {
            step = Some(*revolution.step);
        });
        let step = step.expect("a scan gives a step");
        observe(&step);
        let truth: Pose = origin.truth.between(now.truth).into();
        let error = score::error(step.pose, truth);
        outcome.last = error;
        outcome.largest.0 = outcome.largest.0.max(error.0);
        outcome.largest.1 = outcome.largest.1.max(error.1);
        outcome.wheels = score::error(origin.wheels.between(now.wheels).into(), truth);
        let (Ok(_), Some(information)) = (step.outcome, step.covariance.information()) else {
            outcome.refused += 1;
            continue;
        };
        let off = [
            step.pose.x - truth.x,
            step.pose.y - truth.y,
            wrap_angle(step.pose.theta - truth.theta),
        ];
        let square = f64::from(information.0.quadratic(off));
        outcome.nees += square / 3.0;
        measured += 1.0;
        let is_wrong = error.0 > 0.05 || error.1 > 1.0;
        outcome.confident += u32::from(is_wrong && square > 25.0);
    }
    outcome.nees /= measured;
    outcome
}

/// Settings were chosen by looking at these drives too: this keeps what was reached, and `other_drives` shows what it is worth. Since lines are
/// weighed by the noise of their range, drives 10 and 23 are 3.35° and 3.05° off at a turn of the flat for a moment; of the drives that nobody chose by, 30 of
/// 32 are within, too.
#[test]
#[cfg_attr(debug_assertions, ignore = "drives of a minute")]
fn a_ring_of_64_beams_follows_a_minute_in_the_flat() {
    let (mut nees, mut confident, mut within) = (0.0, 0, 0);
    for seed in 1..=32 {
        let outcome = minute(RingModel::VL53L5CX, seed);
        println!("seed {seed}: {outcome:.3?}");
        nees += outcome.nees / 32.0;
        confident += outcome.confident;
        within += u32::from(outcome.largest.0 < 0.15 && outcome.largest.1 < 3.0);
        assert!(
            outcome.largest.0 < 0.15 && outcome.largest.1 < 3.5,
            "seed {seed}: {outcome:?}"
        );
        // The wheels alone are a metre and 30° off.
        assert!(
            outcome.last.1 < 0.2 * outcome.wheels.1,
            "seed {seed}: {outcome:?}"
        );
    }
    println!(
        "{within} of 32 drives within 15 cm and 3 deg at any time, {confident} scans wrong and confident, NEES {nees:.2}"
    );
    assert!(within >= 30 && confident == 0, "{within}, {confident}");
    // 1 is ideal; what errs alike in many matches is allowed for.
    assert!((0.67..1.5).contains(&nees), "{nees}");
}

/// Half of the ring is missing: the pose is up to 0.7 m off, not the 0.15 m of a whole ring (`other_drives`), and says so in these.
#[test]
#[cfg_attr(debug_assertions, ignore = "drives of a minute")]
fn a_ring_of_32_beams_says_how_far_off_it_is() {
    for seed in 9..=12 {
        let outcome = minute(RingModel::HALF, seed);
        println!("seed {seed}: {outcome:.3?}");
        assert!(
            outcome.last.0 < 0.6 && outcome.last.1 < 12.0,
            "seed {seed}: {outcome:?}"
        );
        assert!(
            outcome.nees < 1.5 && outcome.confident == 0,
            "seed {seed}: {outcome:?}"
        );
    }
}

/// The largest errors of drives by which no setting of the whole ring was chosen, and of half a ring.
///
/// `cargo test --release -p host-tests --test odometry sparse::other_drives -- --ignored --nocapture`
#[test]
#[ignore = "a measurement"]
fn other_drives_of_a_whole_ring_and_of_half_a_ring() {
    for (name, model, seeds) in [
        ("64 beams", RingModel::VL53L5CX, 65..=96),
        ("32 beams", RingModel::HALF, 1..=16),
        ("32 beams", RingModel::HALF, 65..=80),
    ] {
        let outcomes: Vec<_> = seeds.clone().map(|seed| minute(model, seed)).collect();
        let count = outcomes.len();
        let within = |o: &&Outcome| o.largest.0 < 0.15 && o.largest.1 < 3.0;
        let largest = |of: fn(&Outcome) -> f64| {
            let mut all: Vec<_> = outcomes.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            (all[0], all[count / 2], all[count - 1])
        };
        println!(
            "{name}, seeds {seeds:?}: {} of {count} within 0.15 m and 3 deg at any time; least, median, largest {:.2?} m, {:.1?} deg; \
             {:.0} scans of a drive refused, {} wrong and confident, NEES {:.2}",
            outcomes.iter().filter(within).count(),
            largest(|o| o.largest.0),
            largest(|o| o.largest.1),
            outcomes.iter().map(|o| f64::from(o.refused)).sum::<f64>() / count as f64,
            outcomes.iter().map(|o| o.confident).sum::<u32>(),
            outcomes.iter().map(|o| o.nees).sum::<f64>() / count as f64,
        );
        assert!(outcomes.iter().all(|o| o.last.1 < 0.5 * o.wheels.1));
    }
}

#[test]
fn every_step_of_a_ring_has_the_bits_that_are_kept() {
    let mut kept = Kept::of("ring");
    drive_and(RingModel::VL53L5CX, 3, |step| kept.push("64 beams", step));
    kept.check();
}
