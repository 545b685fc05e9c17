//! Map to map: the correlation of two occupancy grids, Thrun, Burgard, Fox, *Probabilistic Robotics*, section 6.5.
//!
//! Unlike a likelihood field, it holds it against a pose when free space lies on walls: a check for closed loops.

use super::{
    DegenerateDirection, MatchError, degeneracy,
    window_covariance::{AS_GOOD, REACH, WindowCovariance},
};
use crate::{
    config,
    geometry::{Point, Pose},
    grid::{Grid, occupancy},
    linalg::Covariance,
    math,
};

/// How alike two maps are where both know something.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Correlation {
    /// Cells that both know.
    pub cells: u32,
    /// The book's, about the common mean of both maps: −1…1. Take no less than 0 for a likelihood.
    pub common: f32,
    /// Pearson's, about each map's own mean: −1…1.
    pub ordinary: f32,
}

/// Compares `local`, placed at `map_from_local`, with `map`: [`occupancy`] bytes, unknown cells count as nothing.
///
/// A value is 0 where it is not defined: no overlap, or an even map.
#[must_use]
pub fn correlate(map: &Grid<&[u8]>, local: &Grid<&[u8]>, map_from_local: Pose) -> Correlation {
    let mut sums = Sums::default();
    let (shape, width) = (*map.shape(), usize::from(local.shape().width()));
    let map_from_grid = map_from_local * local.shape().origin();
    let grid_from_grid = shape.origin().between(map_from_grid);
    if !grid_from_grid.is_finite() {
        return Correlation::default();
    }
    // Cells of the map per cell of `local`, Q16: a row of 16 383 cells drifts by a quarter of a cell at most.
    let ratio = local.shape().resolution() / shape.resolution();
    let (sin, cos) = math::sin_cos(grid_from_grid.theta);
    let step = |part: f32| math::round_to_i32(part * ratio * 65_536.0);
    let (across, along) = (step(cos), step(sin));
    let turn = Pose {
        x: 0.0,
        y: 0.0,
        ..grid_from_grid
    };
    for (row, cells) in local.cells().chunks_exact(width.max(1)).enumerate() {
        let half = 0.5 * local.shape().resolution();
        let first = turn * Point::new(half, half + row as f32 * local.shape().resolution());
        let place = |metres: f32| {
            let cell = metres / shape.resolution();
            (-16_000.0..32_000.0)
                .contains(&cell)
                .then(|| math::round_to_i32(cell * 65_536.0))
        };
        let (Some(mut x), Some(mut y)) = (
            place(grid_from_grid.x + first.x),
            place(grid_from_grid.y + first.y),
        ) else {
            continue;
        };
        for &l in cells {
            if l != occupancy::UNKNOWN {
                match map.get(x >> 16, y >> 16) {
                    Some(m) if m != occupancy::UNKNOWN => sums.add(i64::from(m), i64::from(l)),
                    _ => {}
                }
            }
            x = x.saturating_add(across);
            y = y.saturating_add(along);
        }
    }
    sums.correlation()
}

#[derive(Default)]
struct Sums {
    n: i64,
    m: i64,
    l: i64,
    mm: i64,
    ll: i64,
    ml: i64,
}

impl Sums {
    fn add(&mut self, m: i64, l: i64) {
        self.n += 1;
        self.m += m;
        self.l += l;
        self.mm += m * m;
        self.ll += l * l;
        self.ml += m * l;
    }

    fn correlation(&self) -> Correlation {
        let Self {
            n,
            m,
            l,
            mm,
            ll,
            ml,
        } = *self;
        // The sums are exact; only the few operations from here on round.
        let [n, m, l, mm, ll, ml] = [n, m, l, mm, ll, ml].map(|sum| sum as f32);
        let quotient = |covariance: f32, a: f32, b: f32| {
            // An even map has no variance but rounding.
            if a > 0.5 && b > 0.5 {
                covariance / (math::sqrt(a) * math::sqrt(b))
            } else {
                0.0
            }
        };
        if n < 1.0 {
            return Correlation::default();
        }
        let about = |mean_m: f32, mean_l: f32| {
            quotient(
                ml - mean_l * m - mean_m * l + n * mean_m * mean_l,
                mm - 2.0 * mean_m * m + n * mean_m * mean_m,
                ll - 2.0 * mean_l * l + n * mean_l * mean_l,
            )
        };
        let common = 0.5 * (m + l) / n;
        Correlation {
            cells: self.n as u32,
            common: about(common, common),
            ordinary: about(m / n, l / n),
        }
    }
}

/// A binomial kernel, a small Gaussian in integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// 1 2 1: σ 0.71 cells.
    Three,
    /// 1 4 6 4 1: σ 1 cell.
    Five,
}

/// Smooths a grid in place, rows and then columns: what matches only nearly still correlates.
///
/// Cells beyond the edge count as those at the edge. Unknown cells take part as even odds.
pub fn smooth<S: AsRef<[u8]> + AsMut<[u8]>>(grid: &mut Grid<S>, kernel: Kernel) {
    let (width, height) = (
        usize::from(grid.shape().width()),
        usize::from(grid.shape().height()),
    );
    for y in 0..height {
        smooth_line(grid.cells_mut(), y * width, 1, width, kernel);
    }
    for x in 0..width {
        smooth_line(grid.cells_mut(), x, width, height, kernel);
    }
}

/// Cells `start`, `start + step`, …: the two before the current one are kept as they were.
fn smooth_line(cells: &mut [u8], start: usize, step: usize, count: usize, kernel: Kernel) {
    let at = |cells: &[u8], k: usize| {
        let k = if k < count { k } else { count - 1 };
        u32::from(cells.get(start + k * step).copied().unwrap_or(0))
    };
    let (mut before, mut last) = (at(cells, 0), at(cells, 0));
    for k in 0..count {
        let (here, next, after) = (at(cells, k), at(cells, k + 1), at(cells, k + 2));
        let value = match kernel {
            Kernel::Three => (last + 2 * here + next + 2) >> 2,
            Kernel::Five => (before + 4 * last + 6 * here + 4 * next + after + 8) >> 4,
        };
        if let Some(cell) = cells.get_mut(start + k * step) {
            *cell = value as u8;
        }
        before = last;
        last = here;
    }
}

/// Where to look, and what counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapConfig {
    /// Half the window's side (m), at most 20 cells of the map. Default 0.2.
    pub position_range: f32,
    /// Half the window's angle (rad), at most 20 steps. Default 0.07: 4°.
    pub heading_range: f32,
    /// From one heading to the next (rad). Default 0.0175: 1°.
    pub heading_step: f32,
    /// Least correlation about the common mean. Default 0.3.
    pub min_correlation: f32,
    /// Fewest cells that both maps must know. Default 200.
    pub min_cells: u32,
}

impl MapConfig {
    /// For local maps of a few metres.
    pub const DEFAULT: Self = Self {
        position_range: 0.2,
        heading_range: 0.07,
        heading_step: 0.0175,
        min_correlation: 0.3,
        min_cells: 200,
    };
}

impl Default for MapConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What a correlation lower by one costs a pose (nat): e-fold in a twentieth.
const NATS: f32 = 20.0;
/// Where one map lies in another, and how far that can be trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MapMatch {
    /// Pose of the local map in the other one.
    pub pose: Pose,
    /// How far off `pose` may be: position in the map's frame, heading (m², m·rad, rad²).
    pub covariance: Covariance,
    /// How alike the two maps are at `pose`.
    pub correlation: Correlation,
    /// The direction that the maps do not determine, if there is one.
    pub degenerate_direction: Option<DegenerateDirection>,
}

/// Pose of `local` in `map` with the highest correlation about the common mean, tried at every cell and heading of the
/// window and refined by a parabola along each axis.
///
/// Decide ([`occupancy::decide`]) and smooth both first. Costs [`correlate`] times the poses: 729 by default, and 132 more.
///
/// # Errors
/// [`MatchError::BadGuess`] for a guess that is not finite, [`MatchError::BadConfig`] for a window of more than 20 cells or
/// headings to a side, [`MatchError::Unlikely`] where the maps are not alike anywhere in it.
pub fn align(
    map: &Grid<&[u8]>,
    local: &Grid<&[u8]>,
    guess: Pose,
    config: &MapConfig,
) -> Result<MapMatch, MatchError> {
    if !guess.is_finite() {
        return Err(MatchError::BadGuess);
    }
    let resolution = map.shape().resolution();
    let reach = steps("position_range", config.position_range, resolution)?;
    let turns = steps("heading_range", config.heading_range, config.heading_step)?;
    let pose = |x: f32, y: f32, t: f32| {
        Pose::new(
            guess.x + x * resolution,
            guess.y + y * resolution,
            guess.theta + t * config.heading_step,
        )
    };
    let score = |x: i32, y: i32, t: i32| {
        let found = correlate(map, local, pose(x as f32, y as f32, t as f32));
        if found.cells >= config.min_cells {
            found.common
        } else {
            -1.0
        }
    };
    let mut best = (-1.0, 0, 0, 0);
    for t in -turns..=turns {
        for y in -reach..=reach {
            for x in -reach..=reach {
                let value = score(x, y, t);
                if value > best.0 {
                    best = (value, x, y, t);
                }
            }
        }
    }
    let (value, x, y, t) = best;
    if value < config.min_correlation {
        return Err(MatchError::Unlikely { score: value });
    }
    // The top of the parabola through the best value and its neighbours, within half a step.
    let off = |before: f32, after: f32| {
        let bend = before - 2.0 * value + after;
        let steps = if bend < -1e-6 {
            0.5 * (before - after) / bend
        } else {
            0.0
        };
        math::min(math::max(steps, -0.5), 0.5)
    };
    let top = pose(
        x as f32 + off(score(x - 1, y, t), score(x + 1, y, t)),
        y as f32 + off(score(x, y - 1, t), score(x, y + 1, t)),
        t as f32 + off(score(x, y, t - 1), score(x, y, t + 1)),
    );
    let mut spread = WindowCovariance::new(resolution, config.heading_step);
    for dt in -REACH..=REACH {
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let [sx, sy, st] = [dx, dy, dt].map(i32::from);
                let lost = score(x + sx, y + sy, t + st) - value;
                spread.add([dx, dy, dt], NATS * lost);
            }
        }
    }
    let mut covariance = spread.covariance(0.0);
    let lever = 0.5 * f32::from(local.shape().width()) * local.shape().resolution();
    let open = spread.open(&covariance, lever);
    let kept = open.and_then(|open| {
        let pose = open.keep(top, guess);
        let there = correlate(map, local, pose);
        let as_good = NATS * (there.common - value) >= AS_GOOD;
        (there.cells >= config.min_cells && as_good).then_some((open, pose, there))
    });
    if let Some((open, ..)) = kept {
        let information = covariance.information().ok_or(MatchError::Degenerate)?;
        (_, covariance) = degeneracy::uncertainty(&information.0, 1.0, Some(&open))?;
    }
    let (pose, correlation) = kept.map_or_else(
        || (top, correlate(map, local, top)),
        |(_, pose, there)| (pose, there),
    );
    Ok(MapMatch {
        pose,
        covariance,
        correlation,
        degenerate_direction: kept.map(|(open, ..)| open.told(&covariance)),
    })
}

/// Steps from the middle of the window to its edge.
fn steps(setting: &'static str, range: f32, step: f32) -> Result<i32, MatchError> {
    let max = 20.0 * step;
    config::within(setting, range, 0.0, max).map_err(MatchError::BadConfig)?;
    Ok(math::round_to_i32(range / step))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Shape;

    #[test]
    fn correlations_of_four_cells_by_hand() {
        let shape = Shape::new(4, 1, 0.1, Pose::IDENTITY).expect("good");
        let grid = |cells: &'static [u8]| Grid::new(shape, cells).expect("fits");
        // Means 50 and 50: deviations (-40, 40, -40, 40) and (-20, 20, -20, 20).
        let found = correlate(
            &grid(&[10, 90, 10, 90]),
            &grid(&[30, 70, 30, 70]),
            Pose::IDENTITY,
        );
        assert_eq!(found.cells, 4);
        assert!(
            (found.common - 1.0).abs() < 1e-5 && (found.ordinary - 1.0).abs() < 1e-5,
            "{found:?}"
        );
        // The same pattern 100 higher: Pearson does not see it, the common mean does.
        let found = correlate(
            &grid(&[10, 90, 10, 90]),
            &grid(&[110, 190, 110, 190]),
            Pose::IDENTITY,
        );
        assert!((found.ordinary - 1.0).abs() < 1e-5, "{found:?}");
        // About 100: (-90, -10) and (10, 90) twice: (-900 - 900) / √(8200·8200) = -0.2195.
        assert!((found.common + 0.2195).abs() < 1e-3, "{found:?}");
        let found = correlate(
            &grid(&[10, 90, 128, 90]),
            &grid(&[30, 128, 30, 70]),
            Pose::IDENTITY,
        );
        assert_eq!(found.cells, 2);
        let nothing = correlate(&grid(&[128; 4]), &grid(&[1, 2, 3, 4]), Pose::IDENTITY);
        assert_eq!(nothing, Correlation::default());
        let away = correlate(
            &grid(&[1, 2, 3, 4]),
            &grid(&[1, 2, 3, 4]),
            Pose::new(5.0, 0.0, 0.0),
        );
        assert_eq!(away.cells, 0);
        let even = correlate(&grid(&[9; 4]), &grid(&[1, 2, 3, 4]), Pose::IDENTITY);
        assert_eq!(even.ordinary, 0.0);
    }

    #[test]
    fn kernels_spread_one_cell_as_they_say() {
        let shape = Shape::new(7, 7, 0.1, Pose::IDENTITY).expect("good");
        for (kernel, row) in [
            (Kernel::Three, [0, 0, 16, 32, 16, 0, 0]),
            (Kernel::Five, [0, 6, 24, 36, 24, 6, 0]),
        ] {
            let mut cells = [0u8; 49];
            cells[24] = 255;
            // Rows first: 255 · (1, 2, 1)/4 across, then half of it stays in the row.
            let mut grid = Grid::new(shape, &mut cells[..]).expect("fits");
            smooth(&mut grid, kernel);
            for (x, expected) in row.into_iter().enumerate() {
                let got = i32::from(grid.get(x as i32, 3).expect("on the grid"));
                let expected = if kernel == Kernel::Three {
                    expected * 2
                } else {
                    expected
                };
                assert!(
                    (got - expected).abs() <= 4,
                    "{kernel:?} {x}: {got}, not {expected}"
                );
            }
            let sum: i32 = grid.cells().iter().map(|&b| i32::from(b)).sum();
            assert!((sum - 255).abs() <= 20, "{kernel:?}: {sum}");
        }
    }
}
