//! Where am I in a known map, by particles: poses that each may be the right one, as many as there is memory for.
//!
//! A particle is moved by a [`Motion`] and weighed by how likely it makes the scan. Where it goes to is drawn from a
//! [`Proposal`]: from what the wheels tell alone, or from what wheels and the scan's match tell together (Grisetti,
//! Stachniss, Burgard, *Improved Techniques for Grid Mapping With Rao-Blackwellized Particle Filters*, T-RO 2007), which needs
//! fewer of them. The map is a likelihood field; scans are weighed by it, or by the beam model ([`Weighting`]).
//!
//! It follows a pose that is known roughly. A robot of which nothing is known it finds only with particles enough that some
//! are near: [`Localizer`](super::Localizer) looks everywhere. Unlike that it keeps several poses alive for as long as nothing
//! tells them apart, and says so by its covariance. Where scans do not fit, particles are drawn from farther and farther
//! around, until one fits again. It repeats itself: the same seed, scans and motions give the same bits on every machine.
//!
//! ```
//! use beamfix::{
//!     Grid, LikelihoodField, Pose,
//!     grid::Shape,
//!     localization::particles::{Motion, ParticleConfig, ParticleFilter, Verdict},
//!     scan::{Bearing, ScanPoint},
//!     sensor_model::likelihood_field::FieldModel,
//! };
//!
//! // A map of nothing: 4 m square, in cells of 5 cm. A board has it in flash: `likelihood_field::stored::parse`.
//! let scale = FieldModel::DEFAULT.scale();
//! let shape = Shape::new(80, 80, 0.05, Pose::IDENTITY)?;
//! let field = LikelihoodField::new(Grid::new(shape, [1u8; 80 * 80])?, scale)?;
//! // 16 particles; of each scan 96 points at most are used.
//! let mut filter = ParticleFilter::<16, 96>::new(field.as_slice(), ParticleConfig::DEFAULT);
//! filter.start_at(Pose::new(2.0, 2.0, 0.0), (0.1, 0.05));
//! filter.moved(&Motion::by_wheels(Pose::new(0.2, 0.0, 0.0), 0.2));
//! let belief = filter.update(&[ScanPoint::at(Bearing(0), 1000); 30]);
//! assert_eq!(belief.verdict, Verdict::Doubtful, "no such wall in this map");
//! # Ok::<(), beamfix::grid::GridError>(())
//! ```

mod belief;
mod config;
mod motion;
mod proposal;
mod resampling;
mod weighting;

use super::quality::Quality;
use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    math::{self, random::Random},
    scan::{ScanPoint, thinning::thinned},
    sensor_model::likelihood_field::{Field as _, LikelihoodField},
};
pub use belief::{Belief, Verdict};
use belief::{Mean, Particle};
pub use config::{ParticleConfig, Proposal};
pub use motion::Motion;
use motion::Pending;
use proposal::Proposals;
use weighting::Evidence;
pub use weighting::Weighting;

/// A match leads back from so many of the field's σ away.
const MATCH_REACH: f32 = 2.5;
/// Poses are drawn from so many times that far around at most.
const MOST_TIMES: u8 = 8;

/// A particle filter with room for M particles, in a map that lies in flash; of each scan at most B points are used, evenly
/// spread: take 60 to 128.
///
/// 16·M bytes and about 230. On the stack 8·B while it takes a scan, and 16·M while it resamples.
///
/// With 16 particles and 96 points a scan that follows enough motion costs 0.13 M instructions of an M4F by [`Proposal::Motion`]
/// and 2.44 M by [`Proposal::Improved`]; by [`Weighting::BeamModel`] many times that, a ray a beam instead of a byte. Where
/// wheels are right to a fifth, 8 particles by the improved proposal are as near as 40 by the motion (`beamfix particles` of a
/// recorded log); where they tell the wrong way for seconds, few particles of either proposal lose the robot.
#[derive(Debug, Clone)]
pub struct ParticleFilter<'a, const M: usize, const B: usize> {
    field: LikelihoodField<&'a [u8]>,
    weighting: Weighting<'a>,
    config: ParticleConfig,
    particles: heapless::Vec<Particle, M>,
    random: Random,
    /// Since the particles were moved last.
    pending: Pending,
    /// Of the particles where they are.
    mean: Mean,
    is_weighed: bool,
    /// Whether a pose was told or found; and scans in a row that did not fit, or that fit well.
    is_sure: bool,
    bad_scans: u8,
    good_scans: u8,
    updates: u32,
    matched: u32,
}

impl<'a, const M: usize, const B: usize> ParticleFilter<'a, M, B> {
    /// Knows nothing: unless a pose is told before, the first scan finds particles all over the map.
    #[must_use]
    pub const fn new(field: LikelihoodField<&'a [u8]>, config: ParticleConfig) -> Self {
        Self {
            field,
            weighting: Weighting::LikelihoodField,
            random: Random::new(config.seed),
            config,
            particles: heapless::Vec::new(),
            pending: Pending::NONE,
            mean: Mean::NOWHERE,
            is_weighed: false,
            is_sure: false,
            bad_scans: 0,
            good_scans: 0,
            updates: 0,
            matched: 0,
        }
    }

    /// This filter with its scans weighed by another sensor model: a new one weighs them by the likelihood field.
    #[must_use]
    pub const fn weighed_by(mut self, weighting: Weighting<'a>) -> Self {
        self.weighting = weighting;
        self
    }

    /// Particles around a known pose of the lidar in the map, with these standard deviations of each coordinate (m) and of
    /// the heading (rad); all over the map where a number is not finite.
    pub fn start_at(&mut self, map_from_lidar: Pose, sigmas: (f32, f32)) {
        self.start_at_any(&[map_from_lidar], sigmas);
    }

    /// Particles around several poses of the lidar in the map, one of which is the right one, as many around each; the same
    /// standard deviations (m, rad) for all. All over the map where there is no pose, or a number is not finite.
    pub fn start_at_any(&mut self, maps_from_lidar: &[Pose], (position, heading): (f32, f32)) {
        let are_poses =
            !maps_from_lidar.is_empty() && maps_from_lidar.iter().all(|p| p.is_finite());
        if !(are_poses && position.is_finite() && heading.is_finite()) {
            self.scatter();
            return;
        }
        let random = &mut self.random;
        self.particles.clear();
        let around = maps_from_lidar.iter().cycle();
        for &Pose { x, y, theta } in around.take(self.config.count(M)) {
            let [dx, dy, turn] = random.normal3();
            let pose = Pose::new(x + position * dx, y + position * dy, theta + heading * turn);
            let _ = self.particles.push(Particle {
                pose,
                log_weight: 0.0,
            });
        }
        self.begin(maps_from_lidar.len() == 1);
    }

    /// Particles evenly over all explored cells that no surface is near, with any heading: nothing is known.
    pub fn scatter(&mut self) {
        /// Cells tried for a particle; in a map whose explored part is smaller than a hundredth, some lie beside it.
        const TRIES: u8 = 255;
        let random = &mut self.random;
        let (shape, scale) = (*self.field.shape(), *self.field.scale());
        let near = scale.byte_at(2.0);
        self.particles.clear();
        for _ in 0..self.config.count(M) {
            let (mut x, mut y) = (0, 0);
            for _ in 0..TRIES {
                x = random.below(u32::from(shape.width()));
                y = random.below(u32::from(shape.height()));
                let byte = self.field.byte(x, y);
                if byte != scale.unexplored && byte < near {
                    break;
                }
            }
            let middle = shape.middle_of(x as i32, y as i32);
            let within = |random: &mut Random| (random.unit() - 0.5) * shape.resolution();
            let heading = core::f32::consts::TAU * random.unit();
            let pose = Pose::new(
                middle.x + within(random),
                middle.y + within(random),
                heading,
            );
            let _ = self.particles.push(Particle {
                pose,
                log_weight: 0.0,
            });
        }
        self.begin(false);
    }

    fn begin(&mut self, is_sure: bool) {
        self.pending = Pending::NONE;
        self.is_weighed = false;
        self.is_sure = is_sure;
        (self.bad_scans, self.good_scans) = (0, 0);
        self.mean = Mean::of(&self.particles, &Sym3::default());
    }

    /// Poses of the lidar in the map (m, rad) where the particles were moved last, and their weights, which sum to 1.
    pub fn particles(&self) -> impl Iterator<Item = (Pose, f32)> + '_ {
        let weight = |particle: &Particle| math::exp(math::max(particle.log_weight, -80.0));
        let sum: f32 = self.particles.iter().map(weight).sum();
        let particles = self.particles.iter();
        particles.map(move |particle| (particle.pose, weight(particle) / sum))
    }

    /// Scans that moved and weighed the particles, and matches that proposed one: both count on from 0 after 2³².
    #[must_use]
    pub const fn counts(&self) -> (u32, u32) {
        (self.updates, self.matched)
    }

    /// Takes the lidar's motion since it was told last: several add up until a scan moves the particles.
    pub fn moved(&mut self, motion: &Motion) {
        self.pending.add(motion);
    }

    /// Takes a scan, its points in the lidar's frame.
    ///
    /// The particles are moved and weighed where the lidar has moved by [`ParticleConfig::min_distance`] or
    /// [`ParticleConfig::min_rotation`] since they were last; a scan from the same place would count what is wrong with it
    /// twice. Else the belief is moved by the motion alone.
    pub fn update(&mut self, points: &[ScanPoint]) -> Belief {
        let mut some = heapless::Vec::<ScanPoint, B>::new();
        for &point in thinned(points, B) {
            let _ = some.push(point);
        }
        if self.particles.is_empty() || !self.mean.is_finite() {
            self.scatter();
        }
        let is_due = !self.is_weighed || self.pending.is_due(&self.config);
        if is_due && !some.is_empty() {
            self.resample();
            self.weigh(&some);
        }
        self.belief(&some)
    }

    /// Moves each particle to where the proposal draws it, and weighs it.
    fn weigh(&mut self, points: &[ScanPoint]) {
        let is_known = self.is_sure && !self.config.is_spread(&self.mean.covariance);
        let independent = if is_known {
            self.config.independent_beams
        } else {
            // Of two places that fit about as well, the difference is what is wrong with the map (the idea of Pfaff, Burgard,
            // Fox, Robust Monte-Carlo Localization Using Adaptive Likelihood Models, EUROS 2006).
            self.config.spread_beams
        };
        let evidence = Evidence::new(&self.field, self.weighting, points, independent);
        let proposals = Proposals::new(&evidence, &self.pending, &self.config);
        let mut spread = Sym3::default();
        let share = 1.0 / math::max(self.particles.len() as f32, 1.0);
        for particle in &mut self.particles {
            let drawn = proposals.draw(particle.pose, &mut self.random);
            *particle = Particle {
                pose: drawn.pose,
                log_weight: particle.log_weight + drawn.log_likelihood,
            };
            spread = spread.plus(&drawn.spread.scaled(share));
            self.matched = self.matched.wrapping_add(u32::from(drawn.is_matched));
        }
        resampling::normalise(&mut self.particles);
        self.mean = Mean::of(&self.particles, &spread);
        self.pending = Pending::NONE;
        self.is_weighed = true;
        self.updates = self.updates.wrapping_add(1);
    }

    /// Draws as many particles again, each as often as its weight says, where too few of them count.
    fn resample(&mut self) {
        let count = self.particles.len() as f32;
        if self.mean.effective < 0.5 * count {
            let before = self.particles.clone();
            resampling::low_variance(&before, &mut self.particles, self.random.unit());
        }
    }

    /// Where the lidar is, and how sure that is: the particles as one, moved on by what is pending.
    fn belief(&mut self, points: &[ScanPoint]) -> Belief {
        let pose = self.mean.pose * self.pending.motion;
        let covariance = self.pending.carried(&self.mean);
        let quality = Quality::of(&self.field, points, pose, B);
        let fit = quality.value();
        let fits = fit >= self.config.min_quality;
        if fits {
            self.bad_scans = 0;
        } else {
            self.bad_scans = self.bad_scans.saturating_add(1);
            // The motion was not as told, or the robot was carried: the next poses are drawn from farther around, and from
            // farther each time, as wheels that tell the wrong way part from the truth faster than errors add up.
            let times = self.bad_scans.min(MOST_TIMES);
            self.pending
                .widen(f32::from(times) * MATCH_REACH * self.field.scale().sigma);
        }
        let is_finite = pose.is_finite() && covariance.to_array().iter().all(|v| v.is_finite());
        let is_one = is_finite && !self.particles.is_empty() && !self.config.is_spread(&covariance);
        let is_confident = quality.is_confident(self.config.max_wall_crossings);
        self.good_scans = if is_one && is_confident && fit >= self.config.min_found_quality {
            self.good_scans.saturating_add(1)
        } else {
            0
        };
        let is_lost = self.bad_scans >= self.config.max_bad_scans;
        self.is_sure = !is_lost && (self.is_sure || self.good_scans >= self.config.min_found_scans);
        let verdict = if is_lost {
            Verdict::Lost
        } else if !is_one {
            Verdict::Spread
        } else if fits && is_confident && self.is_sure {
            Verdict::Known
        } else {
            Verdict::Doubtful
        };
        if !is_finite {
            // The next scan starts anew.
            self.particles.clear();
        }
        Belief {
            pose: if is_finite { pose } else { Pose::IDENTITY },
            covariance: if is_finite {
                covariance
            } else {
                Covariance::default()
            },
            effective: self.mean.effective,
            fit,
            verdict,
        }
    }
}
