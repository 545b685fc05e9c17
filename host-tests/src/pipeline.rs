//! The firmware's pipeline on the host: beams in, poses out, with the counts and the hash that a report needs.

use beamfix::geometry::{EgoMotion, Point, Pose, Twist};
use beamfix::odometry::{Counters, Odometry, OdometryConfig, Step};
use beamfix::scan::{Beam, Scan};

use crate::report::hash::PoseHash;

/// Odometry over a sequence of scans, with its books.
pub struct Pipeline<const N: usize> {
    odometry: Odometry<N>,
    scan: Scan<N>,
    wheels: Option<Pose>,
    /// Beams that found no room because a scan had more than N.
    pub refused_beams: usize,
    /// Over all poses so far.
    pub hash: PoseHash,
}

impl<const N: usize> Pipeline<N> {
    /// Before the first scan. On the heap: a few scans are too much for a thread's stack in debug builds.
    #[must_use]
    pub fn new(config: OdometryConfig) -> Box<Self> {
        Box::new(Self {
            odometry: Odometry::new(OdometryConfig {
                directions: N as u16,
                ..config
            }),
            scan: Scan::new(),
            wheels: None,
            refused_beams: 0,
            hash: PoseHash::new(),
        })
    }

    /// What happened so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.odometry.counters()
    }

    /// Takes the next scan; `wheels` is the robot's pose by wheel odometry at its end.
    pub fn step(&mut self, beams: &[Beam], wheels: Option<Pose>) -> Step {
        self.scan.clear();
        for &beam in beams {
            self.refused_beams += usize::from(self.scan.push(beam).is_err());
        }
        let ego = EgoMotion {
            wheels: (self.wheels.zip(wheels)).map(|(last, now)| last.between(now)),
            rotation: None,
        };
        self.wheels = wheels.filter(|pose| pose.is_finite());
        let step = self.odometry.update(&self.scan, ego);
        self.hash.push(step.pose);
        step
    }
}

/// Places hit by `beams` in the robot's frame at the last one, the robot having moved by `motion` in the last `seconds`.
///
/// For pictures: the matcher has its own, in integers.
#[must_use]
pub fn places(beams: &[Beam], motion: Pose, seconds: f32, robot_from_lidar: Pose) -> Vec<Point> {
    let twist = Twist::from_motion(motion, seconds);
    let end_us = beams.last().map_or(0, |beam| beam.time_us);
    let place = |beam: &Beam| {
        let range = beam.range.metres().ok()?;
        let (s, c) = beamfix::math::sin_cos(beam.bearing.radians());
        let age = end_us.wrapping_sub(beam.time_us) as f32 * 1e-6;
        let end_from_then = twist.displacement(-age);
        Some(end_from_then * (robot_from_lidar * Point::new(range * c, range * s)))
    };
    beams.iter().filter_map(place).collect()
}
