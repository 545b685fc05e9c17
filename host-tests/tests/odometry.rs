//! The odometry over simulated drives: how far off it is, and how far off it says it may be.

use beamfix::geometry::Pose;
use beamfix::math::wrap_angle;
use beamfix::odometry::OdometryConfig;
use host_tests::encoder::ld06::Sensor;
use host_tests::pipeline::Pipeline;
use host_tests::readers::capture;
use host_tests::sim::{self, Settings, TruePose};

/// How far off the pose is after each scan of a drive.
struct Off {
    metres: f64,
    degrees: f64,
    /// Squared error over what the covariance says: 3 on average where it says the truth.
    normalised: f64,
}

fn drive(seed: u64) -> Vec<Off> {
    let settings = Settings {
        seconds: 60.0,
        seed,
        mount: TruePose::new(0.0, 0.0, 0.0),
        ..Settings::DEFAULT
    };
    let drive = sim::drive(&settings, &mut Sensor::ld06());
    let (turns, _) = capture::turns("ld06", &drive.bytes).expect("bytes of an LD06");
    let mut pipeline = Pipeline::<456>::new(OdometryConfig::DEFAULT);
    let mut start: Option<Pose> = None;
    let mut found = Vec::new();
    for turn in turns {
        let moment = &drive.moments[turn.ends_at - 1];
        let truth: Pose = moment.truth.into();
        let origin = *start.get_or_insert(truth);
        let step = pipeline.step(&turn.beams, Some(moment.wheels.into()));
        let truth = origin.between(truth);
        let error = [
            step.pose.x - truth.x,
            step.pose.y - truth.y,
            wrap_angle(step.pose.theta - truth.theta),
        ];
        let information = step.covariance.0.inverse();
        found.push(Off {
            metres: truth.between(step.pose).distance().into(),
            degrees: f64::from(error[2].abs()).to_degrees(),
            // The first pose is exact: there is nothing to divide by.
            normalised: information.map_or(0.0, |i| f64::from(i.quadratic(error))),
        });
    }
    found
}

#[test]
#[cfg_attr(debug_assertions, ignore = "eight drives of a minute")]
fn the_pose_is_as_far_off_as_it_says() {
    let drives: Vec<Off> = (1..=8)
        .flat_map(|seed| {
            let steps = drive(seed);
            let half = steps.len() / 2;
            steps.into_iter().skip(half)
        })
        .collect();
    let mean = |value: fn(&Off) -> f64| drives.iter().map(value).sum::<f64>() / drives.len() as f64;
    let (metres, degrees) = (mean(|off| off.metres), mean(|off| off.degrees));
    let normalised = mean(|off| off.normalised);
    println!(
        "second half of 8 drives: {:.2} cm, {degrees:.3} deg; normalised squared error {normalised:.2}",
        100.0 * metres
    );
    assert!(metres < 0.02 && degrees < 0.25);
    assert!(normalised > 1.5 && normalised < 5.0);
}
