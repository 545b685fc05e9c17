//! A robot maps a room while it drives: `cargo run --release --example map_a_room --features slam`.
//!
//! Odometry, keyframes and loops in 192 KB; at the end the map is drawn from its keyframes into an occupancy grid.

#![allow(clippy::disallowed_methods)] // The world around the lidar may use what std has.

mod room;

use beamfix::grid::Shape;
use beamfix::grid::occupancy::{self, UpdateConfig};
use beamfix::pipeline::{Estimator as _, Mapper192k};
use beamfix::slam::{SLICE, SlamConfig};
use beamfix::{Grid, OdometryConfig, Pose, Tracker};

fn main() {
    let mapper = Mapper192k::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT);
    // On a board this is a static.
    let mut robot = Box::new(Tracker::<_, 720>::new(mapper));

    // Round the cupboard, 5 cm and 3 degrees a scan.
    let start = Pose::new(3.5, 0.6, 0.0);
    let mut truth = start;
    let mut found = Pose::IDENTITY;
    for scan in 0..150u32 {
        let seen = room::scan(room::WALLS, truth);
        let beams = seen.beams().map(|beam| beamfix::Beam {
            time_us: scan * 100_000,
            ..beam
        });
        robot.push_scan(beams, |revolution| {
            assert!(revolution.step.is_located);
            found = revolution.step.pose;
        });
        // Between two scans: a slice of what is to be done for the map.
        robot.estimator_mut().work(SLICE);
        truth = truth * Pose::new(0.05, 0.0, 3f32.to_radians());
    }
    while !robot.estimator_mut().work(SLICE) {}
    let truth = truth * Pose::new(0.05, 0.0, 3f32.to_radians()).inverse();
    let off = start.between(truth).between(found);
    println!("the robot is {:.0} mm off", 1000.0 * off.distance());
    assert!(off.distance() < 0.03, "{found:?}");

    let map = robot.estimator_mut().slam_mut();
    println!("{:?}", map.counters());
    for (number, _, pose) in map.keyframes() {
        println!("keyframe {number} at {pose:?}");
    }
    let (low, high) = map.extent(12.0).expect("there are keyframes");
    let cells = |length: f32| (length / 0.2) as u32 + 3;
    let corner = Pose::new(low.x - 0.2, low.y - 0.2, 0.0);
    let (width, height) = (cells(high.x - low.x), cells(high.y - low.y));
    let shape = Shape::new(width, height, 0.2, corner).expect("a map of a room");
    let mut grid = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()]).expect("a byte a cell");
    let slots: Vec<u16> = map.keyframes().map(|(_, slot, _)| slot).collect();
    for slot in slots {
        map.draw(slot, &mut grid, &UpdateConfig::DEFAULT);
    }
    occupancy::decide(grid.cells_mut());
    for row in grid.cells_mut().chunks(width as usize).rev() {
        let line = row.iter().map(|&cell| match cell {
            occupancy::FREE => '.',
            cell if occupancy::is_occupied(cell) => '#',
            _ => ' ',
        });
        println!("{}", line.collect::<String>());
    }
}
