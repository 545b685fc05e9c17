//! All particles as one pose.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    math,
};

/// A pose that may be the lidar's. 16 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Particle {
    /// Lidar in the map.
    pub pose: Pose,
    /// Logarithm of its weight over the heaviest one's (nat): at most 0. Products of likelihoods would underflow; sums of
    /// logarithms do not.
    pub log_weight: f32,
}

/// How sure the pose is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// The particles agree, and the scan fits their mean.
    Known,
    /// The particles agree, and the scan does not fit, or beams go through walls: people around, or the robot was carried. Or
    /// it fits, and not yet enough scans did to call the pose found.
    Doubtful,
    /// The particles are too far apart for their mean to be a place: the pose is one of several, or anywhere.
    Spread,
    /// Several scans in a row did not fit.
    Lost,
}

/// What the particles know after a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Belief {
    /// Weighted mean of the particles, in the map (m, rad). Where they are spread this may be a place where none of them is;
    /// where it is no finite number, the map's origin.
    pub pose: Pose,
    /// Covariance of the particles about `pose`, along the map's axes, headings the short way round (m², m·rad, rad²); zero
    /// where it is no finite number, and the verdict then is no pose. Few particles scatter less than what they were drawn
    /// from: that part is added. What all have inherited from one ancestor is not in it: the fewer they are, the larger the
    /// error really is.
    pub covariance: Covariance,
    /// Particles that count: `1 / Σw²`, from 1 to all of them.
    pub effective: f32,
    /// Quality of the scan at the mean, as a localizer has it: 1 where all beams end on surfaces, negative where most go
    /// through some.
    pub fit: f32,
    /// Whether `pose` is to be believed.
    pub verdict: Verdict,
}

impl Belief {
    /// The same of the robot that the lidar sits on.
    pub(crate) fn of_robot(&self, lidar_from_robot: Pose) -> Self {
        let robot = self.pose * lidar_from_robot;
        let (dx, dy) = (robot.x - self.pose.x, robot.y - self.pose.y);
        Self {
            pose: robot,
            covariance: self.covariance.transported(dx, dy),
            ..*self
        }
    }
}

/// Mean and covariance of the particles where they were moved last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    pub pose: Pose,
    pub covariance: Covariance,
    pub effective: f32,
}

impl Mean {
    pub const NOWHERE: Self = Self {
        pose: Pose::IDENTITY,
        covariance: Covariance(Sym3::diagonal(0.0, 0.0, 0.0)),
        effective: 0.0,
    };

    pub fn is_finite(&self) -> bool {
        self.pose.is_finite() && self.effective.is_finite()
    }

    /// Of particles that were drawn with a covariance of `spread` on the mean, the heaviest with a weight of 1.
    ///
    /// Of particles drawn from one distribution the weighted squares miss the share Σw² of its covariance on the mean: with
    /// one particle all of it.
    pub fn of(particles: &[Particle], spread: &Sym3) -> Self {
        let Some(first) = particles.first() else {
            return Self::NOWHERE;
        };
        let weight = |particle: &Particle| math::exp(math::max(particle.log_weight, -80.0));
        let off = |from: Pose, pose: Pose| {
            [
                pose.x - from.x,
                pose.y - from.y,
                math::wrap_angle(pose.theta - from.theta),
            ]
        };
        let (mut sum, mut squares) = (0.0, 0.0);
        let (mut x, mut y, mut sine, mut cosine) = (0.0, 0.0, 0.0, 0.0);
        for particle in particles {
            let w = weight(particle);
            // From one of them on: coordinates of a hundred metres would take the digits that millimetres need.
            let [dx, dy, turn] = off(first.pose, particle.pose);
            let (s, c) = math::sin_cos(turn);
            sum += w;
            squares += w * w;
            (x, y) = (x + w * dx, y + w * dy);
            (sine, cosine) = (sine + w * s, cosine + w * c);
        }
        let mean = Pose::new(
            first.pose.x + x / sum,
            first.pose.y + y / sum,
            first.pose.theta + math::atan2(sine, cosine),
        );
        let mut covariance = spread.scaled(squares / (sum * sum));
        for particle in particles {
            let w = weight(particle) / sum;
            let square = Sym3::outer(off(mean, particle.pose));
            covariance = covariance.plus(&square.scaled(w));
        }
        Self {
            pose: mean,
            covariance: Covariance(covariance),
            effective: sum * sum / squares,
        }
    }
}
