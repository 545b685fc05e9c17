//! The motion between two scans: `cargo run --release --example match_two_scans`.

#![allow(clippy::disallowed_methods)] // The world around the lidar may use what std has.

mod room;

use beamfix::matching::icp::{self, IcpConfig, Reference};
use beamfix::scan::{Points, PointsConfig};
use beamfix::{Pose, Twist};

fn main() {
    let (before, after) = (Pose::new(1.5, 1.0, 0.3), Pose::new(1.65, 1.1, 0.42));
    let mut points = Points::<360>::new();

    // The reference: surfaces of the scan that the other is matched against.
    points.assign(
        &room::scan(room::WALLS, before),
        Twist::ZERO,
        &PointsConfig::DEFAULT,
    );
    let mut reference = Reference::<360>::new();
    reference.assign(points.as_slice());

    points.assign(
        &room::scan(room::WALLS, after),
        Twist::ZERO,
        &PointsConfig::DEFAULT,
    );
    let guess = Pose::IDENTITY; // as if it had not moved
    match icp::align(&reference, points.as_slice(), guess, &IcpConfig::DEFAULT) {
        Ok(found) => {
            let off = before.between(after).between(found.pose);
            println!(
                "moved by {:?}, {} of {} beams agree",
                found.pose, found.inliers, found.beams
            );
            println!(
                "off by {:.2} mm and {:.3} deg",
                1000.0 * off.distance(),
                off.theta.to_degrees()
            );
            assert!(off.distance() < 0.005, "{off:?}");
        }
        Err(error) => panic!("no pose: {error}"),
    }
}
