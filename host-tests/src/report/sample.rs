//! Two scans of a run, matched from where the second would be if the robot had not moved: a look at a single match.

use beamfix::geometry::{Pose, Twist};
use beamfix::matching::icp::{self, IcpConfig, Reference};
use beamfix::scan::{Beam, Mount, Points, PointsConfig, Scan};

use super::picture::pair::PairPicture;
use super::score::error;
use super::track::At;
use crate::{size, sized};

/// So far (m, rad) the robot moves between the two: enough to be seen, and few enough that a search nearby finds it.
const APART: (f32, f32) = (0.25, 0.26);
/// At most so many scans between the two.
const MOST: usize = 40;

/// A scan, and how the robot moved while it was taken.
struct Taken {
    at: At,
    twist: Twist,
    beams: Vec<Beam>,
}

/// The two scans as far as they have come by.
pub struct Sample {
    mount: Mount,
    /// Number of the scan that is the reference.
    start: usize,
    number: usize,
    before: Option<At>,
    reference: Option<Taken>,
    current: Option<(usize, Taken)>,
}

impl Sample {
    /// Takes the reference after a third of `scans`.
    #[must_use]
    pub fn new(mount: Mount, scans: usize) -> Self {
        Self {
            mount,
            start: scans / 3,
            number: 0,
            before: None,
            reference: None,
            current: None,
        }
    }

    /// Looks at a scan.
    pub fn push(&mut self, at: &At, beams: &[Beam]) {
        let number = self.number;
        self.number += 1;
        let twist = self.before.replace(*at).map_or(Twist::ZERO, |before| {
            let motion = before.estimate.between(at.estimate);
            Twist::from_motion(motion, (at.time - before.time) as f32)
        });
        let taken = || Taken {
            at: *at,
            twist,
            beams: beams.to_vec(),
        };
        match &self.reference {
            None if number >= self.start && at.is_measured => self.reference = Some(taken()),
            Some(reference) if self.current.is_none() => {
                let motion = reference.at.estimate.between(at.estimate);
                let is_apart = motion.distance() > APART.0 || motion.theta.abs() > APART.1;
                if is_apart || number > self.start + MOST {
                    self.current = Some((number, taken()));
                }
            }
            _ => {}
        }
    }

    /// The match and its picture; `None` where the run was too short for two scans.
    #[must_use]
    pub fn picture(&self) -> Option<PairPicture> {
        let (reference, (number, current)) = (self.reference.as_ref()?, self.current.as_ref()?);
        let scans = [&reference.beams[..], &current.beams[..]];
        let size = size::fitting(scans.into_iter());
        let numbers = (*number, self.start);
        Some(sized!(
            size,
            matched(self.mount, (reference, current), numbers)
        ))
    }
}

fn matched<const N: usize>(
    mount: Mount,
    (before, now): (&Taken, &Taken),
    (number, earlier): (usize, usize),
) -> PairPicture {
    let (name, motion) = match (before.at.truth, now.at.truth) {
        (Some(before), Some(now)) => ("the truth", before.between(now)),
        _ => (
            "the run's estimate",
            before.at.estimate.between(now.at.estimate),
        ),
    };
    let robot_from_lidar = mount.robot_from_lidar;
    let truth = robot_from_lidar.inverse() * motion * robot_from_lidar;
    let mut scan = Box::new(Scan::<N>::new());
    let mut place = |taken: &Taken| {
        let config = PointsConfig {
            mount,
            ..PointsConfig::DEFAULT
        };
        scan.clear();
        for &beam in taken.beams.iter().take(N) {
            // N are taken: they fit.
            let _ = scan.push(beam);
        }
        let mut points = Box::new(Points::<N>::new());
        points.assign(&scan, taken.twist, &config);
        points
    };
    let (reference_points, points) = (place(before), place(now));
    let mut reference = Box::new(Reference::<N>::new());
    reference.assign(reference_points.as_slice());
    let guess = Pose::IDENTITY;
    let mut path = Vec::new();
    let config = IcpConfig::DEFAULT;
    let observe = |pose| path.push(pose);
    let found = icp::align_observed(&reference, points.as_slice(), guess, &config, observe);
    let verdict = match &found {
        Ok(found) => {
            let (metres, degrees) = error(found.pose, truth);
            format!(
                "{:.1} mm and {degrees:.3}° from {name}; {} inliers, residual {:.1} mm, score {:.2}",
                1e3 * metres,
                found.inliers,
                1e3 * found.residual,
                found.score
            )
        }
        Err(error) => format!("refused: {error}"),
    };
    PairPicture::new(
        (
            format!("scan {number} matched to scan {earlier}, as if the robot had not moved"),
            verdict,
        ),
        (&reference_points, &reference),
        &points,
        (guess, truth),
        found.ok().map(|found| (found.pose, found.covariance)),
        path,
    )
    .with_truth_named(name)
}
