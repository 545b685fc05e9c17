//! A charging dock: found where it stands, not seen where there is none.

use crate::common::points_from;
use beamfix::{
    geometry::{Point, Pose},
    grid::Shape,
    localization::presence::{self, PresenceConfig},
    matching::correlative::{Correlator, pyramid::Pyramid},
    sensor_model::likelihood_field::{FieldModel, LikelihoodField, Profile, draw::Canvas},
};
use beamfix_sim::{home, noise::Noise, pose::TruePose, world::World};
use host_tests::formats::ros_map;

/// The front of a dock, 0.7 m wide, with a notch 0.12 m deep: x forward, out of the dock.
const FRONT: [[f64; 2]; 6] = [
    [0.0, -0.35],
    [0.0, -0.15],
    [-0.12, -0.05],
    [-0.12, 0.05],
    [0.0, 0.15],
    [0.0, 0.35],
];

pub fn dock(world: &mut World, at: TruePose) {
    let place = |p: [f64; 2]| {
        let q = at.then(TruePose::new(p[0], p[1], 0.0));
        [q.x, q.y]
    };
    for pair in FRONT.windows(2) {
        world.line(place(pair[0]), place(pair[1]));
    }
    // Its flanks.
    world.line(place([0.0, -0.35]), place([-0.25, -0.35]));
    world.line(place([0.0, 0.35]), place([-0.25, 0.35]));
}

/// Its field, all cells explored: 1.1 m by 0.6 m in cells of 2 cm.
pub fn field() -> LikelihoodField<Vec<u8>> {
    let mut world = World::default();
    dock(&mut world, TruePose::default());
    let shape = Shape::new(30, 55, 0.02, Pose::new(-0.35, -0.55, 0.0)).expect("good");
    let profile = Profile::new(&FieldModel::new(0.9, 0.1, 12.0, 0.025).expect("good"));
    let mut field =
        LikelihoodField::unexplored(shape, vec![0; shape.len()], *profile.scale()).expect("fits");
    let unexplored = profile.scale().unexplored;
    for y in 0..i32::from(shape.height()) {
        for x in 0..i32::from(shape.width()) {
            let middle = shape.middle_of(x, y);
            let mm = 1000.0 * world.clearance([f64::from(middle.x), f64::from(middle.y)]);
            let byte = profile.byte((mm * mm) as u32);
            // In front of it there is room; behind its front nothing is known.
            let front = middle.x > 0.0 || (middle.x > -0.12 && middle.y.abs() < 0.15);
            field.raise(x, y, if byte > unexplored { byte } else { unexplored });
            if byte < unexplored && front && middle.y.abs() < 0.35 {
                field = lowered(field, x, y);
            }
        }
    }
    field
}

/// The cell explored, with nothing near.
fn lowered(field: LikelihoodField<Vec<u8>>, x: i32, y: i32) -> LikelihoodField<Vec<u8>> {
    use beamfix::{grid::Grid, sensor_model::likelihood_field::Field};
    let (shape, scale) = (*field.grid().shape(), *field.as_slice().scale());
    let mut cells = field.grid().cells().to_vec();
    cells[shape.index(x, y).expect("on the grid")] = 1;
    LikelihoodField::new(Grid::new(shape, cells).expect("fits"), scale).expect("small")
}

pub fn faces() -> Vec<Point> {
    FRONT
        .windows(2)
        .flat_map(|pair| {
            (0..5).map(move |k| {
                let share = (f64::from(k) + 0.5) / 5.0;
                let at = |i: usize| (pair[0][i] + share * (pair[1][i] - pair[0][i])) as f32;
                Point::new(at(0), at(1))
            })
        })
        .collect()
}

#[test]
fn a_dock_is_found_where_it_stands_and_nowhere_else() {
    let (low, high) = home::EXTENT;
    let empty = home::home();
    let map = ros_map::of_world(&empty, low, high, 0.05, home::INSIDE).expect("a map");
    let field = field();
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
    let faces = faces();
    let mut correlator = Correlator::<120>::new();
    let config = PresenceConfig::DEFAULT;
    let (mut there, mut found, mut right, mut mm, mut degrees) = (0, 0, 0, 0.0, 0.0);
    let (mut tried, mut alarms) = (0, 0);
    for seed in 0..300 {
        let mut noise = Noise::new(seed, 21);
        let place = home::home_place(&empty, &map, 0.9, &mut noise);
        // In front of the lidar, turned towards it give or take.
        let distance = noise.even(0.6, 2.0);
        let bearing = noise.even(-0.5, 0.5);
        let at = place
            .then(TruePose::new(
                distance * libm::cos(bearing),
                distance * libm::sin(bearing),
                0.0,
            ))
            .then(TruePose::new(
                0.0,
                0.0,
                core::f64::consts::PI + bearing + noise.even(-0.5, 0.5),
            ));
        if empty.clearance([at.x, at.y]) < 0.4 || !home::on_floor(&map, at) {
            continue;
        }
        let mut world = empty.clone();
        dock(&mut world, at);
        let truth = place.between(at);
        let guess = truth.then(TruePose::new(
            noise.even(-0.3, 0.3),
            noise.even(-0.3, 0.3),
            noise.even(-0.25, 0.25),
        ));
        let points = points_from(&world, place, 450, &mut noise);
        there += 1;
        if let Ok(seen) = presence::find(
            &mut correlator,
            &pyramid,
            &faces,
            &points,
            guess.into(),
            &config,
        ) {
            if seen.present {
                found += 1;
                let off = truth.between(seen.lidar_from_object.into());
                if off.distance() < 0.03 && off.theta.abs() < 0.05 {
                    right += 1;
                }
                mm += 1000.0 * off.distance();
                degrees += off.theta.abs().to_degrees();
            } else {
                println!("seed {seed}: not seen at {distance:.2} m: {seen:?}");
            }
        }
    }
    // The stated rate is that of the release build; a debug build looks at fewer.
    for seed in 0..if cfg!(debug_assertions) { 300 } else { 3000 } {
        let mut noise = Noise::new(seed, 22);
        let place = home::home_place(&empty, &map, 0.3, &mut noise);
        let points = points_from(&empty, place, 450, &mut noise);
        // Where something stands, looking at the lidar: the hardest guess.
        let target = points[noise.even(0.0, points.len() as f64) as usize];
        let guess = Pose::new(
            f32::from(target.x()) * 1e-3,
            f32::from(target.y()) * 1e-3,
            core::f32::consts::PI + target.bearing().radians() + noise.even(-0.5, 0.5) as f32,
        );
        tried += 1;
        let seen = presence::find(&mut correlator, &pyramid, &faces, &points, guess, &config);
        if let Ok(seen) = seen
            .as_ref()
            .map_err(|_| ())
            .and_then(|seen| seen.present.then_some(seen).ok_or(()))
        {
            alarms += 1;
            println!("seed {seed}: alarm {seen:?} at {place:?}");
        }
    }
    println!(
        "dock: {found} of {there} found, {right} right, mean error {:.1} mm {:.2} deg; {alarms} alarms in {tried} scans without one",
        mm / f64::from(found),
        degrees / f64::from(found)
    );
    assert!(
        f64::from(right) >= 0.95 * f64::from(there) && right == found && alarms == 0 && there > 100
    );
}
