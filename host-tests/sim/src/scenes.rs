//! Places: the flat of the default run, and scenes that are hard on purpose.

use super::noise::Noise;
use super::pose::TruePose;
use super::world::World;

/// A flat of 11 m by 8 m: hall, living room, kitchen, bath, study, bedroom.
#[must_use]
pub fn flat() -> World {
    let mut w = World::default();
    w.block([0.0, 0.0], [11.0, 8.0]);
    // Inner walls, 10 cm; the gaps are doors.
    for (low, high) in [
        ([0.0, 3.4], [2.6, 3.5]),
        ([3.5, 3.4], [8.0, 3.5]),
        ([8.9, 3.4], [11.0, 3.5]),
        ([0.0, 4.8], [1.6, 4.9]),
        ([2.5, 4.8], [5.0, 4.9]),
        ([5.8, 4.8], [8.4, 4.9]),
        ([9.3, 4.8], [11.0, 4.9]),
        ([6.2, 0.0], [6.3, 3.4]),
        ([4.2, 4.9], [4.3, 8.0]),
        ([6.4, 4.9], [6.5, 8.0]),
    ] {
        w.block(low, high);
    }
    // Open door leaves.
    w.turned_block([1.54, 5.33], [0.04, 0.86], 0.12);
    w.turned_block([9.33, 5.30], [0.04, 0.86], -0.20);
    w.turned_block([8.95, 2.97], [0.04, 0.86], 0.10);
    // Living room: sofa, bench, bookcase, table with chairs, the round column.
    w.block([0.0, 0.3], [0.9, 2.3]);
    w.block([2.4, 0.0], [4.2, 0.4]);
    w.block([5.85, 1.2], [6.2, 2.2]);
    w.column([4.5, 1.75], 0.20);
    w.legs([2.55, 1.7], [0.9, 0.6], 0.03);
    w.legs([1.45, 2.95], [0.4, 0.4], 0.02);
    // Kitchen: worktop, fridge, round table on one foot.
    w.block([0.0, 7.4], [4.2, 8.0]);
    w.block([0.0, 6.4], [0.65, 7.1]);
    w.column([2.8, 6.1], 0.06);
    // Bath, seen through its door: tub, basin.
    w.block([4.3, 6.6], [5.0, 8.0]);
    w.turned_block([6.1, 6.0], [0.5, 0.4], 0.0);
    // Study: desk on panels, shelf, chair, plant.
    w.block([10.3, 5.4], [11.0, 5.45]);
    w.block([10.3, 6.9], [11.0, 6.95]);
    w.block([6.5, 5.2], [6.85, 7.0]);
    w.turned_block([8.6, 7.75], [1.6, 0.4], 0.0);
    w.column([10.1, 7.4], 0.22);
    w.column([7.2, 7.6], 0.15);
    // Bedroom: bed, wardrobe, a chair that stands askew.
    w.block([9.4, 0.4], [11.0, 2.2]);
    w.block([6.3, 0.0], [6.9, 1.9]);
    w.turned_block([8.2, 0.35], [0.45, 0.45], 0.4);
    // Hall: shoe cupboard, coat stand.
    w.block([5.2, 3.5], [6.4, 3.8]);
    w.block([0.0, 4.2], [0.35, 4.8]);
    w.column([10.6, 3.85], 0.12);
    w
}

/// One round through the flat: where the robot starts, and the corners of its way, which ends there again.
#[must_use]
pub fn flat_round() -> (TruePose, Vec<[f64; 2]>) {
    let way = vec![
        [3.30, 2.60],
        [3.05, 4.15],
        [2.05, 4.15],
        [2.05, 5.45],
        [1.30, 6.20],
        [2.00, 6.90],
        [3.60, 6.70],
        [3.50, 5.50],
        [2.05, 5.40],
        [2.05, 4.15],
        [4.80, 4.30],
        [6.80, 4.30],
        [8.45, 4.15],
        [8.45, 2.80],
        [7.60, 1.10],
        [7.40, 2.40],
        [8.45, 2.90],
        [8.45, 4.15],
        [6.80, 4.30],
        [4.80, 4.30],
        [3.05, 4.15],
        [3.05, 2.70],
        [3.50, 0.95],
        [5.30, 0.80],
        [5.20, 2.60],
    ];
    (TruePose::new(5.20, 2.60, 2.8), way)
}

/// A corridor 2 m wide and 200 m long: nothing tells how far along.
#[must_use]
pub fn corridor() -> World {
    let mut w = World::default();
    w.line([-100.0, -1.0], [100.0, -1.0]);
    w.line([-100.0, 1.0], [100.0, 1.0]);
    w
}

/// The inside of a drum of 3 m: nothing tells which way.
#[must_use]
pub fn circle() -> World {
    let mut w = World::default();
    w.column([0.0, 0.0], 3.0);
    w
}

/// A single straight wall, 2 m ahead.
#[must_use]
pub fn wall() -> World {
    let mut w = World::default();
    w.line([2.0, -100.0], [2.0, 100.0]);
    w
}

/// An empty room of 5 m by 4 m.
#[must_use]
pub fn room() -> World {
    let mut w = World::default();
    w.block([-2.5, -2.0], [2.5, 2.0]);
    w
}

/// Nothing at all.
#[must_use]
pub fn empty() -> World {
    World::default()
}

/// An office of 14 m by 9 m with partitions and clutter, another for every seed.
#[must_use]
pub fn office(seed: u64) -> World {
    let mut noise = Noise::new(seed, 7);
    let mut w = World::default();
    w.block([0.0, 0.0], [14.0, 9.0]);
    for x in [4.5, 9.5] {
        let door = noise.even(1.0, 6.0);
        w.block([x, 0.0], [x + 0.1, door]);
        w.block([x, door + 1.2], [x + 0.1, 9.0]);
    }
    let door = noise.even(5.5, 8.0);
    w.block([4.6, 4.5], [door, 4.6]);
    w.block([door + 1.0, 4.5], [9.5, 4.6]);
    w.clutter([0.0, 0.0], [14.0, 9.0], 14, &mut noise);
    for _ in 0..4 {
        w.column(
            [noise.even(0.5, 13.5), noise.even(0.5, 8.5)],
            noise.even(0.05, 0.3),
        );
    }
    w
}

/// A place in [`office`] with at least `clearance` metres all around.
pub fn office_place(world: &World, clearance: f64, noise: &mut Noise) -> TruePose {
    use core::f64::consts::PI;
    // An office has free floor: in a thousand draws one is found for any seed.
    for _ in 0..1000 {
        let place = [noise.even(0.5, 13.5), noise.even(0.5, 8.5)];
        if world.clearance(place) >= clearance {
            return TruePose::new(place[0], place[1], noise.even(-PI, PI));
        }
    }
    TruePose::new(7.0, 4.0, 0.0)
}
