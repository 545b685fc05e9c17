//! Any scans and any guess: no panic, and what is called a pose is one.
#![no_main]

use arbitrary::Arbitrary;
use beamfix::{
    geometry::{EgoMotion, Pose, Twist},
    matching::icp::{self, IcpConfig, Reference, Search},
    odometry::{Odometry, OdometryConfig},
    scan::{Beam, Bearing, Points, PointsConfig, Range, Scan},
};
use libfuzzer_sys::fuzz_target;

const N: usize = 128;

#[derive(Arbitrary, Debug)]
struct Input {
    reference: Vec<Sector>,
    current: Vec<Sector>,
    guess: [f32; 3],
    twist: [f32; 3],
    wheels: [Option<[f32; 3]>; 3],
    rotations: [Option<f32>; 3],
    global: bool,
    min_inliers: u16,
    coarse_beams: u16,
}

/// Some beams along a straight line or an arc: scans that are more than noise.
#[derive(Arbitrary, Debug)]
struct Sector {
    beams: u8,
    bearing: u16,
    step: u16,
    range_mm: u16,
    slope: i8,
    time_us: u32,
    interval_us: u16,
}

fn scan(sectors: &[Sector]) -> Scan<N> {
    let mut scan = Scan::new();
    for sector in sectors {
        for k in 0..u16::from(sector.beams) {
            let mm = i32::from(sector.range_mm) + i32::from(sector.slope) * i32::from(k);
            let beam = Beam {
                bearing: Bearing(sector.bearing.wrapping_add(sector.step.wrapping_mul(k))),
                range: Range::from_mm(mm.max(0) as u32),
                time_us: sector
                    .time_us
                    .wrapping_add(u32::from(sector.interval_us) * u32::from(k)),
                quality: 0,
            };
            let _ = scan.push(beam);
        }
    }
    scan
}

fn pose([x, y, theta]: [f32; 3]) -> Pose {
    Pose { x, y, theta }
}

fuzz_target!(|input: Input| {
    let (reference, current) = (scan(&input.reference), scan(&input.current));
    let [vx, vy, omega] = input.twist;
    let twist = Twist { vx, vy, omega };
    let config = IcpConfig {
        search: if input.global {
            Search::Global
        } else {
            Search::Local
        },
        min_inliers: input.min_inliers,
        coarse_beams: input.coarse_beams,
        ..IcpConfig::DEFAULT
    };

    let mut points = Points::<N>::new();
    points.assign(&reference, twist, &PointsConfig::DEFAULT);
    let mut lines = Reference::<N>::new();
    lines.assign(points.as_slice());
    points.assign(&current, twist, &PointsConfig::DEFAULT);
    if let Ok(found) = icp::align(&lines, points.as_slice(), pose(input.guess), &config) {
        assert!(found.pose.is_finite() && found.residual.is_finite());
        let c = found.covariance.0;
        assert!(c.xx >= 0.0 && c.yy >= 0.0 && c.tt >= 0.0, "{c:?}");
        assert!(usize::from(found.beams) <= N);
    }

    let mut odometry = Odometry::<N>::new(OdometryConfig {
        icp: config,
        ..OdometryConfig::DEFAULT
    });
    let scans = [&reference, &current, &reference];
    for (scan, (wheels, rotation)) in scans
        .into_iter()
        .zip(input.wheels.into_iter().zip(input.rotations))
    {
        let ego = EgoMotion {
            wheels: wheels.map(pose),
            rotation,
        };
        let step = odometry.update(scan, ego);
        assert!(step.pose.is_finite(), "{step:?}");
    }
});
