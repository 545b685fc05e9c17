//! A robot that stands for a quarter of an hour does not creep: odometry, the rolling map over it, and SLAM.

use beamfix::geometry::{EgoMotion, Pose};
use beamfix::odometry::OdometryConfig;
use beamfix::pipeline::{Estimate as _, Estimator, Mapper64k, Mapper192k, RollingMapper};
use beamfix::scan::{Beam, Bearing, NoReturn, Range, Scan};
use beamfix::slam::{SLICE, SlamConfig};
use beamfix_sim::noise::Noise;
use host_tests::mapping::building::ring;

const SCANS: u32 = 10_000;

/// Scans of a corner of the building, every range off by so much (m, σ); how far the poses of odometry and of the
/// estimator get from where they were first (m).
fn creep<E: Estimator<N>, const N: usize>(
    estimator: &mut E,
    sigma: f64,
    odometry: impl Fn(&E::Step) -> Pose,
) -> [f32; 2] {
    let world = ring();
    let mut noise = Noise::new(7, 1);
    let ranges: Vec<Option<f64>> = (0..360)
        .map(|k| {
            let (y, x) = f64::from(k).to_radians().sin_cos();
            world.cast([1.3, 1.2], [x, y])
        })
        .collect();
    let mut first: Option<[Pose; 2]> = None;
    let mut farthest = [0.0f32; 2];
    for number in 0..SCANS {
        let mut scan = Scan::<N>::new();
        for (k, range) in (0..).zip(&ranges) {
            let range = range.map(|metres| metres + noise.normal(sigma));
            let beam = Beam {
                bearing: Bearing((k * 65_536u32 / 360) as u16),
                range: range.map_or(Range::none(NoReturn::Nothing), |metres| {
                    Range::from_metres(metres as f32)
                }),
                time_us: number.wrapping_mul(100_000) + 250 * k,
                quality: 0,
            };
            scan.push(beam).expect("360 beams have room");
        }
        let step = estimator.update(&scan, EgoMotion::default());
        estimator.work(SLICE);
        let poses = [odometry(&step), step.pose().expect("it is located")];
        let first = first.get_or_insert(poses);
        for (farthest, (first, pose)) in farthest.iter_mut().zip(first.iter().zip(poses)) {
            *farthest = beamfix::math::max(*farthest, first.between(pose).distance());
        }
    }
    farthest
}

fn rolling() -> Box<Mapper64k> {
    Box::new(RollingMapper::new(OdometryConfig::DEFAULT))
}

fn slam() -> Box<Mapper192k> {
    Box::new(Mapper192k::new(
        OdometryConfig::DEFAULT,
        SlamConfig::DEFAULT,
    ))
}

#[test]
fn equal_scans_leave_the_robot_within_a_millimetre() {
    let rolling = creep::<_, 512>(&mut *rolling(), 0.0, |step| step.odometry.pose);
    let slam = creep::<_, 720>(&mut *slam(), 0.0, |step| step.odometry.pose);
    println!("{rolling:?} {slam:?}");
    let all = [rolling, slam].concat();
    assert!(all.iter().all(|far| *far < 0.001), "{all:?}");
}

#[test]
fn noisy_scans_leave_it_within_five() {
    // 1 cm: a cheap lidar's.
    let rolling = creep::<_, 512>(&mut *rolling(), 0.01, |step| step.odometry.pose);
    let slam = creep::<_, 720>(&mut *slam(), 0.01, |step| step.odometry.pose);
    println!("{rolling:?} {slam:?}");
    let all = [rolling, slam].concat();
    assert!(all.iter().all(|far| *far < 0.005), "{all:?}");
}
