//! Scan to a virtual scan of several keyframes: nearer to the truth than scan to scan, and past what one scan hides.

use crate::common::points_from;
use beamfix::{
    geometry::Pose,
    matching::{
        icp::{self, IcpConfig, Reference},
        virtual_scan::VirtualScan,
    },
    scan::ScanPoint,
};
use beamfix_sim::{Noise, TruePose, World, scenes};

const BEAMS: usize = 360;

/// Eight keyframes around `place`, seen from up to `apart` metres away, with their true poses relative to it.
fn keyframes(
    world: &World,
    place: TruePose,
    apart: f64,
    noise: &mut Noise,
) -> Vec<(Vec<ScanPoint>, Pose)> {
    (0..8)
        .map(|_| {
            let off = TruePose::new(
                noise.even(-apart, apart),
                noise.even(-apart, apart),
                noise.even(-3.1, 3.1),
            );
            let points = points_from(world, place.then(off), BEAMS, noise);
            (points, off.into())
        })
        .collect()
}

fn virtual_scan(at: Pose, keyframes: &[(Vec<ScanPoint>, Pose)]) -> Box<VirtualScan<BEAMS>> {
    let mut scan = Box::new(VirtualScan::new());
    scan.assign(at, keyframes.iter().map(|(p, pose)| (p.as_slice(), *pose)));
    scan
}

#[test]
fn the_virtual_scan_is_what_the_lidar_would_see() {
    let (mut near, mut seen, mut off) = (0, 0, 0.0);
    for seed in 0..20 {
        let world = scenes::office(seed);
        let mut noise = Noise::new(seed, 1);
        let place = scenes::office_place(&world, 0.6, &mut noise);
        let frames = keyframes(&world, place, 0.3, &mut noise);
        let scan = virtual_scan(Pose::IDENTITY, &frames);
        for point in scan.as_slice() {
            let direction = place.theta + f64::from(point.bearing().radians());
            let towards = [libm::cos(direction), libm::sin(direction)];
            let Some(truth) = world.cast([place.x, place.y], towards) else {
                continue;
            };
            let error = f64::from(point.range()) * 1e-3 - truth;
            seen += 1;
            if error.abs() < 0.05 {
                near += 1;
                off += error;
            }
        }
    }
    let (share, mean) = (near as f64 / seen as f64, 1000.0 * off / near as f64);
    println!("{seen} points, {share:.3} within 5 cm, mean error {mean:.2} mm");
    // Edges that a step to the side shows or hides are the rest.
    assert!(share > 0.93 && seen > 20 * 340, "{share} of {seen}");
    // Not drawn towards the lidar: the nearest of eight with 1 cm of noise would be 14 mm nearer.
    assert!(mean.abs() < 2.0, "{mean} mm");
}

/// Errors (mm) of matches against one keyframe and against the virtual scan of eight.
fn matched(apart: f64) -> [Vec<f64>; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for seed in 0..60 {
        let world = scenes::office(seed);
        let mut noise = Noise::new(seed, 1);
        let place = scenes::office_place(&world, 0.8, &mut noise);
        let frames = keyframes(&world, place, apart, &mut noise);
        let mut even = |most: f64| noise.even(-most, most);
        let motion = TruePose::new(even(0.1), even(0.1), even(0.1));
        let guess = TruePose::new(motion.x + even(0.03), motion.y, motion.theta + even(0.03));
        let current = points_from(&world, place.then(motion), BEAMS, &mut noise);
        let mut lines = Box::new(Reference::<BEAMS>::new());
        let config = IcpConfig::DEFAULT;
        // Scan to scan, the first keyframe as the reference.
        let first = TruePose::from(frames[0].1);
        lines.assign(&frames[0].0);
        let found = icp::align(&lines, &current, first.between(guess).into(), &config);
        errors[0].push(found.map_or(1e3, |m| {
            1e3 * motion.between(first.then(m.pose.into())).distance()
        }));
        // Scan to map, projected to where the robot believes to be.
        lines.assign(virtual_scan(guess.into(), &frames).as_slice());
        let found = icp::align(&lines, &current, Pose::IDENTITY, &config);
        errors[1].push(found.map_or(1e3, |m| {
            1e3 * motion.between(guess.then(m.pose.into())).distance()
        }));
    }
    for errors in &mut errors {
        errors.sort_by(f64::total_cmp);
    }
    errors
}

#[test]
fn a_match_to_eight_keyframes_is_nearer_to_the_truth_than_to_one() {
    for (apart, allowed) in [(0.1, 2.0), (0.6, 3.0)] {
        let [one, eight] = matched(apart);
        let (median, p90) = (|e: &[f64]| e[30], |e: &[f64]| e[54]);
        println!(
            "{apart} m apart: one keyframe {:.2} mm, p90 {:.2}; eight {:.2} mm, p90 {:.2}",
            median(&one),
            p90(&one),
            median(&eight),
            p90(&eight)
        );
        assert!(median(&eight) < median(&one), "{apart}");
        assert!(median(&eight) < allowed, "{apart}: {}", median(&eight));
    }
}
