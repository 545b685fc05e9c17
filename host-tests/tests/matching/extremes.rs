//! Points at the ends of their numbers, in any order: with the checks for overflow on (`./test debug`) every bound of the integer
//! matcher is held to what it says.

use beamfix::{
    geometry::Pose,
    matching::icp::{IcpConfig, Reference, Search, align, smooth_towards},
    scan::{Bearing, ScanPoint},
};
use beamfix_sim::noise::Noise;

/// Any number of 16 bits: the ends of its range and some that count as often as what lies between.
fn number(noise: &mut Noise, ends: &[u16]) -> u16 {
    let pick = noise.even(0.0, 2.0 * ends.len() as f64) as usize;
    let any = noise.even(0.0, 65_536.0) as u16;
    ends.get(pick).copied().unwrap_or(any)
}

/// A room whose far half errs by a share of its ranges.
fn noisy_room(noise: &mut Noise, count: u16) -> Vec<ScanPoint> {
    let (near, far) = (noise.even(3000.0, 8000.0), noise.even(12_000.0, 32_000.0));
    let share = noise.even(0.0, 0.08);
    (0..count)
        .map(|k| {
            let bearing = (65_536 * u32::from(k) / u32::from(count)) as u16;
            let range = if k < count / 2 { near } else { far };
            let range = range + share * range * noise.normal(1.0);
            ScanPoint::at(Bearing(bearing), range.clamp(1.0, 65_535.0) as u16)
        })
        .collect()
}

/// Points on one surface by their ranges, or wherever they come to lie, in the order of measurement, or in none; a fourth of them a
/// room whose noise grows with the range.
fn points(noise: &mut Noise, count: u16) -> Vec<ScanPoint> {
    if noise.even(0.0, 1.0) < 0.25 {
        return noisy_room(noise, count);
    }
    let (joined, ordered) = (noise.even(0.0, 1.0) < 0.7, noise.even(0.0, 1.0) < 0.7);
    let ends = [0, 1, 2, 50, 127, 1000, 32_000, 32_767, 65_535];
    let range = number(noise, &ends);
    (0..count)
        .map(|k| {
            let even = (65_536 * u32::from(k) / u32::from(count)) as u16;
            let bearing = match ordered {
                true => even,
                false => number(noise, &[0, 1, 65_535]),
            };
            let range = match joined {
                true => range.saturating_add(noise.even(0.0, 40.0) as u16),
                false => number(noise, &ends),
            };
            ScanPoint::at(Bearing(bearing), range)
        })
        .collect()
}

#[test]
fn points_at_the_ends_of_their_numbers_overflow_nothing() {
    let mut found = 0;
    for seed in 0..2000 {
        let mut noise = Noise::new(seed, 17);
        let mut reference = Box::new(Reference::<180>::new());
        reference.assign(&points(&mut noise, 180));
        let mut current = points(&mut noise, 130);
        let mut place = || noise.even(-26.9, 26.9) as f32;
        let guess = match seed % 3 {
            0 => Pose::IDENTITY,
            1 => Pose::new(26.99, -26.99, 3.0),
            _ => Pose::new(place(), place(), place()),
        };
        for search in [Search::Local, Search::Global] {
            let config = IcpConfig {
                search,
                ..IcpConfig::DEFAULT
            };
            if let Ok(matched) = align(&reference, &current, guess, &config) {
                assert!(matched.pose.is_finite(), "seed {seed}: {matched:?}");
                found += 1;
            }
        }
        smooth_towards(&reference, &mut current, guess);
        for point in current {
            let (x, y) = (f64::from(point.x()), f64::from(point.y()));
            let distance = libm::hypot(x, y);
            assert!(
                (distance - f64::from(point.range())).abs() < 3.0,
                "{point:?}"
            );
        }
    }
    println!("{found} of 4000 matches");
    assert!(found > 100);
}
