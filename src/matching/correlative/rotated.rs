//! A scan with one heading, ready to be summed at many places: each beam an index, four places an addition.

use super::pyramid::Pyramid;
use crate::{
    geometry::Pose,
    scan::{ScanPoint, thinning::thinned},
    sensor_model::likelihood_field::{Field, placement::Placement},
};

/// The cells that a scan's points fall into, seen from a window's first cell. 8·N bytes.
#[derive(Debug, Clone)]
pub(crate) struct Rotated<const N: usize> {
    /// Cell of each point.
    cells: heapless::Vec<(i16, i16), N>,
    /// Their indices in one level's table: first those that stay on it in the whole window, then those that cross its
    /// edge, then those that are off it all the time.
    indices: heapless::Vec<u32, N>,
    /// Points that stay on the table of the current level.
    inside: usize,
    /// These and those that cross its edge.
    near: usize,
    level: usize,
    /// Cells of the window.
    side: i16,
}

impl<const N: usize> Rotated<N> {
    pub const fn new() -> Self {
        Self {
            cells: heapless::Vec::new(),
            indices: heapless::Vec::new(),
            inside: 0,
            near: 0,
            level: usize::MAX,
            side: 0,
        }
    }

    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Takes at most N points, evenly spread; false where the pose is out of reach.
    pub fn assign(
        &mut self,
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        corner: Pose,
        side: i16,
    ) -> bool {
        self.cells.clear();
        self.level = usize::MAX;
        self.side = side;
        let Some(placement) = Placement::new(pyramid.field().shape(), corner) else {
            return false;
        };
        for point in thinned(points, N) {
            let (x, y) = placement.place(point);
            // Coordinates are modulo 2³²; what is left of zero is far right until the shift keeps its sign.
            let cell = |place: u32| {
                let cell = place >> (placement.shift & 31);
                let limit = 1u32 << ((31 - placement.shift) & 31);
                if cell >= limit + limit / 2 {
                    cell as i32 - 2 * limit as i32
                } else {
                    cell as i32
                }
            };
            let _ = self.cells.push((
                cell(x).clamp(-16_000, 16_383) as i16,
                cell(y).clamp(-16_000, 16_383) as i16,
            ));
        }
        true
    }

    /// Indices for a level, sorted by whether points stay on its table.
    fn index(&mut self, pyramid: &Pyramid<'_>, level: usize) {
        let table = pyramid.level(level);
        let shift = 2 * level as u32;
        let span = i32::from(self.side) >> shift;
        self.indices.clear();
        (self.inside, self.near) = (0, 0);
        self.level = level;
        for k in 0..self.cells.len() {
            let Some(&(x, y)) = self.cells.get(k) else {
                break;
            };
            let (column, row) = (
                (i32::from(x) >> shift) + table.before,
                (i32::from(y) >> shift) + table.before,
            );
            // Four at a time: a row may read three entries past the window.
            let on = column >= 0
                && row >= 0
                && column + span + 3 < table.width
                && row + span < table.height;
            let _ = self
                .indices
                .push((row.wrapping_mul(table.width).wrapping_add(column)) as u32);
            let off = column + span + 3 < 0
                || row + span < 0
                || column >= table.width
                || row >= table.height;
            if !off {
                self.swap(k, self.near);
                if on {
                    self.swap(self.near, self.inside);
                    self.inside += 1;
                }
                self.near += 1;
            }
        }
    }

    /// Swaps two points.
    fn swap(&mut self, a: usize, b: usize) {
        swap(&mut self.indices, a, b);
        swap(&mut self.cells, a, b);
    }

    /// Sums of bytes at four places in a row: `x..x + 4` and `y` in blocks of the level, from the window's first.
    pub fn row(&mut self, pyramid: &Pyramid<'_>, level: usize, x: i16, y: i16) -> [u32; 4] {
        if level != self.level {
            self.index(pyramid, level);
        }
        let table = pyramid.level(level);
        let offset = i32::from(y)
            .wrapping_mul(table.width)
            .wrapping_add(i32::from(x)) as usize;
        let (inside, _) = self
            .indices
            .split_at_checked(self.inside)
            .unwrap_or((&[], &[]));
        let mut sums = sum_four(table.cells.get(offset..).unwrap_or(&[]), inside);
        let shift = 2 * level as u32;
        let unexplored = u32::from(pyramid.field().scale().unexplored);
        let (near, off) = self.cells.split_at_checked(self.near).unwrap_or((&[], &[]));
        let mut missed = off.len() as u32;
        for &(cx, cy) in near.iter().skip(self.inside) {
            let column = (i32::from(cx) >> shift) + table.before + i32::from(x);
            let row = (i32::from(cy) >> shift) + table.before + i32::from(y);
            if !(0..table.height).contains(&row) {
                missed += 1;
                continue;
            }
            let start = row.wrapping_mul(table.width);
            let four = table
                .cells
                .get(start.wrapping_add(column) as usize..)
                .and_then(|rest| rest.first_chunk::<4>())
                .filter(|_| column >= 0 && column + 3 < table.width);
            if let Some(four) = four {
                for (sum, &byte) in sums.iter_mut().zip(four) {
                    *sum += u32::from(byte);
                }
                continue;
            }
            for (sum, column) in sums.iter_mut().zip(column..) {
                let on = (0..table.width).contains(&column);
                *sum += match table.cells.get(start.wrapping_add(column) as usize) {
                    Some(&byte) if on => u32::from(byte),
                    _ => unexplored,
                };
            }
        }
        for sum in &mut sums {
            *sum += missed * unexplored;
        }
        sums
    }
}

/// Sums of four bytes in a row from each index on: two additions for four places. An index without four bytes after it
/// counts as nothing.
#[must_use]
pub fn sum_four(table: &[u8], indices: &[u32]) -> [u32; 4] {
    let mut sums = [0u32; 4];
    let Some(last) = table.len().checked_sub(4) else {
        return sums;
    };
    // 256 bytes of 255 fit in 16 bits.
    for indices in indices.chunks(256) {
        let (even, odd) = sum_pairs(table, last as u32, indices);
        for (sum, part) in sums
            .iter_mut()
            .zip([even & 0xffff, odd & 0xffff, even >> 16, odd >> 16])
        {
            *sum += part;
        }
    }
    sums
}

/// The loop of [`sum_four`], by itself so that all of it stays in registers: the first and third byte's sums in the
/// halves of one word, the second's and fourth's in those of another.
#[inline(never)]
fn sum_pairs(table: &[u8], last: u32, indices: &[u32]) -> (u32, u32) {
    let (mut even, mut odd) = (0u32, 0u32);
    for &index in indices {
        // Up to `last` both are there: four bytes are one load where it may be unaligned.
        let bytes = table
            .get(index as usize..)
            .and_then(|rest| rest.first_chunk::<4>());
        if let Some(bytes) = bytes.filter(|_| index <= last) {
            let word = u32::from_le_bytes(*bytes);
            even = even.wrapping_add(word & 0x00ff_00ff);
            odd = odd.wrapping_add((word >> 8) & 0x00ff_00ff);
        }
    }
    (even, odd)
}

/// Swaps two entries, where there are two.
fn swap<T: Copy>(list: &mut [T], a: usize, b: usize) {
    if let (Some(&at_a), Some(&at_b)) = (list.get(a), list.get(b)) {
        if let Some(entry) = list.get_mut(a) {
            *entry = at_b;
        }
        if let Some(entry) = list.get_mut(b) {
            *entry = at_a;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_sums_at_once() {
        let table: [u8; 8] = [1, 2, 3, 4, 5, 255, 255, 255];
        assert_eq!(
            sum_four(&table, &[0, 1, 4]),
            [1 + 2 + 5, 2 + 3 + 255, 3 + 4 + 255, 4 + 5 + 255]
        );
        assert_eq!(sum_four(&table, &[4; 300]), [1500, 76_500, 76_500, 76_500]);
        assert_eq!(sum_four(&table, &[5]), [0; 4]);
    }
}
