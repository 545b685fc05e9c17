//! The best pose in a window, found by branch and bound: Olson, ICRA 2009; Hess et al., ICRA 2016.
//!
//! The window is cut into cells and headings. The score of a pose is the sum of the field's bytes where the beams end. A
//! pyramid of maxima bounds the score of a whole block of poses at once, so blocks that cannot win are left out, and what
//! is found is exactly the best of all poses, whatever the guess.

mod config;
#[cfg(not(feature = "internals"))]
pub(crate) mod pyramid;
#[cfg(feature = "internals")]
pub mod pyramid;
pub(crate) mod rotated;
mod search;
mod window;

use super::{
    Match, MatchError, degeneracy,
    window_covariance::{AS_GOOD, REACH, WindowCovariance},
};
use crate::{
    geometry::Pose,
    math,
    scan::{
        ScanPoint,
        thinning::{stride, thinned},
    },
    sensor_model::likelihood_field::{Field, placement::Placement},
};
pub use config::CorrelativeConfig;
pub use pyramid::Pyramid;
#[cfg(feature = "internals")]
pub use rotated::sum_four;
pub use search::Correlator;
#[cfg(feature = "internals")]
pub use window::{Candidate, Near, Window};
#[cfg(not(feature = "internals"))]
pub(crate) use window::{Candidate, Near, Window};

/// Headings closer than this (rad) belong to the same mode.
const SAME_HEADING: f32 = 0.35;

impl<const N: usize> Correlator<N> {
    /// The best pose in the window around `guess`, to a cell and a step of the heading.
    ///
    /// At most N points are used, evenly spread. The covariance is that of the scores around the best pose. Along a
    /// direction in which these are even, and the guess explains the scan as well, the pose keeps the guess. The score is
    /// the mean height of the beams' bytes above an unexplored cell's, as a share of the peak's.
    ///
    /// # Errors
    /// [`MatchError::TooFewBeams`] for fewer than 10 points, [`MatchError::BadGuess`], [`MatchError::BadConfig`] for a
    /// window that is too large, [`MatchError::NothingFound`] below the least score, [`MatchError::Ambiguous`] if that is
    /// looked for.
    pub fn align(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        guess: Pose,
        config: &CorrelativeConfig,
    ) -> Result<Match, MatchError> {
        let Found {
            window,
            best,
            heights,
        } = self.find(pyramid, points, guess, config)?;
        let spread = self.spread(pyramid, points, &window, best, config);
        let found = window.pose(best.x, best.y, best.heading);
        let mut covariance = spread.covariance(window.axes);
        let open = spread.open(&covariance, degeneracy::mean_range(points));
        let scale = pyramid.field().scale();
        let nats = scale.step * config.temper;
        let kept = open.and_then(|open| {
            let pose = open.keep(found, guess);
            let sum = self.sum_at(pyramid, points, pose)?;
            let as_good = (sum as f32 - best.sum as f32) * nats >= AS_GOOD;
            as_good.then_some((open, pose, sum))
        });
        let mut information = covariance.information().ok_or(MatchError::Degenerate)?;
        let (pose, sum) = kept.map_or((found, best.sum), |(_, pose, sum)| (pose, sum));
        if let Some((open, ..)) = kept {
            (information, covariance) = degeneracy::uncertainty(&information.0, 1.0, Some(&open))?;
        }
        let seen = seen(pyramid, thinned(points, N), pose);
        let used = points.len().div_ceil(stride(points.len(), N));
        let lost = math::max(255.0 - sum as f32 / used as f32, 0.0);
        Ok(Match {
            pose,
            covariance,
            information,
            inliers: seen.on_surface,
            overlap: seen.explored,
            beams: points.len() as u16,
            residual: scale.sigma * math::sqrt(2.0 * scale.step * lost),
            score: heights.score(sum),
            degenerate_direction: kept.map(|(open, ..)| open.told(&covariance)),
            iterations: 0,
            starts: None,
        })
    }

    /// The best pose in the window around `guess`, and nothing about how far it can be trusted: a start for a finer match.
    ///
    /// # Errors
    /// As [`Correlator::align`].
    pub(crate) fn best(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        guess: Pose,
        config: &CorrelativeConfig,
    ) -> Result<Pose, MatchError> {
        let Found { window, best, .. } = self.find(pyramid, points, guess, config)?;
        Ok(window.pose(best.x, best.y, best.heading))
    }

    /// The best cell of the window.
    fn find(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        guess: Pose,
        config: &CorrelativeConfig,
    ) -> Result<Found, MatchError> {
        let used = points.len().div_ceil(stride(points.len(), N));
        if used < 10 {
            return Err(MatchError::TooFewBeams {
                found: used as u16,
                needed: 10,
            });
        }
        let window = Window::new(pyramid, points, guess, config)?;
        let scale = pyramid.field().scale();
        let floor = u32::from(scale.unexplored) * used as u32;
        let heights = Heights {
            floor,
            peak: (255.0 - f32::from(scale.unexplored)) * used as f32,
        };
        let least = floor
            + math::round_to_i32(math::max(config.min_score, 0.0) * heights.peak).unsigned_abs();
        let Some(best) = self.search(pyramid, points, &window, least.saturating_sub(1), None)
        else {
            return Err(MatchError::NothingFound {
                min_score: config.min_score,
            });
        };
        if config.max_ambiguity <= 1.0 {
            let limit = floor as f32 + config.max_ambiguity * (best.sum as f32 - floor as f32);
            let cells = math::round_to_i32(config.min_separation / window.resolution) as i16;
            let headings = math::round_to_i32(SAME_HEADING / window.step) as i16;
            let near = Near {
                best,
                cells,
                headings,
            };
            if let Some(other) = self.search(pyramid, points, &window, limit as u32, Some(near)) {
                return Err(MatchError::Ambiguous {
                    ratio: heights.score(other.sum) / math::max(heights.score(best.sum), 1e-6),
                });
            }
        }
        Ok(Found {
            window,
            best,
            heights,
        })
    }

    /// Sum of bytes of the scan at a pose.
    fn sum_at(&mut self, pyramid: &Pyramid<'_>, points: &[ScanPoint], pose: Pose) -> Option<u32> {
        if !self.rotated.assign(pyramid, points, pose, 4) {
            return None;
        }
        self.lookups += 4 * self.rotated.len() as u64;
        let [sum, ..] = self.rotated.row(pyramid, 0, 0, 0);
        Some(sum)
    }

    /// Scores of the poses around the best one: tempered log-likelihoods.
    fn spread(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        window: &Window,
        best: Candidate,
        config: &CorrelativeConfig,
    ) -> WindowCovariance {
        let nats = pyramid.field().scale().step * config.temper;
        let mut spread = WindowCovariance::new(window.resolution, window.step);
        for heading in -REACH..=REACH {
            // A window of its own around the best cell, so that the edge of the search does not cut it.
            let corner = window.pose(best.x - REACH, best.y - REACH, best.heading + heading);
            if !self.rotated.assign(pyramid, points, corner, 8) {
                continue;
            }
            for row in -REACH..=REACH {
                let first = self.rotated.row(pyramid, 0, 0, row + REACH);
                let rest = self.rotated.row(pyramid, 0, 4, row + REACH);
                let sums = first.into_iter().chain(rest);
                for (column, sum) in (-REACH..=REACH).zip(sums) {
                    let lost = (sum as f32 - best.sum as f32) * nats;
                    spread.add([column, row, heading], lost);
                }
            }
        }
        spread
    }
}

/// What a search settles on.
struct Found {
    window: Window,
    best: Candidate,
    heights: Heights,
}

/// Sums of bytes between which a score lies.
struct Heights {
    /// All beams in unexplored cells.
    floor: u32,
    /// All beams on surfaces, above the floor.
    peak: f32,
}

impl Heights {
    /// 0 at the floor, 1 at the peak.
    fn score(&self, sum: u32) -> f32 {
        (sum as f32 - self.floor as f32) / self.peak
    }
}

/// Beams that end where the map knows something, and those of them that end within 1.5σ of a surface.
struct Seen {
    explored: u16,
    on_surface: u16,
}

/// Looks where the beams end.
fn seen<'a>(
    pyramid: &Pyramid<'_>,
    points: impl Iterator<Item = &'a ScanPoint>,
    pose: Pose,
) -> Seen {
    let field = pyramid.field();
    let scale = field.scale();
    let mut seen = Seen {
        explored: 0,
        on_surface: 0,
    };
    let Some(placement) = Placement::new(field.shape(), pose) else {
        return seen;
    };
    let near = scale.byte_at(1.5);
    for point in points {
        let (x, y) = placement.cell(point);
        let byte = field.byte(x, y);
        seen.explored += u16::from(byte != scale.unexplored);
        seen.on_surface += u16::from(byte != scale.unexplored && byte >= near);
    }
    seen
}
