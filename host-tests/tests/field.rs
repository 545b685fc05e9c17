//! Matching against likelihood fields: accuracy and capture on pairs with known motion.

use std::path::{Path, PathBuf};

use beamfix::{
    geometry::Pose,
    grid::Shape,
    matching::field::{self, FieldConfig},
    scan::{Beam, Points, PointsConfig, Scan},
    sensor_model::likelihood_field::{
        FieldModel, LikelihoodField, Profile,
        stamp::{self, StampConfig},
    },
};
use host_tests::readers::pairs;

fn shared(file: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("BEAMFIX_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"),
        PathBuf::from,
    );
    let path = folder.join(file);
    if path.exists() {
        return Some(path);
    }
    println!("left out: {} is not there", path.display());
    None
}

fn points(beams: &[Beam]) -> Points<400> {
    let mut scan = Scan::<400>::new();
    for beam in beams {
        scan.push(*beam).expect("room");
    }
    let mut points = Points::new();
    points.assign(
        &scan,
        beamfix::geometry::Twist::ZERO,
        &PointsConfig::DEFAULT,
    );
    points
}

fn field_of(points: &Points<400>, resolution: f32, model: &FieldModel) -> LikelihoodField<Vec<u8>> {
    let side = (24.0 / resolution) as u32;
    let shape = Shape::new(side, side, resolution, Pose::new(-12.0, -12.0, 0.0)).expect("good");
    let profile = Profile::new(model);
    let mut field =
        LikelihoodField::unexplored(shape, vec![0; shape.len()], *profile.scale()).expect("fits");
    stamp::scan(
        &mut field,
        points.as_slice(),
        Pose::IDENTITY,
        &profile,
        &StampConfig::DEFAULT,
    );
    field
}

/// Number matched, number right (5 cm, 1°), mean error of these (mm, °).
fn over_pairs(
    level: i32,
    align: impl Fn(&Points<400>, &Points<400>, Pose) -> Option<Pose>,
) -> Option<[f64; 4]> {
    let scans = shared("pairs/host/scans_sim.txt.gz")?;
    let list = shared("pairs/host/pairs_sim_consec.csv.gz")?;
    let pairs = pairs::read(&scans, &list).expect("a list");
    let [mut count, mut right, mut metres, mut degrees] = [0.0; 4];
    for pair in pairs.pairs.iter().filter(|p| p.level == level) {
        let reference = points(&pairs.scans[pair.reference]);
        let current = points(&pairs.scans[pair.current]);
        count += 1.0;
        let Some(found) = align(&reference, &current, pair.guess) else {
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

#[test]
fn scan_to_field_is_as_exact_as_the_scans_allow() {
    // Coarse to fine: cells of 20 cm and σ 0.3 m reach 0.7 m, cells of 5 cm and σ 0.075 m have the accuracy.
    let coarse_model = FieldModel::new(0.9, 0.1, 12.0, 0.3).expect("good");
    let loose = FieldConfig {
        translation_tolerance: 0.01,
        rotation_tolerance: 0.003,
        inlier_distance: 0.6,
        min_share: 0.1,
        ..FieldConfig::DEFAULT
    };
    let Some([count, right, mm, degrees]) = over_pairs(1, |reference, current, guess| {
        let coarse = field_of(reference, 0.2, &coarse_model);
        let fine = field_of(reference, 0.05, &FieldModel::DEFAULT);
        let first = field::align(&coarse.as_slice(), current.as_slice(), guess, &loose);
        let guess = first.map_or(guess, |found| found.pose);
        let found = field::align(
            &fine.as_slice(),
            current.as_slice(),
            guess,
            &FieldConfig::DEFAULT,
        );
        found.ok().map(|found| found.pose)
    }) else {
        return;
    };
    println!("sim level 1, coarse to fine: {right} of {count} right, {mm:.2} mm, {degrees:.4} deg");
    assert!(right >= 0.985 * count && mm <= 2.5 && degrees <= 0.04);
}
