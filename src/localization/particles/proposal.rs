//! Where a particle's next pose is drawn from.

use super::{
    config::{ParticleConfig, Proposal},
    motion::Pending,
    weighting::Evidence,
};
use crate::{
    geometry::Pose,
    linalg::{Covariance, Root, Sym3},
    matching::field,
    math::{self, random::Random},
    sensor_model::likelihood_field::Field as _,
};

/// The lattice's step in standard deviations: the product of two normal distributions, summed over three places an axis, has
/// its integral to within 0.1 % an axis, and 0.93 of its variance.
const STEP: f32 = 1.732_050_8;
/// A match farther from where the motion leads than this is another place (squared standard deviations): one in a thousand
/// right ones is.
const ELSEWHERE: f32 = 16.3;
/// Least covariance of a motion, for its inverse (m², rad²).
const FLOOR: Sym3 = Sym3::diagonal(1e-8, 1e-8, 1e-8);

/// A pose drawn.
pub(super) struct Drawn {
    pub pose: Pose,
    /// Of the scan, given the particle as it was (nat).
    pub log_likelihood: f32,
    /// Covariance of what it was drawn from, in the map.
    pub spread: Sym3,
    pub is_matched: bool,
}

/// What a scan and the motion before it propose.
pub(super) struct Proposals<'a> {
    evidence: &'a Evidence<'a>,
    config: &'a ParticleConfig,
    motion: Pose,
    covariance: Covariance,
    /// Root and inverse of the covariance; none for one that is no number.
    model: Option<(Root, Sym3)>,
}

impl<'a> Proposals<'a> {
    pub fn new(evidence: &'a Evidence<'a>, pending: &Pending, config: &'a ParticleConfig) -> Self {
        let covariance = pending.covariance.0.plus(&FLOOR);
        Self {
            evidence,
            config,
            motion: pending.motion,
            covariance: Covariance(covariance),
            model: covariance.root().zip(covariance.inverse()),
        }
    }

    /// Draws the next pose of a particle.
    pub fn draw(&self, before: Pose, random: &mut Random) -> Drawn {
        let improved = match self.config.proposal {
            Proposal::Motion => None,
            Proposal::Improved => self.improved(before, random),
        };
        improved.unwrap_or_else(|| self.by_motion(before, random))
    }

    /// From the motion alone; the scan weighs it.
    fn by_motion(&self, before: Pose, random: &mut Random) -> Drawn {
        let [x, y, turn] = self
            .model
            .map_or([0.0; 3], |(root, _)| root.times(random.normal3()));
        let Pose {
            x: mx,
            y: my,
            theta,
        } = self.motion;
        let pose = before * Pose::new(mx + x, my + y, theta + turn);
        Drawn {
            pose,
            log_likelihood: self.evidence.log(pose),
            spread: self.covariance.rotated(before).0,
            is_matched: false,
        }
    }

    /// From motion and match: algorithm 1 of the paper.
    ///
    /// It has places drawn evenly around the match. Here they are a lattice of three an axis about the maximum of the product,
    /// as far apart as the curvatures of both say, so that 27 are enough, and a direction that only the motion determines is
    /// covered as well.
    fn improved(&self, before: Pose, random: &mut Random) -> Option<Drawn> {
        let (model, information) = self.model?;
        let guess = before * self.motion;
        // The most likely pose, from where the motion leads; where that is less certain than a match's reach, from a place
        // drawn around it.
        let Evidence { field, points, .. } = *self.evidence;
        let sigma = field.scale().sigma;
        let is_wide = self.covariance.0.xx + self.covariance.0.yy > 4.0 * sigma * sigma;
        let start = if is_wide {
            let around = self.covariance.rotated(before).0;
            around
                .root()
                .map_or(guess, |root| moved(guess, root.times(random.normal3())))
        } else {
            guess
        };
        let found = field::align(field, points, start, &self.config.field).ok()?;
        let off = [
            found.pose.x - guess.x,
            found.pose.y - guess.y,
            math::wrap_angle(found.pose.theta - guess.theta),
        ];
        let information = Covariance(information).rotated(before).0;
        // The particle is off as well, by about what the field blurs surfaces by. As negated, NaN is elsewhere too.
        let square = sigma * sigma;
        let blur = Sym3::diagonal(square, square, square);
        let expected = self.covariance.rotated(before).0.plus(&blur).inverse()?;
        if !(expected.quadratic(off) < ELSEWHERE) {
            return None;
        }
        // Laplace's approximation of the product: its maximum and its width.
        let noise = math::max(found.residual, self.config.field.min_range_sigma);
        let told = found.information.0.scaled(self.evidence.curvature(noise));
        let width = information.plus(&told).inverse()?;
        let root = width.root()?;
        let middle = width.times(told.times(off));
        // Places around it, each with the logarithm of likelihood times motion.
        let mut places = [([0.0; 3], 0.0); 27];
        let mut most = f32::NEG_INFINITY;
        for (k, place) in (0u8..).zip(&mut places) {
            let axis = |power: u8| STEP * (f32::from(k / power % 3) - 1.0);
            let [x, y, turn] = root.times([axis(1), axis(3), axis(9)]);
            let at = [middle[0] + x, middle[1] + y, middle[2] + turn];
            let log = self.evidence.log(moved(guess, at)) - 0.5 * information.quadratic(at);
            *place = (at, log);
            most = math::max(log, most);
        }
        // Weights, mean and covariance of the normal distribution.
        let (mut sum, mut mean) = (0.0, [0.0f32; 3]);
        for (at, log) in &mut places {
            let weight = math::exp(math::max(*log - most, -80.0));
            *log = weight;
            sum += weight;
            for (mean, at) in mean.iter_mut().zip(*at) {
                *mean += weight * at;
            }
        }
        let mean = mean.map(|sum_of_axis| sum_of_axis / sum);
        let mut spread = Sym3::default();
        for (at, weight) in places {
            let from_mean = [at[0] - mean[0], at[1] - mean[1], at[2] - mean[2]];
            spread = spread.plus(&Sym3::outer(from_mean).scaled(weight / sum));
        }
        // All in one place of the lattice: as wide as the curvatures say.
        let (spread, drawn_from) = spread.root().map_or((width, root), |root| (spread, root));
        let [x, y, turn] = drawn_from.times(random.normal3());
        // The sum is the integral, once it is multiplied by the lattice's cell and the motion's density has its factor.
        /// The lattice's cell in standard deviations of the axes.
        const CELL: f32 = STEP * STEP * STEP;
        /// (2π)^1.5: of a normal distribution in three dimensions.
        const TURNS_CUBED: f32 = 15.749_61;
        let volume = CELL * root.determinant() / (TURNS_CUBED * model.determinant());
        Some(Drawn {
            pose: moved(guess, [mean[0] + x, mean[1] + y, mean[2] + turn]),
            log_likelihood: most + math::ln(sum * volume),
            spread,
            is_matched: true,
        })
    }
}

/// A pose moved along the map's axes and turned.
fn moved(pose: Pose, [x, y, turn]: [f32; 3]) -> Pose {
    Pose::new(pose.x + x, pose.y + y, pose.theta + turn)
}
