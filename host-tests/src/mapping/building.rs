//! A simulated building for mapping: corridors that close a ring.

use beamfix_sim::course::Course;
use beamfix_sim::pose::TruePose;
use beamfix_sim::scene::Scene;
use beamfix_sim::world::World;

use crate::formats::{Log, Recorded};

/// A ring of corridors, 20 m by 14 m, with doorways and cabinets that tell one place from another.
#[must_use]
pub fn ring() -> World {
    let mut w = World::default();
    w.block([0.0, 0.0], [24.0, 18.0]);
    w.block([2.5, 2.5], [21.5, 15.5]);
    for (middle, size) in [
        ([3.6, 0.2], [0.9, 0.4]),
        ([9.3, 2.3], [0.6, 0.4]),
        ([14.1, 0.25], [1.4, 0.5]),
        ([19.0, 2.2], [0.4, 0.6]),
        ([23.8, 6.0], [0.4, 1.2]),
        ([21.7, 10.2], [0.4, 0.8]),
        ([23.7, 13.0], [0.6, 0.5]),
        ([17.0, 17.8], [1.6, 0.4]),
        ([12.2, 15.7], [0.7, 0.4]),
        ([6.1, 17.7], [0.5, 0.6]),
        ([0.2, 12.4], [0.4, 1.0]),
        ([2.3, 8.1], [0.4, 0.5]),
        ([0.25, 4.9], [0.5, 0.7]),
    ] {
        w.turned_block(middle, size, 0.0);
    }
    w
}

/// Along the middle of the corridors.
pub const ROUND: [[f64; 2]; 4] = [[1.25, 1.25], [22.75, 1.25], [22.75, 16.75], [1.25, 16.75]];

/// Two rooms with the same furniture, 9 m apart, along a corridor without a mark between them.
#[must_use]
pub fn twins() -> World {
    let mut w = World::default();
    for x in [0.0, 9.0] {
        w.line([x, 2.0], [x, 7.0]);
        w.line([x, 7.0], [x + 5.0, 7.0]);
        w.line([x + 5.0, 7.0], [x + 5.0, 2.0]);
        w.line([x, 2.0], [x + 1.8, 2.0]);
        w.line([x + 3.2, 2.0], [x + 5.0, 2.0]);
        w.turned_block([x + 0.6, 6.3], [1.0, 1.2], 0.0);
        w.turned_block([x + 4.5, 4.0], [0.8, 1.5], 0.0);
        w.column([x + 1.0, 3.2], 0.15);
    }
    w.line([5.0, 2.0], [9.0, 2.0]);
    w.line([-1.0, 2.0], [0.0, 2.0]);
    w.line([14.0, 2.0], [15.0, 2.0]);
    w.line([-1.0, 0.0], [15.0, 0.0]);
    w.line([-1.0, 0.0], [-1.0, 2.0]);
    w.line([15.0, 0.0], [15.0, 2.0]);
    w
}

/// Into the first of them, along the corridor, into the second, and out again.
pub const TWINS: [[f64; 2]; 6] = [
    [2.5, 1.0],
    [2.5, 5.0],
    [2.5, 1.0],
    [11.5, 1.0],
    [11.5, 5.0],
    [11.5, 1.0],
];

/// A drive round the ring, so many times, with an LD06 and usual wheels, as a log; and the true poses.
#[must_use]
pub fn log(rounds: usize, seed: u64) -> (Log, Vec<TruePose>) {
    let [[x, y], rest @ ..] = ROUND;
    let mut corners = rest.to_vec();
    corners.push([x, y]);
    let way = corners.repeat(rounds);
    let course = Course::at(TruePose::new(x, y, 0.0)).through(&way);
    let scene = Scene {
        mount: TruePose::default(),
        ..Scene::new(ring(), course)
    };
    let mut log = Log::default();
    let mut truth = Vec::new();
    for revolution in scene.run(seed) {
        truth.push(revolution.truth);
        log.scans.push(Recorded {
            stamp: format!("{:.6}", revolution.end),
            wheels: revolution.wheels.map(Into::into),
            beams: revolution.beams,
        });
    }
    (log, truth)
}
