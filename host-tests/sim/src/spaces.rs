//! Worlds of other scales and shapes than a flat.

use super::noise::Noise;
use super::world::World;

/// A yard of buildings 10 to 60 m away: gables, sheds, trees, parked cars, hedges.
#[must_use]
pub fn yard(seed: u64) -> World {
    let mut noise = Noise::new(seed, 21);
    let mut w = World::default();
    for (middle, size, angle) in [
        ([28.0, 6.0], [6.0, 22.0], 0.05),
        ([-3.0, 24.0], [30.0, 8.0], -0.08),
        ([-34.0, -4.0], [9.0, 26.0], 0.12),
        ([8.0, -19.0], [24.0, 7.0], 0.03),
        ([48.0, -30.0], [14.0, 18.0], 0.4),
        ([44.0, 38.0], [20.0, 12.0], -0.5),
        ([-30.0, 44.0], [16.0, 16.0], 0.3),
        ([-28.0, -40.0], [22.0, 10.0], -0.2),
    ] {
        w.turned_block(middle, size, angle + noise.even(-0.05, 0.05));
    }
    for _ in 0..10 {
        let (towards, away) = (noise.even(-3.1, 3.1), noise.even(8.0, 30.0));
        let place = [away * libm::cos(towards), away * libm::sin(towards)];
        w.column(place, noise.even(0.1, 0.35));
    }
    // Hedges: twigs and gaps, no surface.
    for (from, to) in [
        ([-20.0, 14.0], [14.0, 13.0]),
        ([16.0, -14.0], [19.0, 9.0]),
        ([-15.0, -12.0], [-2.0, -15.0]),
    ] {
        for _ in 0..120 {
            let share = noise.even(0.0, 1.0);
            let place =
                [0, 1].map(|k: usize| from[k] + share * (to[k] - from[k]) + noise.normal(0.3));
            w.column(place, noise.even(0.02, 0.12));
        }
    }
    for _ in 0..3 {
        let (towards, away) = (noise.even(-3.1, 3.1), noise.even(9.0, 15.0));
        let place = [away * libm::cos(towards), away * libm::sin(towards)];
        w.turned_block(place, [4.3, 1.8], noise.even(-3.1, 3.1));
    }
    w
}

/// A hall of 60 m by 40 m around the origin with two rows of pillars.
#[must_use]
pub fn hall() -> World {
    let mut w = World::default();
    w.block([-30.0, -20.0], [30.0, 20.0]);
    for k in 0..6 {
        for side in [-7.0, 7.0] {
            w.turned_block([-25.0 + 10.0 * f64::from(k), side], [0.6, 0.6], 0.0);
        }
    }
    w.block([-30.0, 12.0], [-22.0, 20.0]);
    w.block([18.0, -20.0], [23.0, -16.0]);
    w
}

/// A corridor of `length` metres along x, 2 m wide, closed at its ends, with niches of doors every few metres.
#[must_use]
pub fn niches(length: f64, seed: u64) -> World {
    let mut noise = Noise::new(seed, 22);
    let mut w = World::default();
    w.line([0.0, -1.0], [0.0, 1.0]);
    w.line([length, -1.0], [length, 1.0]);
    for side in [-1.0, 1.0] {
        let mut x = 0.0;
        while x < length {
            let plain = noise.even(1.5, 3.5);
            let end = if x + plain + 1.2 < length {
                x + plain
            } else {
                length
            };
            w.line([x, side], [end, side]);
            if end < length {
                let (deep, wide) = (side * 1.12, 0.9);
                w.line([end, side], [end, deep]);
                w.line([end, deep], [end + wide, deep]);
                w.line([end + wide, deep], [end + wide, side]);
                x = end + wide;
            } else {
                x = length;
            }
        }
    }
    w
}

/// A floor of offices: a corridor of `length` metres along x, 2.4 m wide, with rooms of 3 to 5 m on both sides, some
/// of them open.
#[must_use]
pub fn floor(length: f64, seed: u64) -> World {
    let mut noise = Noise::new(seed, 23);
    let mut w = World::default();
    w.line([0.0, -1.2], [0.0, 1.2]);
    w.line([length, -1.2], [length, 1.2]);
    for side in [-1.0, 1.0] {
        let (near, far) = (1.2 * side, 6.0 * side);
        let mut x = 0.0;
        while x < length {
            let end = if x + 8.0 < length {
                x + noise.even(3.0, 5.0)
            } else {
                length
            };
            let door = noise.even(x + 0.4, end - 1.4);
            w.line([x, near], [door, near]);
            w.line([door + 0.9, near], [end, near]);
            if noise.even(0.0, 1.0) < 0.5 {
                w.line([x, near], [x, far]);
                w.line([x, far], [end, far]);
                w.line([end, far], [end, near]);
                w.turned_block(
                    [noise.even(x + 0.8, end - 0.8), 4.0 * side],
                    [noise.even(0.5, 1.4), 0.7],
                    noise.even(-0.3, 0.3),
                );
            } else {
                // The door is shut, a hand's breadth back.
                let back = near + 0.08 * side;
                w.line([door, near], [door, back]);
                w.line([door, back], [door + 0.9, back]);
                w.line([door + 0.9, back], [door + 0.9, near]);
            }
            x = end;
        }
    }
    w
}

/// A room with `sides` equal walls, all 3 m from its middle.
#[must_use]
pub fn regular(sides: u32) -> World {
    let mut w = World::default();
    let radius = 3.0 / libm::cos(core::f64::consts::PI / f64::from(sides));
    let corner = |k: u32| {
        let angle = core::f64::consts::TAU * f64::from(k) / f64::from(sides);
        [radius * libm::cos(angle), radius * libm::sin(angle)]
    };
    for k in 0..sides {
        w.line(corner(k), corner(k + 1));
    }
    w
}
