//! The fast search for the closest point finds what looking at all of them finds.

use beamfix::{
    matching::icp::modular::correspondence::nearest::{Found, Place, Sweep, brute_force},
    scan::{Bearing, ScanPoint},
};
use beamfix_sim::Noise;

/// Kinds of scans, each with its own way to mislead a walk.
const KINDS: [&str; 8] = [
    "full turn",
    "clockwise",
    "sector",
    "more than a turn",
    "gaps",
    "round, all equally far",
    "order shaken by deskewing",
    "order lost",
];

fn random_scan(kind: usize, noise: &mut Noise) -> Vec<ScanPoint> {
    let count = noise.even(1.0, 400.0) as usize;
    let step = match kind {
        1 => -65_536.0 / count as f64,
        2 => noise.even(0.2, 0.9) * 65_536.0 / count as f64,
        3 => noise.even(1.0, 1.3) * 65_536.0 / count as f64,
        _ => 65_536.0 / count as f64,
    };
    let start = noise.even(0.0, 65_536.0);
    let mut range = noise.even(100.0, 8000.0);
    let mut points = Vec::new();
    for k in 0..count {
        if noise.even(0.0, 1.0) < 0.05 {
            range = noise.even(60.0, 30_000.0);
        }
        if kind == 4 && noise.even(0.0, 1.0) < 0.5 {
            continue;
        }
        let shaken = match kind {
            6 => noise.even(-1500.0, 1500.0),
            7 => noise.even(0.0, 65_536.0),
            _ => 0.0,
        };
        let bearing = (start + step * k as f64 + shaken) as i64 as u16;
        let mm = if kind == 5 {
            2000.0
        } else {
            range + noise.even(-20.0, 20.0)
        };
        points.push(ScanPoint::at(Bearing(bearing), mm as u16));
    }
    points
}

/// Places to look from: anywhere, on a point, in the middle between two, at the lidar itself.
fn random_place(points: &[ScanPoint], noise: &mut Noise) -> Place {
    let any = |noise: &mut Noise| {
        let k = noise.even(0.0, points.len() as f64) as usize;
        points.get(k).copied().unwrap_or_default()
    };
    let (a, b) = (any(noise), any(noise));
    let around = |noise: &mut Noise, most: f64| noise.even(-most, most) as i32;
    match noise.even(0.0, 5.0) as u8 {
        0 => Place {
            x: around(noise, 40_000.0),
            y: around(noise, 40_000.0),
        },
        1 => Place {
            x: i32::from(a.x()),
            y: i32::from(a.y()),
        },
        2 => Place {
            x: (i32::from(a.x()) + i32::from(b.x())) / 2,
            y: (i32::from(a.y()) + i32::from(b.y())) / 2,
        },
        3 => Place { x: 0, y: 0 },
        _ => Place {
            x: i32::from(a.x()) + around(noise, 300.0),
            y: i32::from(a.y()) + around(noise, 300.0),
        },
    }
}

#[test]
fn the_walk_finds_what_brute_force_finds() {
    for (kind, name) in KINDS.into_iter().enumerate() {
        for seed in 0..150 {
            let mut noise = Noise::new(seed, kind as u64);
            let points = random_scan(kind, &mut noise);
            let sweep = Sweep::of(&points);
            for _ in 0..60 {
                let place = random_place(&points, &mut noise);
                let hint = noise.even(0.0, points.len() as f64 + 2.0) as usize;
                // A third of the points is not taken, as by incompatible normals.
                let odd = noise.even(0.0, 1.0) < 0.5;
                let accept = |k: usize| !odd || k % 3 != 1;
                let expected = brute_force(&points, place, accept);
                let found = sweep.nearest(&points, place, hint, accept);
                assert_eq!(
                    found,
                    expected,
                    "{name}, seed {seed}, {place:?}, from {hint} of {}",
                    points.len()
                );
            }
        }
    }
}

#[test]
fn of_points_equally_near_the_first_is_found() {
    // Four at the same distance from the middle, which is the lidar: all bearings are as good.
    let points = [0u16, 16_384, 32_768, 49_152].map(|b| ScanPoint::at(Bearing(b), 1000));
    let sweep = Sweep::of(&points);
    for hint in 0..4 {
        let found = sweep.nearest(&points, Place { x: 0, y: 0 }, hint, |_| true);
        let expected = brute_force(&points, Place { x: 0, y: 0 }, |_| true);
        assert_eq!(found, expected, "from {hint}");
        assert_eq!(found.map(|Found { index, .. }| index), Some(0));
    }
    assert_eq!(sweep.nearest(&[], Place { x: 0, y: 0 }, 0, |_| true), None);
}

#[test]
fn the_walk_looks_at_few_points_where_the_guess_is_good() {
    use core::cell::Cell;
    let mut noise = Noise::new(1, 0);
    let points: Vec<ScanPoint> = (0..720)
        .map(|k| {
            let bearing = Bearing((k * 91) as u16);
            ScanPoint::at(bearing, 3000 + noise.even(-20.0, 20.0) as u16)
        })
        .collect();
    let sweep = Sweep::of(&points);
    // `accept` is asked only of points nearer than the best so far, so time is counted by hand: the walk's steps are
    // bounded by the angle at which 3 m · sin Δφ exceeds the distance, here 50 mm and 8 mm of rounding: 1.1 degrees.
    let asked = Cell::new(0u32);
    for (k, point) in points.iter().enumerate() {
        let place = Place {
            x: i32::from(point.x()) + 30,
            y: i32::from(point.y()) - 30,
        };
        let found = sweep.nearest(&points, place, k, |_| {
            asked.set(asked.get() + 1);
            true
        });
        assert!(found.is_some_and(|f| f.index.abs_diff(k) <= 3 || f.index.abs_diff(k) >= 717));
    }
    assert!(asked.get() < 720 * 5, "asked {} times", asked.get());
}
