//! Whether a charging dock stands where it may stand, and exactly where: `cargo run --release --example find_a_dock`.

#![allow(clippy::disallowed_methods)] // The world around the lidar may use what std has.

mod room;

use beamfix::grid::Shape;
use beamfix::localization::presence::{self, PresenceConfig};
use beamfix::matching::correlative::{Correlator, Pyramid};
use beamfix::scan::{Points, PointsConfig};
use beamfix::sensor_model::likelihood_field::{FieldModel, Profile};
use beamfix::{Grid, LikelihoodField, Point, Pose, Twist};

/// The dock in its own frame, x out of its front (m): 0.7 m wide, with a notch 0.12 m deep, and its flanks.
const DOCK: [[f32; 4]; 7] = [
    [0.0, -0.35, 0.0, -0.15],
    [0.0, -0.15, -0.12, -0.05],
    [-0.12, -0.05, -0.12, 0.05],
    [-0.12, 0.05, 0.0, 0.15],
    [0.0, 0.15, 0.0, 0.35],
    [0.0, -0.35, -0.25, -0.35],
    [0.0, 0.35, -0.25, 0.35],
];

/// Distance (m) from a place to the dock's nearest side.
fn clearance(at: Point) -> f32 {
    let to = |&[x0, y0, x1, y1]: &[f32; 4]| {
        let (ex, ey) = (x1 - x0, y1 - y0);
        let along = ((at.x - x0) * ex + (at.y - y0) * ey) / (ex * ex + ey * ey);
        let along = along.clamp(0.0, 1.0);
        (at.x - x0 - along * ex).hypot(at.y - y0 - along * ey)
    };
    DOCK.iter().map(to).fold(f32::INFINITY, f32::min)
}

/// Its likelihood field: cells of 2 cm, all of them explored.
fn field(shape: Shape) -> LikelihoodField<Vec<u8>> {
    let model = FieldModel::new(0.9, 0.1, 12.0, 0.025).expect("weights sum to one");
    let profile = Profile::new(&model);
    let mut cells = vec![0; shape.len()];
    for y in 0..i32::from(shape.height()) {
        for x in 0..i32::from(shape.width()) {
            let mm = 1000.0 * clearance(shape.middle_of(x, y));
            let index = shape.index(x, y).expect("on the grid");
            cells[index] = profile.byte((mm * mm) as u32);
        }
    }
    let grid = Grid::new(shape, cells).expect("a byte a cell");
    LikelihoodField::new(grid, *profile.scale()).expect("a metre across")
}

fn main() {
    let shape = Shape::new(30, 55, 0.02, Pose::new(-0.35, -0.55, 0.0)).expect("30 x 55 cells");
    let field = field(shape);
    let mut buffer = vec![0; Pyramid::bytes(&shape)];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("room for the maxima");
    // Points along its front, which a beam meets where the dock is there.
    let faces: Vec<Point> = DOCK[..5]
        .iter()
        .flat_map(|&[x0, y0, x1, y1]| {
            (0..5).map(move |k| {
                let share = (k as f32 + 0.5) / 5.0;
                Point::new(x0 + share * (x1 - x0), y0 + share * (y1 - y0))
            })
        })
        .collect();

    // The dock stands half a metre from the left wall and looks into the room; the robot stands before it.
    let (dock, robot) = (Pose::new(0.8, 1.6, 0.0), Pose::new(1.9, 1.7, 3.0));
    let placed = DOCK.map(|[x0, y0, x1, y1]| {
        let (a, b) = (dock * Point::new(x0, y0), dock * Point::new(x1, y1));
        [a.x, a.y, b.x, b.y]
    });
    let with_dock = [room::WALLS, &placed].concat();

    let mut correlator = Correlator::<360>::new();
    let mut points = Points::<360>::new();
    for (walls, is_there) in [(&with_dock[..], true), (room::WALLS, false)] {
        points.assign(
            &room::scan(walls, robot),
            Twist::ZERO,
            &PointsConfig::DEFAULT,
        );
        let guess = robot.between(dock) * Pose::new(0.1, -0.1, 0.1);
        let config = PresenceConfig::DEFAULT;
        let found = presence::find(
            &mut correlator,
            &pyramid,
            &faces,
            points.as_slice(),
            guess,
            &config,
        );
        let found = found.ok().filter(|found| found.present);
        assert_eq!(found.is_some(), is_there);
        match found {
            Some(found) => {
                let off = robot.between(dock).between(found.lidar_from_object);
                println!(
                    "a dock at {:?}, off by {:.0} mm",
                    found.lidar_from_object,
                    1000.0 * off.distance()
                );
                assert!(off.distance() < 0.03, "{off:?}");
            }
            None => println!("no dock"),
        }
    }
}
