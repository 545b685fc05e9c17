//! Likelihood that a beam ends in each cell of a map, one byte a cell.
//!
//! `z_hit · N(d; 0, σ²) + z_rand / z_max`, with `d` the distance to the nearest surface: Thrun, Burgard, Fox,
//! *Probabilistic Robotics*, table 6.3. A byte holds the logarithm: 255 a beam that ends on a surface, 1 one
//! that ends far from all. An unexplored cell, and every place off the map, is worth `1 / z_max`; the byte
//! that stands for this ([`Scale::unexplored`]) is reserved, so unexplored cells need no test in a sum.

#[cfg(not(feature = "internals"))]
pub(crate) mod access;
#[cfg(feature = "internals")]
pub mod access;
#[cfg(not(feature = "internals"))]
pub(crate) mod draw;
#[cfg(feature = "internals")]
pub mod draw;
#[cfg(not(feature = "internals"))]
pub(crate) mod model;
#[cfg(feature = "internals")]
pub mod model;
#[cfg(not(feature = "internals"))]
pub(crate) mod placement;
#[cfg(feature = "internals")]
pub mod placement;
pub mod stored;
#[cfg(not(feature = "internals"))]
pub(crate) mod tiles;
#[cfg(feature = "internals")]
pub mod tiles;

use crate::{
    grid::{Grid, GridError, Shape, occupancy},
    math,
    scan::ScanPoint,
};
pub use access::{Field, Score};
#[cfg(feature = "internals")]
pub use access::{Hessian, Stencil};
#[cfg(not(feature = "internals"))]
pub(crate) use access::{Hessian, Stencil};
pub use model::{FieldModel, Profile, Scale};
use placement::Placement;

/// A field that is one table.
#[derive(Debug, Clone, Copy)]
pub struct LikelihoodField<S> {
    grid: Grid<S>,
    scale: Scale,
}

impl<S: AsRef<[u8]>> LikelihoodField<S> {
    /// A field over finished bytes, such as a table in flash.
    ///
    /// Fails where the fixed-point coordinates cannot reach all of it and 32 m around it.
    pub fn new(grid: Grid<S>, scale: Scale) -> Result<Self, GridError> {
        Placement::check(grid.shape())?;
        Ok(Self { grid, scale })
    }

    /// The cells.
    #[must_use]
    pub fn grid(&self) -> &Grid<S> {
        &self.grid
    }

    /// The same field, borrowed: what the matchers take.
    #[must_use]
    pub fn as_slice(&self) -> LikelihoodField<&[u8]> {
        LikelihoodField {
            grid: self.grid.as_slice(),
            scale: self.scale,
        }
    }

    /// The storage.
    #[must_use]
    pub(crate) fn into_cells(self) -> S {
        self.grid.into_cells()
    }
}

impl<S: AsRef<[u8]> + AsMut<[u8]>> LikelihoodField<S> {
    /// A field with nothing explored, for `draw`.
    pub fn unexplored(shape: Shape, cells: S, scale: Scale) -> Result<Self, GridError> {
        let mut grid = Grid::new(shape, cells)?;
        grid.cells_mut().fill(scale.unexplored);
        Self::new(grid, scale)
    }

    /// The field of an occupancy map: [`occupancy`] bytes in, `squares` from [`crate::grid::distance::squared`].
    ///
    /// Unknown cells stay unexplored unless they are near enough to an occupied one for a hit to end there.
    pub fn from_map(
        map: &Grid<&[u8]>,
        squares: &[u16],
        profile: &Profile,
        cells: S,
    ) -> Result<Self, GridError> {
        let (needed, passed) = (map.cells().len(), squares.len());
        if needed != passed {
            return Err(GridError::Storage { needed, passed });
        }
        let mut field = Self::unexplored(*map.shape(), cells, *profile.scale())?;
        let unexplored = field.scale.unexplored;
        let cell_mm2 = map.shape().resolution() * map.shape().resolution() * 1e6;
        for ((&square, &occupancy), byte) in
            squares.iter().zip(map.cells()).zip(field.grid.cells_mut())
        {
            let square_mm2 = math::min(f32::from(square) * cell_mm2, 4e9) as u32;
            let value = profile.byte(square_mm2);
            let known = occupancy::cell(occupancy) != occupancy::Cell::Unknown;
            *byte = if known || value > unexplored {
                value
            } else {
                unexplored
            };
        }
        Ok(field)
    }
}

impl<S: AsRef<[u8]> + AsMut<[u8]>> draw::Canvas for LikelihoodField<S> {
    fn shape(&self) -> &Shape {
        self.grid.shape()
    }

    fn raise(&mut self, x: i32, y: i32, byte: u8) {
        if let Some(cell) = self.grid.get_mut(x, y).filter(|cell| **cell < byte) {
            *cell = byte;
        }
    }
}

impl Field for LikelihoodField<&[u8]> {
    fn shape(&self) -> &Shape {
        self.grid.shape()
    }

    fn scale(&self) -> &Scale {
        &self.scale
    }

    #[inline]
    fn byte(&self, x: u32, y: u32) -> u8 {
        let width = u32::from(self.grid.shape().width());
        // Rows below 2¹⁷ and columns below 2¹⁴ (see `Placement`): the product cannot wrap.
        let index = y.wrapping_mul(width).wrapping_add(x) as usize;
        if x >= width {
            return self.scale.unexplored;
        }
        match self.grid.cells().get(index) {
            Some(&byte) => byte,
            None => self.scale.unexplored,
        }
    }

    fn sum(&self, points: &[ScanPoint], placement: &Placement) -> u32 {
        let (cells, width) = (self.grid.cells(), self.grid.shape().width());
        let (sum, missed) = if placement.shift == Placement::COARSE {
            table_sum::<{ Placement::COARSE }>(cells, width, points, placement)
        } else {
            table_sum::<{ Placement::FINE }>(cells, width, points, placement)
        };
        sum.wrapping_add(missed * u32::from(self.scale.unexplored))
    }

    #[inline]
    fn stencil(&self, x: u32, y: u32) -> Option<Stencil> {
        // No table is narrower than this that has a cell inside its edge: said so that `width - 1` needs no check.
        let width = usize::from(self.grid.shape().width()).max(2);
        if x.wrapping_sub(1) >= (width as u32).wrapping_sub(2) {
            return None;
        }
        let index = (y as usize).wrapping_mul(width).wrapping_add(x as usize);
        let rows = self.grid.cells().get(index.wrapping_sub(width)..)?;
        // From the cell below to the corner: this says it for all six.
        if rows.len() < 2 * width + 2 {
            return None;
        }
        let (lower, rows) = rows.split_at_checked(width - 1)?;
        let (row, upper) = rows.split_at_checked(width + 1)?;
        let (&[below, ..], &[left, here, right, ..], &[above, corner, ..]) = (lower, row, upper)
        else {
            return None;
        };
        Some(Stencil {
            here: i32::from(here),
            left: i32::from(left),
            right: i32::from(right),
            below: i32::from(below),
            above: i32::from(above),
            corner: i32::from(corner),
        })
    }
}

/// Sum of the bytes in which points end, and how many end off the table.
#[inline(never)]
fn table_sum<const SHIFT: u32>(
    cells: &[u8],
    width: u16,
    points: &[ScanPoint],
    placement: &Placement,
) -> (u32, u32) {
    let (placement, width) = (*placement, u32::from(width));
    let (mut sum, mut missed) = (0u32, 0u32);
    let mut add = |point: &ScanPoint| {
        let (x, y) = placement.place(point);
        let column = x >> SHIFT;
        // Rows and columns below 2¹⁵: the product cannot wrap, and a row off the table is off it.
        let cell = (y >> SHIFT).wrapping_mul(width).wrapping_add(column);
        match cells.get(cell as usize) {
            Some(&byte) if column < width => sum = sum.wrapping_add(u32::from(byte)),
            _ => missed += 1,
        }
    };
    let fours = points.chunks_exact(4);
    fours.remainder().iter().for_each(&mut add);
    for four in fours {
        four.iter().for_each(&mut add);
    }
    (sum, missed)
}
