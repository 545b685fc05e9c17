//! What no robot does: numbers that are none, jumps, noise for scans.

use beamfix::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    scan::{Bearing, ScanPoint},
    slam::{Slam, SlamConfig},
};
use beamfix_sim::noise::Noise;

#[test]
fn nonsense_is_bounded_and_no_panic() {
    for seed in 0..4 {
        let mut noise = Noise::new(seed, 9);
        let mut slam = Box::new(Slam::<24, 60, 60, 36, 90>::new(SlamConfig::DEFAULT));
        for k in 0..1500 {
            let count = noise.even(0.0, 120.0) as usize;
            let points: Vec<ScanPoint> = (0..count)
                .map(|_| {
                    let bearing = Bearing(noise.even(0.0, 65_536.0) as u16);
                    ScanPoint::at(bearing, noise.even(0.0, 32_767.0) as u16)
                })
                .collect();
            let far = [0.1, 3.0, 1e4, 1e30][k % 4];
            let mut number = || noise.even(-far, far) as f32;
            let pose = match k % 17 {
                0 => Pose {
                    x: f32::NAN,
                    ..Pose::IDENTITY
                },
                1 => Pose {
                    theta: f32::INFINITY,
                    ..Pose::IDENTITY
                },
                _ => Pose::new(number(), number(), number() % 3.0),
            };
            let covariance = Covariance(Sym3 {
                xx: number(),
                xy: number(),
                xt: number(),
                yy: if k % 13 == 0 { f32::NAN } else { number() },
                yt: number(),
                tt: number(),
            });
            slam.update(pose, &covariance, Pose::IDENTITY, &points);
            slam.step(noise.even(0.0, 60_000.0) as u32);
            if k % 3 == 0 {
                slam.take_merged();
            }
        }
        let finite = slam.graph().nodes().all(|(_, node)| node.pose.is_finite());
        assert!(finite && slam.graph().len() <= 24, "seed {seed}");
        assert!(slam.graph().edges().len() <= 60, "seed {seed}");
        assert!(
            slam.counters().keyframes > 24,
            "seed {seed}: {:?}",
            slam.counters()
        );
    }
}

#[test]
fn a_motion_is_never_known_better_than_the_least_error() {
    let config = SlamConfig::DEFAULT;
    let points: Vec<ScanPoint> = (0..90)
        .map(|k| ScanPoint::at(Bearing(k * 728), 2000))
        .collect();
    let mut noise = Noise::new(1, 10);
    for k in 0..500 {
        // Covariances of two poses that have nothing to do with each other: their difference is none.
        let mut told = || {
            let [a, b, c, d, e, f]: [f32; 6] =
                std::array::from_fn(|_| noise.even(-0.03, 0.03) as f32);
            Covariance(Sym3 {
                xx: a * a + 1e-6,
                xy: a * b,
                xt: a * d,
                yy: b * b + c * c + 1e-6,
                yt: b * d + c * e,
                tt: d * d + e * e + f * f + 1e-6,
            })
        };
        let mut slam = Box::new(Slam::<4, 60, 60, 36, 90>::new(config));
        let there = Pose::new(0.7, -0.9, 0.3);
        slam.update(Pose::IDENTITY, &told(), Pose::IDENTITY, &points);
        slam.update(there, &told(), Pose::IDENTITY, &points);
        let [edge] = slam.graph().edges() else {
            panic!("one edge")
        };
        let known = edge.information.covariance().expect("definite").0;
        // Half of the least error can be taken off, and it still is a covariance.
        let (far, turned) = (config.min_chain_sigma, config.min_chain_heading_sigma);
        let least = 0.49 * far * far;
        let left = Covariance(Sym3 {
            xx: known.xx - least,
            yy: known.yy - least,
            tt: known.tt - 0.49 * turned * turned,
            ..known
        });
        assert!(left.information().is_some(), "{k}: {known:?}");
    }
}

#[test]
fn scans_given_twice_make_no_keyframe() {
    let mut slam = Box::new(Slam::<24, 60, 60, 36, 90>::new(SlamConfig::DEFAULT));
    let points: Vec<ScanPoint> = (0..90)
        .map(|k| ScanPoint::at(Bearing(k * 728), 2000))
        .collect();
    for _ in 0..1000 {
        let placed = slam.update(
            Pose::IDENTITY,
            &Covariance::default(),
            Pose::IDENTITY,
            &points,
        );
        assert_eq!(placed.map(|at| at.keyframe), Some(0));
        while slam.step(1000) {}
    }
    assert_eq!(slam.counters().keyframes, 1);
}
