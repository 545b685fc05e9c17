//! Exact squared Euclidean distance to the nearest occupied cell, in integers.
//!
//! Columns by two sweeps, rows by the lower envelope of parabolas: Meijster, Roerdink, Hesselink 2000;
//! Felzenszwalb, Huttenlocher 2012. The same work for each cell, whatever the map.

use super::{GridError, Shape};
use crate::math;

/// Square of the distance (cells²) beyond which all cells count as equally far: 255.99 cells.
pub const FAR: u16 = u16::MAX;

/// Working memory of [`squared`] for grids of at most N columns: 8·N bytes.
#[derive(Debug, Clone)]
pub struct Scratch<const N: usize> {
    /// The row before it is overwritten.
    row: [u16; N],
    /// Columns whose parabolas make up the envelope, from the left.
    site: [u16; N],
    /// First column that each of them owns.
    first: [u16; N],
    /// Squares of the sites, beside them.
    height: [u16; N],
}

impl<const N: usize> Scratch<N> {
    /// Room for N columns.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            row: [0; N],
            site: [0; N],
            first: [0; N],
            height: [0; N],
        }
    }
}

impl<const N: usize> Default for Scratch<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Writes into `out` the squared distance (cells², centre to centre) from each cell to the nearest one that
/// `occupied` names, [`FAR`] where there is none within 255.99 cells.
///
/// `out` needs one entry a cell, `scratch` one a column.
pub fn squared<const N: usize>(
    shape: &Shape,
    cells: &[u8],
    occupied: impl Fn(u8) -> bool,
    out: &mut [u16],
    scratch: &mut Scratch<N>,
) -> Result<(), GridError> {
    // A shape has a column, but the compiler does not know.
    let (width, needed) = (usize::from(shape.width()).max(1), shape.len());
    for (needed, passed, fits) in [
        (needed, out.len(), out.len() == needed),
        (needed, cells.len(), cells.len() == needed),
        (width, N, N >= width),
    ] {
        if !fits {
            return Err(GridError::Storage { needed, passed });
        }
    }
    for (square, &cell) in out.iter_mut().zip(cells) {
        *square = if occupied(cell) { 0 } else { FAR };
    }
    sweep_columns(out, width);
    let Scratch {
        row: copy,
        site,
        first,
        height,
    } = scratch;
    for row in out.chunks_exact_mut(width) {
        let Some(copy) = copy.get_mut(..width) else {
            break;
        };
        copy.copy_from_slice(row);
        let mut envelope = Envelope {
            len: 0,
            site,
            first,
            height,
        };
        for (x, &square) in copy.iter().enumerate() {
            if square != FAR {
                envelope.add(x as i32, i32::from(square), width as i32);
            }
        }
        envelope.write(row);
    }
    Ok(())
}

/// Whole distances (cells), rounded down, as [`super::cast::Skipping`] wants them.
#[cfg(feature = "internals")]
pub fn roots(squares: &[u16], out: &mut [u8]) {
    for (&square, root) in squares.iter().zip(out) {
        *root = math::isqrt(u32::from(square)) as u8;
    }
}

/// Distances within each column, down and up, then squared.
fn sweep_columns(out: &mut [u16], width: usize) {
    let width = width.max(1);
    for start in (width..out.len()).step_by(width) {
        let Some((below, here)) = out.split_at_mut_checked(start) else {
            break;
        };
        pass_on(
            below.rchunks_exact(width).next(),
            here.chunks_exact_mut(width).next(),
        );
    }
    let mut end = out.len();
    while end > width {
        end -= width;
        let Some((here, above)) = out.split_at_mut_checked(end) else {
            break;
        };
        pass_on(
            above.chunks_exact(width).next(),
            here.rchunks_exact_mut(width).next(),
        );
    }
    for square in out {
        let d = u32::from(*square);
        *square = if d > 255 { FAR } else { (d * d) as u16 };
    }
}

/// A row is at most one cell farther than the row beside it.
fn pass_on(from: Option<&[u16]>, to: Option<&mut [u16]>) {
    let (Some(from), Some(to)) = (from, to) else {
        return;
    };
    for (&near, far) in from.iter().zip(to) {
        let next = near.saturating_add(1);
        if next < *far {
            *far = next;
        }
    }
}

/// Lower envelope of the parabolas `(x - site)² + height`.
struct Envelope<'a> {
    len: usize,
    site: &'a mut [u16],
    first: &'a mut [u16],
    height: &'a mut [u16],
}

impl Envelope<'_> {
    /// Adds a parabola to the right of all others.
    fn add(&mut self, x: i32, height: i32, width: i32) {
        let mut begins = 0;
        while let Some((site, first, top)) = self.last() {
            // First column where the new parabola is strictly below the last one. Columns are below 2¹⁴ and
            // heights below 2¹⁶, so the difference stays below 2²⁹.
            let lead = height - top + x * x - site * site;
            // Sites differ, so there is a quotient.
            let Some(ends) = lead.checked_div_euclid(2 * (x - site)) else {
                return;
            };
            begins = ends + 1;
            if begins > first || self.len == 1 {
                break;
            }
            self.len -= 1;
        }
        if self.len == 1 && begins <= 0 {
            self.len = 0;
            begins = 0;
        }
        if begins >= width {
            return;
        }
        let (Some(site), Some(first), Some(top)) = (
            self.site.get_mut(self.len),
            self.first.get_mut(self.len),
            self.height.get_mut(self.len),
        ) else {
            return;
        };
        (*site, *first, *top) = (x as u16, begins as u16, height as u16);
        self.len += 1;
    }

    /// Site, first column and height of the rightmost parabola.
    fn last(&self) -> Option<(i32, i32, i32)> {
        self.entry(self.len.checked_sub(1)?)
    }

    fn entry(&self, k: usize) -> Option<(i32, i32, i32)> {
        let (site, first) = (*self.site.get(k)?, *self.first.get(k)?);
        Some((
            i32::from(site),
            i32::from(first),
            i32::from(*self.height.get(k)?),
        ))
    }

    /// Writes the envelope's heights; all [`FAR`] where it is empty.
    fn write(&self, row: &mut [u16]) {
        let mut next = 0;
        let (mut site, mut top) = (0, i32::from(FAR));
        for (x, square) in row.iter_mut().enumerate() {
            let x = x as i32;
            while next < self.len {
                let Some((s, first, t)) = self.entry(next) else {
                    break;
                };
                if first > x {
                    break;
                }
                (site, top) = (s, t);
                next += 1;
            }
            let d = x - site;
            let value = d * d + top;
            *square = if next == 0 || value > i32::from(FAR) {
                FAR
            } else {
                value as u16
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;

    #[test]
    fn one_cell_is_seen_from_all_around() {
        let shape = Shape::new(5, 3, 0.1, Pose::IDENTITY).expect("good");
        let mut cells = [0; 15];
        cells[6] = 1;
        let mut out = [0; 15];
        squared(
            &shape,
            &cells,
            |c| c == 1,
            &mut out,
            &mut Scratch::<5>::new(),
        )
        .expect("fits");
        #[rustfmt::skip]
        assert_eq!(out, [
            2, 1, 2, 5, 10,
            1, 0, 1, 4, 9,
            2, 1, 2, 5, 10,
        ]);
        squared(
            &shape,
            &cells,
            |c| c == 2,
            &mut out,
            &mut Scratch::<5>::new(),
        )
        .expect("fits");
        assert_eq!(out, [FAR; 15]);
    }

    #[test]
    fn short_buffers_are_refused() {
        let shape = Shape::new(5, 3, 0.1, Pose::IDENTITY).expect("good");
        let refused = squared(
            &shape,
            &[0; 15],
            |_| true,
            &mut [0; 14],
            &mut Scratch::<5>::new(),
        );
        assert_eq!(
            refused,
            Err(GridError::Storage {
                needed: 15,
                passed: 14
            })
        );
        let refused = squared(
            &shape,
            &[0; 15],
            |_| true,
            &mut [0; 15],
            &mut Scratch::<4>::new(),
        );
        assert_eq!(
            refused,
            Err(GridError::Storage {
                needed: 5,
                passed: 4
            })
        );
    }
}
