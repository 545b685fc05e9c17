//! The matchers beside one that tries every pose of a grid, in doubles, against the walls as they are.

use crate::common::{field_of, points_of};
use beamfix::{
    geometry::Pose,
    matching::{
        field::{self, FieldConfig},
        icp::{self, IcpConfig, Reference},
    },
    scan::ScanPoint,
    sensor_model::likelihood_field::FieldModel,
};
use beamfix_sim::{
    Noise, TruePose, World,
    lidar::{Ranging, Still},
    scenes,
};

const BEAMS: usize = 180;

/// What a robust least square finds from here on: squared distances (m²) of the scan's points to the nearest walls, each counted up
/// to three standard deviations.
fn cost(world: &World, points: &[ScanPoint], at: TruePose) -> f64 {
    let one = |point: &ScanPoint| {
        let (x, y) = (1e-3 * f64::from(point.x()), 1e-3 * f64::from(point.y()));
        let hit = at.then(TruePose::new(x, y, 0.0));
        world.clearance([hit.x, hit.y]).min(0.03).powi(2)
    };
    points.iter().map(one).sum()
}

/// The best of all poses on a grid around `at`, then of a finer one around that.
fn best(world: &World, points: &[ScanPoint], at: TruePose) -> TruePose {
    let mut best = at;
    for (step, turn) in [(0.01, 0.01), (0.002, 0.002), (0.0005, 0.0005)] {
        let middle = best;
        let mut least = f64::INFINITY;
        for k in 0..9 * 9 * 9i32 {
            let part = |n: i32| f64::from(k / n % 9 - 4);
            let pose = TruePose::new(
                middle.x + step * part(1),
                middle.y + step * part(9),
                middle.theta + turn * part(81),
            );
            let cost = cost(world, points, pose);
            if cost < least {
                (least, best) = (cost, pose);
            }
        }
    }
    best
}

#[test]
fn a_match_is_where_trying_every_pose_ends() {
    let mut lines = Box::new(Reference::<BEAMS>::new());
    let (mut tried, mut metres, mut degrees) = (0, [0.0f64; 2], [0.0f64; 2]);
    for seed in 0..12 {
        let world = scenes::office(seed);
        let mut noise = Noise::new(seed, 61);
        let place = scenes::office_place(&world, 0.8, &mut noise);
        let motion = TruePose::new(
            noise.even(-0.05, 0.05),
            noise.even(-0.05, 0.05),
            noise.even(-0.05, 0.05),
        );
        // The reference sees the walls as they are: what is left is the other scan's noise.
        let exact = Still {
            ranging: Ranging::TRUE,
            ..Still::full_turn(BEAMS)
        };
        let reference = points_of(&exact.scan(&world, place, &mut noise));
        let current =
            points_of(&Still::full_turn(BEAMS).scan(&world, place.then(motion), &mut noise));
        lines.assign(&reference);
        let guess = Pose::from(motion) * Pose::new(0.02, -0.02, 0.01);
        let (Ok(by_icp), Ok(by_field)) = (
            icp::align(&lines, &current, guess, &IcpConfig::DEFAULT),
            field::align(
                &field_of(&reference, 0.05, &FieldModel::DEFAULT).as_slice(),
                &current,
                guess,
                &FieldConfig::DEFAULT,
            ),
        ) else {
            panic!("seed {seed}: not matched");
        };
        let best = best(&world, &current, place.then(motion));
        tried += 1;
        for (k, found) in [by_icp, by_field].iter().enumerate() {
            let off = best.between(place.then(found.pose.into()));
            metres[k] = metres[k].max(off.distance());
            degrees[k] = degrees[k].max(off.theta.to_degrees().abs());
        }
    }
    println!(
        "{tried} scans: lines {:.2} mm {:.3} deg, field {:.2} mm {:.3} deg",
        1e3 * metres[0],
        degrees[0],
        1e3 * metres[1],
        degrees[1]
    );
    // Lines are laid through beams 3 to 15 cm apart, which cut corners; a field has cells of 5 cm.
    assert!(
        metres[0] < 0.003 && degrees[0] < 0.05,
        "{metres:?} {degrees:?}"
    );
    assert!(
        metres[1] < 0.004 && degrees[1] < 0.1,
        "{metres:?} {degrees:?}"
    );
}
