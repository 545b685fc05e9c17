//! A home of 20 m by 16 m with seven rooms: the place where the robot has to find itself.

use beamfix::{
    geometry::Point,
    grid::{Grid, occupancy},
};

use super::noise::Noise;
use super::pose::TruePose;
use super::world::World;

/// Lower left and upper right corner of the home.
pub const EXTENT: ([f64; 2], [f64; 2]) = ([0.0, 0.0], [20.0, 16.0]);

/// The home: outer walls 10 cm inside of its extent, inner walls of 10 cm with doors, furniture.
#[must_use]
pub fn home() -> World {
    let mut w = World::default();
    w.block([0.1, 0.1], [19.9, 15.9]);
    for (low, high) in [
        // The corridor from left to right, with its doors.
        ([0.1, 6.9], [2.2, 7.0]),
        ([3.1, 6.9], [8.0, 7.0]),
        ([9.0, 6.9], [14.6, 7.0]),
        ([15.5, 6.9], [19.9, 7.0]),
        ([0.1, 8.7], [4.4, 8.8]),
        ([5.3, 8.7], [11.2, 8.8]),
        ([12.1, 8.7], [16.9, 8.8]),
        ([17.8, 8.7], [19.9, 8.8]),
        // Rooms below and above it.
        ([6.2, 0.1], [6.3, 6.9]),
        ([12.4, 0.1], [12.5, 3.6]),
        ([12.4, 4.6], [12.5, 6.9]),
        ([7.8, 8.8], [7.9, 15.9]),
        ([14.2, 8.8], [14.3, 12.1]),
        ([14.2, 13.0], [14.3, 15.9]),
    ] {
        w.block(low, high);
    }
    // Open door leaves.
    w.turned_block([2.15, 6.47], [0.04, 0.86], 0.15);
    w.turned_block([12.05, 9.25], [0.04, 0.86], -0.25);
    w.turned_block([15.45, 6.45], [0.04, 0.86], -0.4);
    // Living room, bottom left: sofa, table, shelves, column.
    w.block([0.1, 1.2], [1.0, 3.4]);
    w.legs([2.6, 2.3], [1.1, 0.6], 0.03);
    w.block([3.4, 0.1], [5.6, 0.45]);
    w.column([5.2, 4.9], 0.2);
    w.turned_block([0.9, 5.9], [0.9, 0.9], 0.6);
    // Kitchen, bottom middle: worktops along two walls, round table, chairs.
    w.block([6.3, 0.1], [10.9, 0.7]);
    w.block([11.8, 0.1], [12.4, 2.6]);
    w.column([9.1, 4.0], 0.55);
    w.legs([7.7, 4.4], [0.4, 0.4], 0.02);
    w.legs([9.9, 5.2], [0.4, 0.4], 0.02);
    // Study, bottom right: desks, shelves, plant.
    w.block([18.9, 0.8], [19.9, 3.2]);
    w.block([14.0, 0.1], [17.2, 0.5]);
    w.turned_block([13.6, 5.9], [1.4, 0.6], 0.3);
    w.column([19.3, 6.3], 0.25);
    w.block([16.9, 3.8], [17.7, 4.5]);
    // Bedroom, top left: bed, wardrobe, chair askew.
    w.block([0.1, 11.4], [2.2, 13.2]);
    w.block([3.3, 15.2], [6.2, 15.9]);
    w.turned_block([6.6, 10.0], [0.5, 0.5], 0.4);
    w.block([7.3, 12.2], [7.8, 14.0]);
    // Workshop, top middle: benches, barrel, pile.
    w.block([7.9, 14.9], [11.4, 15.9]);
    w.column([13.2, 14.9], 0.35);
    w.turned_block([10.6, 11.6], [1.2, 0.8], 0.8);
    w.block([13.6, 9.6], [14.2, 11.2]);
    // Bath and store, top right: tub, basin, boxes.
    w.block([18.9, 13.4], [19.9, 15.9]);
    w.block([14.3, 14.9], [15.2, 15.9]);
    w.turned_block([17.2, 11.3], [0.9, 0.6], -0.5);
    w.column([15.6, 9.9], 0.18);
    // The corridor: cupboards.
    w.block([0.1, 7.6], [0.5, 8.4]);
    w.block([9.6, 7.0], [11.2, 7.3]);
    w.column([18.9, 8.3], 0.15);
    w
}

/// A free place in the home for a map's flood fill: the corridor.
pub const INSIDE: [f64; 2] = [6.0, 7.9];

/// A place on the floor with at least `clearance` metres all around, looking anywhere.
pub fn home_place(
    world: &World,
    map: &Grid<Vec<u8>>,
    clearance: f64,
    noise: &mut Noise,
) -> TruePose {
    use core::f64::consts::PI;
    loop {
        let pose = TruePose::new(
            noise.even(0.4, 19.6),
            noise.even(0.4, 15.6),
            noise.even(-PI, PI),
        );
        if world.clearance([pose.x, pose.y]) >= clearance && on_floor(map, pose) {
            return pose;
        }
    }
}

/// Whether a map has floor there.
#[must_use]
pub fn on_floor(map: &Grid<Vec<u8>>, pose: TruePose) -> bool {
    let (x, y) = map
        .shape()
        .cell_of(Point::new(pose.x as f32, pose.y as f32));
    map.get(x, y).is_some_and(occupancy::is_free)
}
