//! The best pose in a window, found by branch and bound: Olson, ICRA 2009; Hess et al., ICRA 2016.
//!
//! Exactly the pose with the highest sum of bytes that trying every cell and angle would find, whatever the
//! guess. A pyramid of maxima bounds whole blocks of poses at once, and blocks that cannot win are left out.

pub mod pyramid;
pub(crate) mod rotated;

use super::{DegenerateDirection, Match, MatchError};
use crate::{
    config::ConfigError,
    geometry::{Point, Pose},
    linalg::{Covariance, Sym3},
    math,
    scan::points::ScanPoint,
    sensor_model::likelihood_field::Field,
};
use pyramid::Pyramid;
use rotated::Rotated;
pub use rotated::sum_four;

/// Where to look, and what counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrelativeConfig {
    /// Half the window's side (m), rounded up to whole blocks of the pyramid's top. Default 0.25.
    pub position_range: f32,
    /// Half the window's angle (rad). Default 0.2094: 12°.
    pub heading_range: f32,
    /// From one heading to the next (rad); 0: as far as the farthest point moves by a cell. Default 0.
    pub heading_step: f32,
    /// Least score, 0…1: a share of the peak above unexplored. Default 0.3.
    pub min_score: f32,
    /// Two poses this much alike in score, this far apart, are ambiguous (0…1; above 1: not looked for). Default 2.
    pub max_ambiguity: f32,
    /// Nearer modes are the same pose (m). Default 0.5.
    pub min_separation: f32,
    /// Each beam's log-likelihood counts so much in the covariance: neighbours err alike. Default 0.1.
    pub temper: f32,
}

impl CorrelativeConfig {
    /// Around a good guess, such as wheel odometry.
    pub const DEFAULT: Self = Self {
        position_range: 0.25,
        heading_range: 0.2094,
        heading_step: 0.0,
        min_score: 0.3,
        max_ambiguity: 2.0,
        min_separation: 0.5,
        temper: 0.1,
    };
}

impl Default for CorrelativeConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Working memory for scans of at most N beams: 8·N bytes and 1.5 KB for the blocks.
#[derive(Debug, Clone)]
pub struct Correlator<const N: usize> {
    rotated: Rotated<N>,
    blocks: heapless::Vec<Block, BLOCKS>,
    /// Sums looked up so far, for measuring.
    lookups: u64,
}

/// Blocks on a side of the window at the pyramid's top.
const SIDE: i32 = 12;
const BLOCKS: usize = (SIDE * SIDE) as usize;

/// Poses `x..x + stride`, `y..y + stride` of one heading, and a bound that none of their scores exceeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Block {
    bound: u32,
    x: i16,
    y: i16,
}

/// A cell of the window and its sum of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Candidate {
    /// Sum of bytes.
    pub sum: u32,
    /// Columns from the window's first.
    pub x: i16,
    /// Rows from the window's first.
    pub y: i16,
    /// Headings from the window's first.
    pub heading: i16,
}

/// The window as whole cells and headings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    guess: Pose,
    /// Cells on a side, a multiple of the pyramid's top stride.
    pub side: i16,
    /// Cells from the window's first to the guess.
    centre: i16,
    /// Headings.
    pub headings: i16,
    step: f32,
    resolution: f32,
    axes: f32,
}

impl Window {
    /// The window around `guess`.
    ///
    /// # Errors
    /// [`MatchError::BadGuess`] if the guess is not finite, [`MatchError::BadConfig`] if the window has more blocks or
    /// headings than fit.
    pub fn new(
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        guess: Pose,
        config: &CorrelativeConfig,
    ) -> Result<Self, MatchError> {
        if !guess.is_finite() {
            return Err(MatchError::BadGuess);
        }
        let shape = pyramid.field().shape();
        let resolution = shape.resolution();
        let farthest = points.iter().map(|point| point.range).max().unwrap_or(1);
        let cell_turn = resolution / math::max(f32::from(farthest) * 1e-3, resolution);
        let step = if config.heading_step > 0.0 {
            config.heading_step
        } else {
            cell_turn
        };
        // Rounded up, so that the window is never smaller than asked for.
        let half_headings = math::round_to_i32(config.heading_range / step + 0.499);
        let half_cells = math::round_to_i32(config.position_range / resolution + 0.499);
        let top = i32::from(pyramid.top_stride());
        let out_of_range = |setting, value, max| {
            MatchError::BadConfig(ConfigError::OutOfRange {
                setting,
                value,
                min: 0.0,
                max,
            })
        };
        if !(config.heading_range >= 0.0 && half_headings < 5000) {
            let max = 4999.0 * step;
            return Err(out_of_range("heading_range", config.heading_range, max));
        }
        let blocks = half_cells.saturating_mul(2).saturating_add(top) / top.max(1);
        if !(config.position_range >= 0.0 && blocks <= SIDE) {
            let max = (top * SIDE / 2 - 1) as f32 * resolution;
            return Err(out_of_range("position_range", config.position_range, max));
        }
        Ok(Self {
            guess,
            side: (blocks * top) as i16,
            centre: ((blocks * top) / 2) as i16,
            headings: (2 * half_headings + 1) as i16,
            step,
            resolution,
            axes: shape.origin().theta,
        })
    }

    /// Where the lidar is with a heading and in the window's first cell: what blocks count from.
    fn corner(&self, heading: i16) -> Pose {
        self.pose(0, 0, heading)
    }

    /// The pose that a cell and heading of the window stand for.
    #[must_use]
    pub fn pose(&self, x: i16, y: i16, heading: i16) -> Pose {
        let cells = |place: i16| f32::from(place - self.centre) * self.resolution;
        let axes = Pose {
            x: 0.0,
            y: 0.0,
            theta: self.axes,
        };
        let shift = axes * Point::new(cells(x), cells(y));
        let turn = f32::from(heading - self.headings / 2) * self.step;
        Pose::new(
            self.guess.x + shift.x,
            self.guess.y + shift.y,
            self.guess.theta + turn,
        )
    }

    /// Headings from the guess's outwards: the likelier, the sooner a good score prunes the rest.
    fn outwards(&self) -> impl Iterator<Item = i16> {
        let middle = self.headings / 2;
        (0..=middle).flat_map(move |k| {
            [middle - k, middle + k]
                .into_iter()
                .take(if k == 0 { 1 } else { 2 })
        })
    }
}

impl<const N: usize> Correlator<N> {
    /// Empty working memory.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            rotated: Rotated::new(),
            blocks: heapless::Vec::new(),
            lookups: 0,
        }
    }

    /// Bytes looked up so far, for measuring.
    #[must_use]
    pub fn lookups(&self) -> u64 {
        self.lookups
    }

    /// The best pose in the window around `guess`, to a cell and a step of the heading.
    ///
    /// At most N points are used, evenly spread. The covariance is that of the scores around the best pose.
    pub fn align(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        guess: Pose,
        config: &CorrelativeConfig,
    ) -> Result<Match, MatchError> {
        let used = used(points.len(), N);
        if used < 10 {
            return Err(MatchError::TooFewBeams {
                found: used as u16,
                needed: 10,
            });
        }
        let window = Window::new(pyramid, points, guess, config)?;
        let scale = pyramid.field().scale();
        let floor = u32::from(scale.unexplored) * used as u32;
        let height = (255.0 - f32::from(scale.unexplored)) * used as f32;
        let least =
            floor + math::round_to_i32(math::max(config.min_score, 0.0) * height).unsigned_abs();
        let share = |sum: u32| (sum as f32 - floor as f32) / height;
        let Some(best) = self.search(pyramid, points, &window, least.saturating_sub(1), None)
        else {
            return Err(MatchError::NothingFound {
                min_score: config.min_score,
            });
        };
        if config.max_ambiguity <= 1.0 {
            let limit = floor as f32 + config.max_ambiguity * (best.sum as f32 - floor as f32);
            let cells = math::round_to_i32(config.min_separation / window.resolution) as i16;
            let turns = math::round_to_i32(0.35 / window.step) as i16;
            let near = Near { best, cells, turns };
            if let Some(other) = self.search(pyramid, points, &window, limit as u32, Some(near)) {
                return Err(MatchError::Ambiguous {
                    ratio: share(other.sum) / math::max(share(best.sum), 1e-6),
                });
            }
        }
        let covariance = self.spread(pyramid, points, &window, best, config);
        let information = covariance.information().ok_or(MatchError::Degenerate)?;
        let ranges: u32 = points.iter().map(|point| u32::from(point.range)).sum();
        let lever = math::max(ranges as f32 * 1e-3 / points.len() as f32, 0.1);
        let [_, _, (largest, direction)] = covariance.0.theta_scaled(lever).eigen();
        // Even scores over five cells have a σ of 1.41 cells: nothing holds the pose there.
        let flat = 1.2 * window.resolution;
        Ok(Match {
            pose: window.pose(best.x, best.y, best.heading),
            covariance,
            information,
            inliers: math::round_to_i32(share(best.sum) * used as f32).clamp(0, 65_535) as u16,
            overlap: used as u16,
            beams: points.len() as u16,
            residual: scale.sigma
                * math::sqrt(math::max(
                    2.0 * scale.step * (255.0 - best.sum as f32 / used as f32),
                    0.0,
                )),
            score: share(best.sum),
            degenerate_direction: (largest > flat * flat).then(|| DegenerateDirection {
                direction,
                lever,
                sigma: math::sqrt(largest),
            }),
            iterations: 0,
            starts: None,
        })
    }

    /// The window's best cell whose sum is above `least`, and outside of what is `near` to another.
    pub fn search(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        window: &Window,
        least: u32,
        near: Option<Near>,
    ) -> Option<Candidate> {
        let mut best = None;
        let mut bar = least;
        let top = pyramid.top_level();
        let stride = pyramid.stride(top);
        let blocks = window.side >> (2 * top);
        for heading in window.outwards() {
            if !self
                .rotated
                .assign(pyramid, points, window.corner(heading), window.side)
            {
                continue;
            }
            self.blocks.clear();
            for y in 0..blocks {
                let mut x = 0;
                while x < blocks {
                    let bounds = self.rotated.row(pyramid, top, x, y);
                    self.lookups += 4 * self.rotated.len() as u64;
                    for (bound, x) in bounds.into_iter().zip(x..blocks) {
                        if bound > bar {
                            let block = Block {
                                bound,
                                x: x * stride as i16,
                                y: y * stride as i16,
                            };
                            let _ = self.blocks.push(block);
                        }
                    }
                    x += 4;
                }
            }
            // Best bound first; few are ever looked into, so that picking each anew beats sorting.
            while let Some(block) = take_best(&mut self.blocks, bar) {
                self.split(pyramid, top, block, heading, near, &mut bar, &mut best);
            }
        }
        best
    }

    /// Looks into a block level by level; raises `bar` and `best` where a cell is better.
    #[allow(clippy::too_many_arguments)]
    fn split(
        &mut self,
        pyramid: &Pyramid<'_>,
        level: usize,
        block: Block,
        heading: i16,
        near: Option<Near>,
        bar: &mut u32,
        best: &mut Option<Candidate>,
    ) {
        let Some(below) = level.checked_sub(1) else {
            let found = Candidate {
                sum: block.bound,
                x: block.x,
                y: block.y,
                heading,
            };
            if block.bound > *bar && !near.is_some_and(|near| near.holds(&found)) {
                *bar = block.bound;
                *best = Some(found);
            }
            return;
        };
        let stride = pyramid.stride(below) as i16;
        let mut parts = [Block {
            bound: 0,
            x: 0,
            y: 0,
        }; 16];
        for (row, parts) in (0i16..).zip(parts.chunks_exact_mut(4)) {
            let y = block.y + row * stride;
            let sums = self
                .rotated
                .row(pyramid, below, block.x >> (2 * below), y >> (2 * below));
            self.lookups += 4 * self.rotated.len() as u64;
            for ((part, bound), column) in parts.iter_mut().zip(sums).zip(0i16..) {
                *part = Block {
                    bound,
                    x: block.x + column * stride,
                    y,
                };
            }
        }
        while let Some(part) = take_best(&mut parts, *bar) {
            self.split(pyramid, below, part, heading, near, bar, best);
        }
    }

    /// Covariance of the poses around the best one, weighted by their tempered likelihoods (Olson 2009, 3.3).
    fn spread(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        window: &Window,
        best: Candidate,
        config: &CorrelativeConfig,
    ) -> Covariance {
        let nats = pyramid.field().scale().step * config.temper;
        let (mut sum, mut mean) = (0.0f32, [0.0f32; 3]);
        let mut square = [0.0f32; 6];
        for turn in -2i16..=2 {
            // A window of its own around the best cell, so that the edge of the search does not cut it.
            let around = window.pose(best.x - 2, best.y - 2, best.heading + turn);
            if !self.rotated.assign(pyramid, points, around, 8) {
                continue;
            }
            for row in 0i16..5 {
                let first = self.rotated.row(pyramid, 0, 0, row);
                let rest = self.rotated.row(pyramid, 0, 4, row);
                for (column, total) in (0i16..5).zip(first.into_iter().chain(rest)) {
                    let lost = (total as f32 - best.sum as f32) * nats;
                    let weight = math::weight_exp(math::min(lost, 0.0));
                    let at = [
                        f32::from(column - 2) * window.resolution,
                        f32::from(row - 2) * window.resolution,
                        f32::from(turn) * window.step,
                    ];
                    sum += weight;
                    for k in 0..3 {
                        mean[k] += weight * at[k];
                    }
                    for (total, (a, b)) in
                        square
                            .iter_mut()
                            .zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
                    {
                        *total += weight * at[a] * at[b];
                    }
                }
            }
        }
        let sum = math::max(sum, 1e-6);
        let [x, y, t] = mean.map(|m| m / sum);
        let [xx, xy, xt, yy, yt, tt] = square.map(|s| s / sum);
        // Cells and steps are even in themselves: a twelfth of their square is always left.
        let cell = window.resolution * window.resolution / 12.0;
        Covariance(Sym3 {
            xx: xx - x * x + cell,
            xy: xy - x * y,
            xt: xt - x * t,
            yy: yy - y * y + cell,
            yt: yt - y * t,
            tt: tt - t * t + window.step * window.step / 12.0,
        })
        .rotated(Pose {
            x: 0.0,
            y: 0.0,
            theta: window.axes,
        })
    }
}

impl<const N: usize> Default for Correlator<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// The first of the blocks with the highest bound above `bar`; it is not given again.
fn take_best(blocks: &mut [Block], bar: u32) -> Option<Block> {
    let mut best: Option<&mut Block> = None;
    for block in blocks {
        if block.bound > best.as_ref().map_or(bar, |best| best.bound) {
            best = Some(block);
        }
    }
    let best = best?;
    let block = *best;
    best.bound = 0;
    Some(block)
}

/// What lies around a pose already found.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    best: Candidate,
    cells: i16,
    turns: i16,
}

impl Near {
    fn holds(&self, other: &Candidate) -> bool {
        (other.x - self.best.x).abs() <= self.cells
            && (other.y - self.best.y).abs() <= self.cells
            && (other.heading - self.best.heading).abs() <= self.turns
    }
}

/// Points used of `len`, and every how-many-th that is.
pub(crate) fn used(len: usize, room: usize) -> usize {
    len.div_ceil(stride(len, room))
}

/// Every how-many-th point is used so that they fit.
pub(crate) fn stride(len: usize, room: usize) -> usize {
    len.div_ceil(room.max(1)).max(1)
}
