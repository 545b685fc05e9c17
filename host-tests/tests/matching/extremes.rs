//! Points that no scan has: places, bearings and ranges that contradict each other, at the ends of their types. With the checks
//! for overflow on (`./test debug`) every bound of the integer matcher is held to what it says.

use beamfix::{
    geometry::Pose,
    matching::icp::{IcpConfig, Reference, Search, align, smooth_towards},
    scan::{Bearing, ScanPoint},
};
use beamfix_sim::noise::Noise;

/// Any number of a kind: the ends of its range as often as what lies between.
fn number(noise: &mut Noise, ends: &[i32]) -> i32 {
    let pick = (noise.even(0.0, 1.0) * 2.0 * ends.len() as f64) as usize;
    let any = (noise.even(0.0, 1.0) * 65_536.0) as i32 - 32_768;
    ends.get(pick).copied().unwrap_or(any)
}

/// A scan of which nothing is as it should be, or only the places.
fn scan(noise: &mut Noise, count: usize) -> Vec<ScanPoint> {
    // Equal ranges on neighbouring bearings make one surface, whatever the places say.
    let (joined, places) = (noise.even(0.0, 1.0) < 0.7, noise.even(0.0, 1.0) < 0.5);
    let range = number(noise, &[0, 1, 2, 50, 1000, 32_000, 32_767, -1]) as u16;
    let points = (0..count).map(|k| {
        let bearing = Bearing((65_536 * k / count) as u16);
        let true_place = ScanPoint::at(bearing, range.min(32_000));
        let ends = [-32_768, -32_767, -1, 0, 1, 32_766, 32_767];
        let (x, y) = match places {
            true => (number(noise, &ends) as i16, number(noise, &ends) as i16),
            false => (true_place.x, true_place.y),
        };
        match joined {
            true => ScanPoint {
                x,
                y,
                bearing,
                range,
            },
            false => ScanPoint {
                x,
                y,
                bearing: Bearing(number(noise, &[0, 1, -1]) as u16),
                range: number(noise, &[0, 1, 2, 32_000, 32_767, -1]) as u16,
            },
        }
    });
    points.collect()
}

#[test]
fn points_that_contradict_themselves_overflow_nothing() {
    let mut found = 0;
    for seed in 0..4000 {
        let mut noise = Noise::new(seed, 17);
        let mut reference = Box::new(Reference::<180>::new());
        reference.assign(&scan(&mut noise, 180));
        let mut points = scan(&mut noise, 130);
        let place = |noise: &mut Noise| 26.9 * (2.0 * noise.even(0.0, 1.0) - 1.0) as f32;
        let guess = match seed % 3 {
            0 => Pose::IDENTITY,
            1 => Pose::new(26.99, -26.99, 3.0),
            _ => Pose::new(place(&mut noise), place(&mut noise), place(&mut noise)),
        };
        for search in [Search::Local, Search::Global] {
            let config = IcpConfig {
                search,
                ..IcpConfig::DEFAULT
            };
            if let Ok(matched) = align(&reference, &points, guess, &config) {
                assert!(matched.pose.is_finite(), "seed {seed}: {matched:?}");
                found += 1;
            }
        }
        smooth_towards(&reference, &mut points, guess);
    }
    println!("{found} of 8000 matches");
}
