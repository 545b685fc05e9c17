//! The bytes around the ends of neighbouring beams, summed: what Newton's method needs of a field.
//!
//! Neighbours end on the same surface, so their bytes are added up first and differences are taken of the sums. Three
//! short loops, each small enough for the registers: beams to cells, cells to inliers, inliers to sums.

use super::{Field, placement::Placement};
use crate::scan::points::ScanPoint;

/// Most beams in a group.
pub const GROUP: usize = 16;

/// Sums over a group's inliers: beams that end where the field is at least as high as asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Patch {
    /// Slopes of the bytes along columns and rows where the beams end (256ths of a byte per cell).
    pub slope: [i32; 2],
    /// Their curvatures (bytes per cell²): xx, xy, yy. Only where asked for.
    pub curvature: [i32; 3],
    /// Bytes of the cells in which they end.
    pub bytes: u32,
    /// Columns of these cells.
    pub x: i32,
    /// Rows of these cells.
    pub y: i32,
    /// Beams summed.
    pub inliers: u32,
    /// Other beams that end in explored cells; only where curvatures are asked for.
    pub beside: u32,
}

/// A cell's byte and its neighbours': from the slopes in the middle and the curvatures, the slopes elsewhere follow.
struct Around {
    left: i32,
    here: i32,
    right: i32,
    below: i32,
    above: i32,
    /// One column and one row more.
    corner: i32,
}

impl Patch {
    /// Adds a beam that ends `x` and `y` from its cell's middle (256ths of a cell), with `CURVED` its curvatures too.
    #[inline]
    fn add<const CURVED: bool>(&mut self, cell: &Around, x: i32, y: i32) {
        let xx = cell.left + cell.right - 2 * cell.here;
        let yy = cell.below + cell.above - 2 * cell.here;
        let xy = cell.corner - cell.above - cell.right + cell.here;
        let [gx, gy] = &mut self.slope;
        *gx += ((cell.right - cell.left) << 7) + xx * x + xy * y;
        *gy += ((cell.above - cell.below) << 7) + yy * y + xy * x;
        if CURVED {
            let [sxx, sxy, syy] = &mut self.curvature;
            *sxx += xx;
            *sxy += xy;
            *syy += yy;
        }
        self.bytes += cell.here as u32;
    }
}

/// Sums over at most [`GROUP`] points by one lookup after the other: for fields that are no table.
pub(super) fn by_cells<F: Field + ?Sized>(
    field: &F,
    points: &[ScanPoint],
    placement: &Placement,
    gate: u8,
) -> Patch {
    let (width, height) = (
        u32::from(field.shape().width()),
        u32::from(field.shape().height()),
    );
    let mut patch = Patch::default();
    let inside = |at: u32, side: u32| at >= 1 && at + 1 < side;
    for point in points.iter().take(GROUP) {
        let (px, py) = placement.place(point);
        let (x, y) = placement.cell(point);
        if !inside(x, width) || !inside(y, height) {
            continue;
        }
        let at = |x: u32, y: u32| i32::from(field.byte(x, y));
        let here = at(x, y);
        if here < i32::from(gate) {
            patch.beside += u32::from(here != i32::from(field.scale().unexplored));
            continue;
        }
        let cell = Around {
            left: at(x - 1, y),
            here,
            right: at(x + 1, y),
            below: at(x, y - 1),
            above: at(x, y + 1),
            corner: at(x + 1, y + 1),
        };
        let part = |place: u32| ((place >> ((placement.shift - 8) & 31)) & 255) as i32 - 128;
        patch.add::<true>(&cell, part(px), part(py));
        patch.x += x as i32;
        patch.y += y as i32;
        patch.inliers += 1;
    }
    patch
}

/// A table, a lidar's place on it, and room for a group.
pub(super) struct Table<'a> {
    cells: &'a [u8],
    width: u16,
    unexplored: u8,
    gate: u8,
    /// Whether curvatures are asked for.
    curved: bool,
    /// Seen from the second cell of the second row, which is the first with all neighbours.
    placement: Placement,
    /// Where the beams of a group end.
    places: [(u32, u32); GROUP],
    /// Cells of its inliers, counted from the second of the second row.
    /// And where in them the beams end, in two halves of a word.
    kept: [(u32, u32); GROUP],
}

impl<'a> Table<'a> {
    pub fn new(
        cells: &'a [u8],
        width: u16,
        unexplored: u8,
        placement: &Placement,
        gate: u8,
        curved: bool,
    ) -> Self {
        let one = 1 << (placement.shift & 31);
        Self {
            cells,
            width,
            unexplored,
            gate,
            curved,
            placement: Placement {
                x: placement.x.wrapping_sub(one),
                y: placement.y.wrapping_sub(one),
                ..*placement
            },
            places: [(0, 0); GROUP],
            kept: [(0, 0); GROUP],
        }
    }

    /// Sums over at most [`GROUP`] points.
    pub fn patch(&mut self, points: &[ScanPoint]) -> Patch {
        place(&self.placement, points, &mut self.places);
        let places = self.places.get(..points.len()).unwrap_or(&[]);
        let (cells, width) = (self.cells, self.width);
        let found = if self.placement.shift == Placement::COARSE {
            sort_out::<{ Placement::COARSE }>(cells, width, self.gate, places, &mut self.kept)
        } else {
            sort_out::<{ Placement::FINE }>(cells, width, self.gate, places, &mut self.kept)
        };
        let [count, y] = found.unwrap_or_default();
        let kept = self.kept.get(..count as usize).unwrap_or(&[]);
        let found = if self.curved {
            sums::<true>(cells, width, kept)
        } else {
            sums::<false>(cells, width, kept)
        };
        let (mut patch, total) = found.unwrap_or_default();
        // From the second of the second row on.
        let x = total.wrapping_sub(y.wrapping_mul(u32::from(width)));
        patch.x = x.wrapping_add(count) as i32;
        patch.y = y.wrapping_add(count) as i32;
        patch.inliers = count;
        if self.curved && kept.len() < places.len() {
            patch.beside = self.explored(places).saturating_sub(count);
        }
        patch
    }

    /// How many of the places are explored.
    #[inline(never)]
    fn explored(&self, places: &[(u32, u32)]) -> u32 {
        let (shift, row) = (self.placement.shift & 31, usize::from(self.width));
        let here = self.cells.get(row + 1..).unwrap_or(&[]);
        let explored = |&&(x, y): &&(u32, u32)| {
            let (x, y) = ((x >> shift) as usize, (y >> shift) as usize);
            let byte = here.get(y.wrapping_mul(row).wrapping_add(x));
            x + 2 < row && byte.is_some_and(|&byte| byte != self.unexplored)
        };
        places.iter().filter(explored).count() as u32
    }
}

/// Keeps the inliers; gives their number, and the sum of their rows.
#[inline(never)]
fn sort_out<const SHIFT: u32>(
    cells: &[u8],
    width: u16,
    gate: u8,
    places: &[(u32, u32)],
    kept: &mut [(u32, u32); GROUP],
) -> Option<[u32; 2]> {
    let (mut rows, mut count) = (0, 0u32);
    let here = cells.get(usize::from(width) + 1..)?;
    let width = u32::from(width);
    let span = width.checked_sub(2)? << SHIFT;
    for &(x, y) in places {
        // Rows and columns below 2¹⁵: the product cannot wrap, and a row off the table is off it.
        let row = y >> SHIFT;
        let cell = row.wrapping_mul(width).wrapping_add(x >> SHIFT);
        match here.get(cell as usize) {
            Some(&byte) if x < span && byte >= gate => {
                // From the lower left corner; with the upper bit turned, a signed byte from the middle.
                let part = |place: u32| (place >> (SHIFT - 8)) & 255;
                if let Some(place) = kept.get_mut(count as usize % GROUP) {
                    *place = (cell, (part(x) | (part(y) << 16)) ^ 0x80_0080);
                }
                rows += row;
                count += 1;
            }
            _ => {}
        }
    }
    Some([count, rows])
}

/// Where points end.
#[inline(never)]
fn place(placement: &Placement, points: &[ScanPoint], places: &mut [(u32, u32); GROUP]) {
    let placement = *placement;
    for (place, point) in places.iter_mut().zip(points) {
        *place = placement.place(point);
    }
}

/// Sums over inliers, and the sum of their cells.
///
/// Cells are counted from the second of the second row. `None` for a table that has none such.
#[inline(never)]
fn sums<const CURVED: bool>(cells: &[u8], width: u16, kept: &[(u32, u32)]) -> Option<(Patch, u32)> {
    let row = usize::from(width);
    // Three slices that one index serves, and one check: the first is the shortest.
    let inner = cells.len().checked_sub(2 * row + 2)?;
    let below = cells.get(1..)?.get(..inner)?;
    let left = cells.get(row..)?.get(..inner + 2)?;
    let above = cells.get(2 * row + 1..)?.get(..inner + 1)?;
    let (mut patch, mut total) = (Patch::default(), 0u32);
    for &(cell, part) in kept {
        let k = cell as usize;
        if k < inner {
            let at = |slice: &[u8], k: usize| slice.get(k).map_or(0, |&byte| i32::from(byte));
            total = total.wrapping_add(cell);
            let around = Around {
                left: at(left, k),
                here: at(left, k + 1),
                right: at(left, k + 2),
                below: at(below, k),
                above: at(above, k),
                corner: at(above, k + 1),
            };
            let signed = |byte: u32| i32::from(byte as i8);
            patch.add::<CURVED>(&around, signed(part), signed(part >> 16));
        }
    }
    Some((patch, total))
}
