//! Maxima of a field over blocks of 4 and 16 cells: 7 % more memory, and bounds for whole blocks of poses.
//!
//! Entry `i` of the level with stride `s` is the maximum over cells `i·s ..= i·s + 2s − 2`. A point in cell `p`
//! moved by `D..D + s` cells stays in this range for `i = ⌊(p + D)/s⌋`, so one entry bounds it for the whole block.

use crate::{
    grid::{GridError, Shape},
    sensor_model::likelihood_field::{Field, LikelihoodField},
};

/// Strides of the levels: the field itself, then maxima.
const STRIDES: [usize; 3] = [1, 4, 16];

/// A field with its maxima.
#[derive(Debug, Clone, Copy)]
pub struct Pyramid<'a> {
    field: LikelihoodField<&'a [u8]>,
    levels: [Level<'a>; 3],
    top: usize,
}

/// One level's table. Column and row 0 stand for the block just before the field.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Level<'a> {
    pub cells: &'a [u8],
    pub width: i32,
    pub height: i32,
    /// Blocks before the field: 0 for the field itself, 1 for maxima.
    pub before: i32,
}

/// Entries that a level needs.
const fn entries(shape: &Shape, stride: usize) -> (usize, usize) {
    (
        (shape.width() as usize).div_ceil(stride) + 1,
        (shape.height() as usize).div_ceil(stride) + 1,
    )
}

impl<'a> Pyramid<'a> {
    /// Bytes that [`Pyramid::new`] needs beside a field of this shape.
    #[must_use]
    pub const fn bytes(shape: &Shape) -> usize {
        let ((w4, h4), (w16, h16)) = (entries(shape, 4), entries(shape, 16));
        w4 * h4 + w16 * h16
    }

    /// Fills `buffer` with the maxima.
    pub fn new(field: LikelihoodField<&'a [u8]>, buffer: &'a mut [u8]) -> Result<Self, GridError> {
        let shape = *field.grid().shape();
        let (needed, passed) = (Self::bytes(&shape), buffer.len());
        if passed < needed {
            return Err(GridError::Storage { needed, passed });
        }
        let (columns, rows) = entries(&shape, 4);
        let Some((low, rest)) = buffer.split_at_mut_checked(columns * rows) else {
            return Err(GridError::Storage { needed, passed });
        };
        fill(&field, 4, low);
        fill(&field, 16, rest);
        let (low, high) = (&*low, &*rest);
        let level = |cells: &'a [u8], stride: usize| {
            let (width, height) = entries(&shape, stride);
            Level {
                cells,
                width: width as i32,
                height: height as i32,
                before: 1,
            }
        };
        Ok(Self {
            levels: [
                Level {
                    cells: field.into_cells(),
                    width: i32::from(shape.width()),
                    height: i32::from(shape.height()),
                    before: 0,
                },
                level(low, 4),
                level(high, 16),
            ],
            field,
            top: 2,
        })
    }

    /// The same with blocks of 4 cells at the top: less work in windows below 1 m.
    #[must_use]
    pub fn local(&self) -> Self {
        Self { top: 1, ..*self }
    }

    /// The field itself.
    #[must_use]
    pub fn field(&self) -> &LikelihoodField<&'a [u8]> {
        &self.field
    }

    pub(crate) fn level(&self, level: usize) -> &Level<'a> {
        self.levels.get(level).unwrap_or(&self.levels[0])
    }

    /// Levels above the field.
    pub(crate) fn top_level(&self) -> usize {
        self.top
    }

    /// Cells in a block of a level.
    pub(crate) fn stride(&self, level: usize) -> usize {
        STRIDES.get(level).copied().unwrap_or(1)
    }

    /// Cells in a block of the top level.
    pub(crate) fn top_stride(&self) -> u16 {
        self.stride(self.top) as u16
    }
}

/// Maxima over overlapping blocks; what lies off the field counts as unexplored.
fn fill(field: &LikelihoodField<&[u8]>, stride: usize, out: &mut [u8]) {
    let shape = *field.grid().shape();
    let (columns, rows) = entries(&shape, stride);
    let (width, height) = (usize::from(shape.width()), usize::from(shape.height()));
    let (cells, unexplored) = (field.grid().cells(), field.scale().unexplored);
    // Entry k covers the cells from (k − 1)·stride to k·stride + stride − 2.
    let cover = |k: usize, side: usize| {
        let (from, to) = (k * stride, k * stride + stride - 1);
        (
            from.saturating_sub(stride),
            to.min(side),
            k == 0 || to > side,
        )
    };
    for (row, out) in (0..rows).zip(out.chunks_exact_mut(columns)) {
        let (first, last, beyond_rows) = cover(row, height);
        for (column, out) in out.iter_mut().enumerate() {
            let (from, to, beyond) = cover(column, width);
            *out = if beyond || beyond_rows { unexplored } else { 0 };
            for y in first..last {
                let cells = cells.get(y * width + from..y * width + to);
                *out = cells.into_iter().flatten().copied().fold(*out, u8::max);
            }
        }
    }
}
