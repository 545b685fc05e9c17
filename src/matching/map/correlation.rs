//! How alike two maps are at a pose.

use crate::{
    geometry::{Point, Pose},
    grid::{Grid, occupancy},
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
}
