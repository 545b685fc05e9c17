//! From a lidar's bytes to the robot's pose: `cargo run --release --example pose_from_bytes`.
//!
//! A robot with an LD06 drives for five seconds along an arc. On a board the bytes come from a UART.

#![allow(clippy::disallowed_methods)] // The world around the lidar may use what std has.

mod room;

use beamfix::lidar::parsers::Ldrobot;
use beamfix::{Odometry, OdometryConfig, Pipeline, Pose, Revolution};

fn main() {
    let start = Pose::new(1.5, 1.0, 0.3);
    let drive = |seconds: f32| {
        let driving = (seconds - 0.2).max(0.0); // from a standstill
        start
            * Pose::new(
                0.08 * driving * driving,
                0.01 * driving * driving,
                0.1 * driving,
            )
    };
    let bytes = room::ld06(drive, 50);

    let odometry = Odometry::<456>::new(OdometryConfig::DEFAULT);
    let mut robot = Pipeline::new(Ldrobot::new(), odometry);
    let mut pose = Pose::IDENTITY;
    for (k, piece) in bytes.chunks(32).enumerate() {
        robot.set_time((k * 32 * 56) as u32); // µs: a byte takes 56 at 5 s for all of them
        robot.push(piece, &mut |revolution: Revolution<Odometry<456>, 456>| {
            let step = revolution.step;
            let sigma = step.covariance.to_array()[0].sqrt();
            let verdict = step
                .outcome
                .map_or_else(|refusal| refusal.to_string(), |_| "ok".into());
            println!(
                "{:.3} {:.3} {:.3} ± {sigma:.4} m: {verdict}",
                step.pose.x, step.pose.y, step.pose.theta
            );
            pose = step.pose;
        });
    }
    // The first revolution ended 0.1 s after the start: that place is the odometry's origin.
    let truth = drive(0.1).between(drive(4.9));
    let off = truth.between(pose);
    println!(
        "off by {:.1} mm and {:.2} deg after 1.9 m",
        1000.0 * off.distance(),
        off.theta.to_degrees()
    );
    assert!(off.distance() < 0.03, "{truth:?} {pose:?}");
}
