//! Smoothing a grid in place: what matches only nearly still correlates.

use crate::grid::Grid;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::Pose, grid::Shape};

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
