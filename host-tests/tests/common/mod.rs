//! What tests share.
#![allow(dead_code)]

pub mod bag;
pub mod cable;
pub mod figures;
pub mod files;
pub mod kept;
pub mod tool;

use beamfix::{
    geometry::{Pose, Twist},
    grid::Shape,
    scan::{Beam, Points, PointsConfig, Scan, ScanPoint},
    sensor_model::likelihood_field::{
        FieldModel, LikelihoodField, Profile,
        draw::{self, Canvas, DrawConfig},
    },
};
use beamfix_sim::{lidar::Still, noise::Noise, pose::TruePose, world::World};
use host_tests::formats::pairs::{self, Pair};
use host_tests::shared;

/// The points of a scan taken at one moment.
pub fn points_of(beams: &[Beam]) -> Vec<ScanPoint> {
    let mut scan = Scan::<2000>::new();
    for beam in beams {
        scan.push(*beam).expect("room");
    }
    let mut points = Points::<2000>::new();
    points.assign(&scan, Twist::ZERO, &PointsConfig::DEFAULT);
    points.as_slice().to_vec()
}

/// The points seen from a place.
pub fn points_from(
    world: &World,
    sensor: TruePose,
    beams: usize,
    noise: &mut Noise,
) -> Vec<ScanPoint> {
    points_of(&Still::full_turn(beams).scan(world, sensor, noise))
}

/// The field of one scan, 24 m square around it.
pub fn field_of(
    points: &[ScanPoint],
    resolution: f32,
    model: &FieldModel,
) -> LikelihoodField<Vec<u8>> {
    let side = (24.0 / resolution) as u32;
    let shape = Shape::new(side, side, resolution, Pose::new(-12.0, -12.0, 0.0)).expect("good");
    let profile = Profile::new(model);
    let mut field =
        LikelihoodField::unexplored(shape, vec![0; shape.len()], *profile.scale()).expect("fits");
    draw::scan(
        &mut field,
        points,
        Pose::IDENTITY,
        &profile,
        &DrawConfig::DEFAULT,
    );
    field
}

/// The field of a simulated place, exact: the distance from each cell's middle to the nearest face.
pub fn field_of_world(
    world: &World,
    low: [f64; 2],
    high: [f64; 2],
    resolution: f32,
    model: &FieldModel,
) -> LikelihoodField<Vec<u8>> {
    let side = |k: usize| ((high[k] - low[k]) / f64::from(resolution)).round() as u32;
    let origin = Pose::new(low[0] as f32, low[1] as f32, 0.0);
    let shape = Shape::new(side(0), side(1), resolution, origin).expect("good");
    let profile = Profile::new(model);
    let mut field =
        LikelihoodField::unexplored(shape, vec![0; shape.len()], *profile.scale()).expect("fits");
    for y in 0..i32::from(shape.height()) {
        for x in 0..i32::from(shape.width()) {
            let middle = shape.middle_of(x, y);
            let mm = 1000.0 * world.clearance([f64::from(middle.x), f64::from(middle.y)]);
            field.raise(x, y, profile.byte((mm * mm).min(4e9) as u32));
        }
    }
    field
}

/// Pairs of a level matched: number, number right (5 cm, 1°), mean error of these (mm, °).
pub fn over_pairs(
    level: i32,
    align: impl Fn(&Pair, &[ScanPoint], &[ScanPoint]) -> Option<Pose>,
) -> Option<[f64; 4]> {
    let scans = shared::file("pairs/host/scans_sim.txt.gz")?;
    let list = shared::file("pairs/host/pairs_sim_consec.csv.gz")?;
    let pairs = pairs::read(&scans, &list).expect("a list");
    let [mut count, mut right, mut metres, mut degrees] = [0.0; 4];
    for pair in pairs.pairs.iter().filter(|p| p.level == level) {
        let reference = points_of(&pairs.scans[pair.reference]);
        let current = points_of(&pairs.scans[pair.current]);
        count += 1.0;
        let Some(found) = align(pair, &reference, &current) else {
            continue;
        };
        let off = pair.truth.between(found);
        if off.distance() < 0.05 && off.theta.abs() < 1f32.to_radians() {
            right += 1.0;
            metres += f64::from(off.distance());
            degrees += f64::from(off.theta.abs().to_degrees());
        }
    }
    Some([count, right, 1000.0 * metres / right, degrees / right])
}
