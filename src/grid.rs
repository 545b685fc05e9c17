//! Maps of square cells over any storage: an array in RAM, a table in flash, a `Vec` on the host.

#[cfg(not(feature = "internals"))]
pub(crate) mod cast;
#[cfg(feature = "internals")]
pub mod cast;
pub mod distance;
pub mod occupancy;

use core::fmt;

use crate::geometry::{Point, Pose};

/// Size, resolution and place of a grid.
///
/// Cell (0, 0) has its lower left corner at the origin; x counts columns, y counts rows, row by row in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Shape {
    width: u16,
    height: u16,
    resolution: f32,
    origin: Pose,
}

/// Why there is no grid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GridError {
    /// Sides must be 1 to [`Shape::MAX_SIDE`] cells.
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Cells must be 5 mm to 2 m wide.
    Resolution {
        /// Width of a cell (m).
        metres: f32,
    },
    /// The origin is not finite.
    Origin,
    /// A buffer has another length than the cells need.
    Storage {
        /// Bytes or entries needed.
        needed: usize,
        /// Passed.
        passed: usize,
    },
    /// Bytes that should hold a grid begin otherwise, or with numbers that cannot be.
    Format,
    /// The grid is wider than the fixed-point coordinates reach.
    Extent {
        /// Longest side (m).
        metres: f32,
        /// Longest possible at this resolution (m).
        limit: f32,
    },
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Size { width, height } => write!(
                f,
                "a grid of {width} x {height} cells: each side must be 1 to {}",
                Shape::MAX_SIDE
            ),
            Self::Resolution { metres } => {
                write!(f, "cells of {metres} m: 0.005 to 2 m are possible")
            }
            Self::Origin => f.write_str("the grid's origin is not finite"),
            Self::Format => f.write_str("the bytes do not begin as a grid's do"),
            Self::Storage { needed, passed } => {
                write!(f, "the cells need {needed} entries, {passed} were passed")
            }
            Self::Extent { metres, limit } => {
                write!(
                    f,
                    "the grid is {metres} m long, at most {limit} m are possible"
                )
            }
        }
    }
}

impl core::error::Error for GridError {}

impl Shape {
    /// Most cells a side.
    pub const MAX_SIDE: u32 = 16_383;

    /// `width` by `height` cells of `resolution` metres; `origin` is the pose of the lower left corner in the map.
    pub fn new(width: u32, height: u32, resolution: f32, origin: Pose) -> Result<Self, GridError> {
        let sides = 1..=Self::MAX_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(GridError::Size { width, height });
        }
        if !(0.005..=2.0).contains(&resolution) {
            return Err(GridError::Resolution { metres: resolution });
        }
        if !origin.is_finite() {
            return Err(GridError::Origin);
        }
        Ok(Self {
            width: width as u16,
            height: height as u16,
            resolution,
            origin: Pose::new(origin.x, origin.y, origin.theta),
        })
    }

    /// Columns.
    #[must_use]
    pub const fn width(&self) -> u16 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub const fn height(&self) -> u16 {
        self.height
    }

    /// Number of cells, below 2²⁸.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Never: a shape has at least one cell.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// Width of a cell (m).
    #[must_use]
    pub const fn resolution(&self) -> f32 {
        self.resolution
    }

    /// Pose of the lower left corner in the map.
    #[must_use]
    pub const fn origin(&self) -> Pose {
        self.origin
    }

    /// Place of a cell in memory; `None` off the grid.
    #[must_use]
    pub const fn index(&self, x: i32, y: i32) -> Option<usize> {
        if x < 0 || y < 0 || x >= self.width as i32 || y >= self.height as i32 {
            return None;
        }
        Some(y as usize * self.width as usize + x as usize)
    }

    /// Where a point of the map lies on the grid, in cells: (0.5, 0.5) is the middle of the first cell.
    #[must_use]
    pub(crate) fn cells_at(&self, point_in_map: Point) -> Point {
        let point = self.origin.inverse() * point_in_map;
        Point::new(point.x / self.resolution, point.y / self.resolution)
    }

    /// The cell that a point of the map lies in, on the grid or off it.
    #[must_use]
    pub fn cell_of(&self, point_in_map: Point) -> (i32, i32) {
        let cells = self.cells_at(point_in_map);
        (floor(cells.x), floor(cells.y))
    }

    /// Middle of a cell in the map.
    #[must_use]
    pub fn middle_of(&self, x: i32, y: i32) -> Point {
        let half = |cell: i32| (cell as f32 + 0.5) * self.resolution;
        self.origin * Point::new(half(x), half(y))
    }
}

/// Largest whole number not above `x`; saturates, 0 for NaN.
fn floor(x: f32) -> i32 {
    let cut = x as i32;
    if (cut as f32) > x {
        cut.saturating_sub(1)
    } else {
        cut
    }
}

/// Cells of one byte each.
#[derive(Debug, Clone, Copy)]
pub struct Grid<S> {
    shape: Shape,
    cells: S,
}

impl<S: AsRef<[u8]>> Grid<S> {
    /// A grid over `cells`, one byte each, lower row first; their number must be the shape's.
    pub fn new(shape: Shape, cells: S) -> Result<Self, GridError> {
        let (needed, passed) = (shape.len(), cells.as_ref().len());
        if needed != passed {
            return Err(GridError::Storage { needed, passed });
        }
        Ok(Self { shape, cells })
    }

    /// Size, resolution and place.
    #[must_use]
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// All cells, row by row.
    #[must_use]
    pub fn cells(&self) -> &[u8] {
        self.cells.as_ref()
    }

    /// The cell in column `x` and row `y`; `None` off the grid.
    #[must_use]
    pub fn get(&self, x: i32, y: i32) -> Option<u8> {
        self.cells().get(self.shape.index(x, y)?).copied()
    }

    /// The same cells, borrowed.
    #[must_use]
    pub fn as_slice(&self) -> Grid<&[u8]> {
        Grid {
            shape: self.shape,
            cells: self.cells(),
        }
    }

    /// The storage.
    #[must_use]
    pub(crate) fn into_cells(self) -> S {
        self.cells
    }
}

impl<S: AsRef<[u8]> + AsMut<[u8]>> Grid<S> {
    /// All cells, row by row.
    pub fn cells_mut(&mut self) -> &mut [u8] {
        self.cells.as_mut()
    }

    /// The cell in column `x` and row `y`; `None` off the grid.
    pub fn get_mut(&mut self, x: i32, y: i32) -> Option<&mut u8> {
        let index = self.shape.index(x, y)?;
        self.cells.as_mut().get_mut(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_shapes_are_refused() {
        let at = Pose::IDENTITY;
        for (width, height) in [(0, 1), (1, 0), (16_384, 1), (1, u32::MAX)] {
            let refused = Shape::new(width, height, 0.05, at);
            assert_eq!(refused, Err(GridError::Size { width, height }));
        }
        for metres in [0.0, -0.05, 3.0] {
            let refused = Shape::new(2, 2, metres, at);
            assert_eq!(refused, Err(GridError::Resolution { metres }));
        }
        assert!(Shape::new(2, 2, f32::NAN, at).is_err());
        let nowhere = Pose { x: f32::NAN, ..at };
        assert_eq!(Shape::new(2, 2, 0.05, nowhere), Err(GridError::Origin));
        let shape = Shape::new(2, 2, 0.05, at).expect("good");
        assert!(matches!(
            Grid::new(shape, [0u8; 5]),
            Err(GridError::Storage {
                needed: 4,
                passed: 5
            })
        ));
    }

    #[test]
    fn a_turned_grid_finds_its_cells() {
        let origin = Pose::new(1.0, 2.0, core::f32::consts::FRAC_PI_2);
        let shape = Shape::new(4, 3, 0.5, origin).expect("good");
        // Columns run up, rows to the left.
        for (cell, middle) in [
            ((0, 0), (0.75, 2.25)),
            ((3, 0), (0.75, 3.75)),
            ((0, 2), (-0.25, 2.25)),
        ] {
            let point = shape.middle_of(cell.0, cell.1);
            assert!(
                (point.x - middle.0).abs() < 1e-6 && (point.y - middle.1).abs() < 1e-6,
                "{cell:?}: {point:?}"
            );
            assert_eq!(shape.cell_of(point), cell);
        }
        assert_eq!(shape.index(3, 2), Some(11));
        for off in [(-1, 0), (0, -1), (4, 0), (0, 3)] {
            assert_eq!(shape.index(off.0, off.1), None);
        }
    }
}
