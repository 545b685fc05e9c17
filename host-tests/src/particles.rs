//! Localization by particles in the map that mapping made of the same log: how far off it is, by how many particles.

use anyhow::{Context as _, Result, ensure};
use beamfix::geometry::Pose;
use beamfix::localization::particles::{ParticleConfig, ParticleFilter, Weighting};
use beamfix::pipeline::ParticleLocalizer;
use beamfix::scan::PointsConfig;
use beamfix::sensor_model::likelihood_field::{FieldModel, LikelihoodField};
use beamfix_sim::TruePose;

use crate::formats::Log;
use crate::formats::field::of_map;
use crate::mapping::{self, Settings};
use crate::pipeline::follow;
use crate::{size, sized};

/// Most particles.
pub const MOST: usize = 1024;
/// Points of a scan that are used.
pub const POINTS: usize = 96;
/// Errors of wheels as a share of their motion.
const WHEEL_ERROR: f32 = 0.2;
/// How well the start is known: m, rad.
const START: (f32, f32) = (0.1, 0.05);
/// A pose farther off than this is lost, and counts as so far off (m).
const LOST: f64 = 1.0;

/// A log, its map, and where the robot was in it.
pub struct Course<'a> {
    log: &'a Log,
    field: LikelihoodField<Vec<u8>>,
    truth: Vec<Option<Pose>>,
}

/// How far off a run was, over all scans whose pose is known.
#[derive(Debug, Clone, Copy, Default)]
pub struct Errors {
    /// Mean distance (m), no scan counting as more than a metre.
    pub metres: f64,
    /// Mean rotation (degrees).
    pub degrees: f64,
    /// Share of the scans more than a metre off.
    pub lost: f64,
    /// Scans that moved and weighed the particles.
    pub updates: u32,
    /// Share of the particles drawn that a match proposed.
    pub matched: f64,
    /// Share of the scans whose pose is said to be known.
    pub known: f64,
    /// Over these, the mean of the squared error of position over its variance: 2 where the covariance is right.
    pub normalised: f64,
}

impl<'a> Course<'a> {
    /// Maps a log in the tier of 512 KB, and takes the poses that the map gives in the end as the true ones.
    pub fn mapped(log: &'a Log, tick: &mut dyn FnMut()) -> Result<Self> {
        let settings = Settings::of_all(log, None);
        let map = mapping::run(log, &settings, tick)?;
        let grid = map.grid.context("nothing was mapped")?;
        let truth = map
            .scans
            .iter()
            .map(|scan| scan.is_measured.then_some(scan.pose))
            .collect();
        Ok(Self {
            log,
            field: of_map(&grid, &FieldModel::DEFAULT)?,
            truth,
        })
    }

    /// Localizes the whole log from its first pose on.
    pub fn run(&self, config: &ParticleConfig, weighting: Weighting<'_>) -> Result<Errors> {
        let directions = size::fitting(self.log.scans.iter().map(|scan| &scan.beams[..]));
        sized!(directions, run(self, config, weighting))
    }
}

fn run<const N: usize>(
    course: &Course<'_>,
    config: &ParticleConfig,
    weighting: Weighting<'_>,
) -> Result<Errors> {
    let filter = ParticleFilter::<MOST, POINTS>::new(course.field.as_slice(), *config);
    let points = PointsConfig {
        mount: course.log.mount,
        ..PointsConfig::DEFAULT
    };
    let filter = filter.weighed_by(weighting);
    let mut localizer = ParticleLocalizer::<N, MOST, POINTS>::new(filter, WHEEL_ERROR, points);
    let first = course.truth.first().copied().flatten();
    localizer.start_at(first.context("the first pose is not known")?, START);
    let mut errors = Errors::default();
    let (mut counted, mut known, mut k) = (0.0, 0.0, 0);
    let scans = (course.log.scans.len(), true);
    let followed = follow(course.log, scans, localizer, &mut |_, _, belief| {
        let truth = course.truth.get(k).copied().flatten();
        k += 1;
        let Some(truth) = truth else { return Ok(()) };
        let off = TruePose::from(truth).between(belief.pose.into());
        counted += 1.0;
        errors.metres += off.distance().min(LOST);
        errors.degrees += off.theta.abs().to_degrees();
        errors.lost += f64::from(u8::from(off.distance() > LOST));
        if belief.verdict == beamfix::localization::particles::Verdict::Known {
            known += 1.0;
            let [xx, xy, yy, ..] = belief.covariance.to_array().map(f64::from);
            let (dx, dy) = (
                f64::from(belief.pose.x - truth.x),
                f64::from(belief.pose.y - truth.y),
            );
            errors.normalised +=
                (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
        }
        Ok(())
    })?;
    ensure!(counted > 0.0, "no scan has a pose");
    let filter = followed.estimator.filter();
    let (updates, matched) = filter.counts();
    let particles = config.particles.min(MOST as u16);
    Ok(Errors {
        metres: errors.metres / counted,
        degrees: errors.degrees / counted,
        lost: errors.lost / counted,
        updates,
        matched: f64::from(matched) / (f64::from(updates) * f64::from(particles)),
        known: known / counted,
        normalised: errors.normalised / f64::max(known, 1.0),
    })
}
