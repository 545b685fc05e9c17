//! Where the robot is in a map: `cargo run --release --example localize_in_flash`.
//!
//! On a board the field is a table in flash that `beamfix field MAP.yaml --out FILE` has written; here it is made from the
//! room's walls.

#![allow(clippy::disallowed_methods)] // The world around the lidar may use what std has.

mod room;

use beamfix::grid::{Shape, distance, occupancy};
use beamfix::localization::Verdict;
use beamfix::matching::correlative::Pyramid;
use beamfix::scan::{Points, PointsConfig};
use beamfix::sensor_model::likelihood_field::{FieldModel, Profile};
use beamfix::{Grid, LikelihoodField, Localizer, LocalizerConfig, Pose, Twist};

/// The room as an occupancy map of 5 cm cells.
fn map(shape: Shape) -> Vec<u8> {
    let mut cells = vec![occupancy::FREE; shape.len()];
    for &[x0, y0, x1, y1] in room::WALLS {
        for step in 0..=400 {
            let along = step as f32 / 400.0;
            let at = beamfix::Point::new(x0 + along * (x1 - x0), y0 + along * (y1 - y0));
            let (x, y) = shape.cell_of(at);
            if let Some(index) = shape.index(x, y) {
                cells[index] = occupancy::OCCUPIED;
            }
        }
    }
    cells
}

fn main() {
    // Walls lie in the middle of their cells.
    let origin = Pose::new(-0.525, -0.525, 0.0);
    let shape = Shape::new(140, 100, 0.05, origin).expect("a map of 7 x 5 m");
    let cells = map(shape);
    let map = Grid::new(shape, &cells[..]).expect("a byte a cell");
    let mut squares = vec![0; shape.len()];
    let mut scratch = distance::Scratch::<140>::new();
    distance::squared(
        &shape,
        &cells,
        occupancy::is_occupied,
        &mut squares,
        &mut scratch,
    )
    .expect("sizes agree");
    let profile = Profile::new(&FieldModel::DEFAULT);
    let field = LikelihoodField::from_map(&map, &squares, &profile, vec![0; shape.len()])
        .expect("sizes agree");

    let mut buffer = vec![0; Pyramid::bytes(&shape)];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("room for the maxima");
    let mut localizer = Localizer::<96>::new(pyramid, LocalizerConfig::DEFAULT);

    let mut points = Points::<360>::new();
    let mut truth = Pose::new(1.5, 1.0, 0.3);
    let motion = Pose::new(0.1, 0.0, 0.05);
    for scan in 0..30 {
        points.assign(
            &room::scan(room::WALLS, truth),
            Twist::ZERO,
            &PointsConfig::DEFAULT,
        );
        let verdict = localizer.update(
            points.as_slice(),
            if scan == 0 { Pose::IDENTITY } else { motion },
        );
        while !localizer.step(100_000) {} // a board does this in slices, between two scans
        match verdict {
            Verdict::Tracking(found, _) => println!("{scan}: at {:?}", found.pose),
            other => println!("{scan}: {other:?}"),
        }
        if scan < 29 {
            truth = truth * motion;
        }
    }
    let pose = localizer.pose().expect("found within 30 scans");
    let off = truth.between(pose);
    println!(
        "off by {:.0} mm and {:.1} deg",
        1000.0 * off.distance(),
        off.theta.to_degrees()
    );
    assert!(off.distance() < 0.03, "{truth:?} {pose:?}");
}
