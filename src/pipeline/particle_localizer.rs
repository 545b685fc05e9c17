//! Localization by particles as an estimator: whole scans and the robot's motion in, the robot's pose out.

use super::{
    estimator::{Estimate, Estimator, Verdict},
    seen::Seen,
};
use crate::{
    geometry::{EgoMotion, Pose},
    linalg::Covariance,
    localization::particles::{self, Belief, Motion, ParticleFilter},
    scan::{PointsConfig, Scan},
};

/// A [`ParticleFilter`] with the lidar's place on the robot.
///
/// The filter and 8·N bytes. N is the most beams of a revolution, M the most particles, B the points that are used where all
/// are not needed. Its steps are [`Belief`]s about the robot. It has no other work: a scan that is due costs at once what the
/// filter says.
#[derive(Debug)]
pub struct ParticleLocalizer<'a, const N: usize, const M: usize, const B: usize> {
    filter: ParticleFilter<'a, M, B>,
    wheel_error: f32,
    seen: Seen<N>,
}

impl<'a, const N: usize, const M: usize, const B: usize> ParticleLocalizer<'a, N, M, B> {
    /// Localizes with scans taken as `config` says, and wheels whose errors are a share of their motion, as
    /// [`Motion::by_wheels`] has it: 0.2 for ordinary ones.
    #[must_use]
    pub const fn new(
        filter: ParticleFilter<'a, M, B>,
        wheel_error: f32,
        config: PointsConfig,
    ) -> Self {
        Self {
            filter,
            wheel_error,
            seen: Seen::new(config),
        }
    }

    /// Particles around a known pose of the robot in the map, with these standard deviations of each coordinate (m) and of the
    /// heading (rad).
    pub fn start_at(&mut self, map_from_robot: Pose, sigmas: (f32, f32)) {
        let mount = self.seen.mount().robot_from_lidar;
        self.filter.start_at(map_from_robot * mount, sigmas);
    }

    /// The filter, for its particles.
    #[must_use]
    pub const fn filter(&self) -> &ParticleFilter<'a, M, B> {
        &self.filter
    }
}

impl<const N: usize, const M: usize, const B: usize> Estimator<N>
    for ParticleLocalizer<'_, N, M, B>
{
    type Step = Belief;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Belief {
        let (pose, seconds) = self.seen.take(scan, ego);
        let by_wheels = Motion::by_wheels(pose, self.wheel_error);
        let motion = match ego.motion() {
            Some(_) => by_wheels,
            None => by_wheels.without_wheels(seconds, ego.credible_rotation().is_some()),
        };
        let mount = self.seen.mount();
        self.filter.moved(&motion.of_lidar(mount));
        let belief = self.filter.update(self.seen.points());
        belief.of_robot(self.seen.mount().robot_from_lidar.inverse())
    }
}

impl Estimate for Belief {
    fn pose(&self) -> Option<Pose> {
        match self.verdict {
            particles::Verdict::Known | particles::Verdict::Doubtful => Some(self.pose),
            particles::Verdict::Spread | particles::Verdict::Lost => None,
        }
    }

    fn covariance(&self) -> Option<Covariance> {
        self.pose().map(|_| self.covariance)
    }

    fn verdict(&self) -> Verdict {
        match self.verdict {
            particles::Verdict::Known => Verdict::Measured,
            particles::Verdict::Doubtful => Verdict::Predicted,
            particles::Verdict::Spread | particles::Verdict::Lost => Verdict::Unknown,
        }
    }
}
