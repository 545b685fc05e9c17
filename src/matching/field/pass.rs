//! One pass over the beams: slopes and curvatures of the field where they end. The hot loops, in integers.

use core::num::Wrapping;

use crate::{
    scan::ScanPoint,
    sensor_model::likelihood_field::{Field, Hessian, placement::Placement},
};

/// Side of the square around a beam in which its neighbours are taken together with it: so many cells, up to twice that.
pub(super) const TOGETHER: u32 = 2;

/// Most beams whose sums fit in 32 bits, with levers of 8 bits: of slopes to 1000 bytes a cell and curvatures to 500
/// bytes a cell². Over a table with more than that they wrap.
pub(super) const CHUNK: usize = 64;

/// What does not change during a pass.
pub(super) struct Pass {
    pub placement: Placement,
    /// Right shift to 64ths of a cell.
    pub fine: u32,
    /// And to levers.
    pub lever_shift: u32,
    pub gate: i32,
    pub unexplored: i32,
    /// Beams left out after each taken.
    pub skip: usize,
    /// Side of the square around a beam in which its neighbours are taken together with it (mm, a power of two).
    pub together: u32,
}

/// Sums over a few beams.
#[derive(Default)]
pub(super) struct Part {
    pub slope: [Wrapping<i32>; 3],
    pub curvature: [Wrapping<i32>; 6],
    pub bytes: u32,
    pub inliers: u32,
    pub overlap: u32,
}

impl Pass {
    /// Slopes and curvatures, neighbours taken together: the slopes of a parabola at several places add up to that in
    /// their middle, times their number.
    #[inline(never)]
    pub fn curves<F: Field + ?Sized>(&self, field: &F, points: &[ScanPoint]) -> Part {
        let mut part = Part::default();
        let (place, shift) = (&self.placement, self.placement.shift & 31);
        let half = (self.together >> 1) as i32;
        let mut rest = points;
        while let [first, others @ ..] = rest {
            let corner = (i32::from(first.x) - half, i32::from(first.y) - half);
            let (mut last, mut sum, mut n) = ((half, half), (half, half), 1);
            rest = others;
            while let [point, others @ ..] = rest {
                let (x, y) = (i32::from(point.x) - corner.0, i32::from(point.y) - corner.1);
                if (x | y) as u32 >= self.together {
                    break;
                }
                last = (x, y);
                sum = (sum.0 + x, sum.1 + y);
                n += 1;
                rest = others;
            }
            rest = rest.get(self.skip..).unwrap_or_default();
            // Their cell: half-way between the first and the last.
            let middle = ((half + last.0) >> 1, (half + last.1) >> 1);
            let (x, y) = place.turned(corner.0 + middle.0, corner.1 + middle.1);
            let x = place.x.wrapping_add(x as u32);
            let y = place.y.wrapping_add(y as u32);
            let (column, row) = (x >> shift, y >> shift);
            let Some(cells) = field.stencil(column, row) else {
                continue;
            };
            if cells.here < self.gate {
                if cells.here != self.unexplored {
                    part.overlap += n as u32;
                }
                continue;
            }
            // Seen from its corner: where the lidar is, then the sum of where the beams end, in 64ths of a cell.
            let lidar = (
                place.x.wrapping_sub(column << shift) as i32,
                place.y.wrapping_sub(row << shift) as i32,
            );
            let (rx, ry) = place.turned(sum.0 + n * corner.0, sum.1 + n * corner.1);
            let x = lidar.0.wrapping_mul(n).wrapping_add(rx) >> self.fine;
            let y = lidar.1.wrapping_mul(n).wrapping_add(ry) >> self.fine;
            let (dx, dy) = (x - (n << 5), y - (n << 5));
            let Hessian { xx, xy, yy } = cells.hessian();
            let slope_x = Wrapping((cells.right - cells.left) * (n << 5) + xx * dx + xy * dy);
            let slope_y = Wrapping((cells.above - cells.below) * (n << 5) + yy * dy + xy * dx);
            let (lx, ly) = (
                Wrapping(-(lidar.0 >> self.lever_shift)),
                Wrapping(-(lidar.1 >> self.lever_shift)),
            );
            part.slope[0] += slope_x;
            part.slope[1] += slope_y;
            part.slope[2] += slope_y * lx - slope_x * ly;
            // What bends upwards is a corner or the foot of a slope: no parabola to climb.
            if xx + yy < 0 {
                let (xx, xy, yy) = (Wrapping(n * xx), Wrapping(n * xy), Wrapping(n * yy));
                let (xt, yt) = (xy * lx - xx * ly, yy * lx - xy * ly);
                let bends = [xx, xy, yy, xt, yt, yt * lx - xt * ly];
                for (sum, bend) in part.curvature.iter_mut().zip(bends) {
                    *sum += bend;
                }
            }
            part.bytes += (cells.here * n) as u32;
            part.inliers += n as u32;
            part.overlap += n as u32;
        }
        part
    }

    /// Slopes, each beam by itself.
    #[inline(never)]
    pub fn slopes<F: Field + ?Sized>(&self, field: &F, points: &[ScanPoint]) -> Part {
        let mut part = Part::default();
        let [mut gx, mut gy, mut gt] = part.slope;
        // Their number counts in the upper half, so that one register holds both.
        let mut bytes = 0u32;
        for point in points {
            let (rx, ry) = self.placement.turned(point.x.into(), point.y.into());
            let fx = self.placement.x.wrapping_add(rx as u32) >> self.fine;
            let fy = self.placement.y.wrapping_add(ry as u32) >> self.fine;
            let Some(cells) = field.stencil(fx >> 6, fy >> 6) else {
                continue;
            };
            if cells.here < self.gate {
                continue;
            }
            let (dx, dy) = ((fx & 63) as i32 - 32, (fy & 63) as i32 - 32);
            let Hessian { xx, xy, yy } = cells.hessian();
            // The slope in the cell's middle, and from there on.
            let slope_x = Wrapping(((cells.right - cells.left) << 5) + xx * dx + xy * dy);
            let slope_y = Wrapping(((cells.above - cells.below) << 5) + yy * dy + xy * dx);
            let (lx, ly) = (
                Wrapping(rx >> self.lever_shift),
                Wrapping(ry >> self.lever_shift),
            );
            gx += slope_x;
            gy += slope_y;
            gt += slope_y * lx - slope_x * ly;
            bytes += cells.here as u32 | 0x1_0000;
        }
        (part.bytes, part.inliers) = (bytes & 0xffff, bytes >> 16);
        part.slope = [gx, gy, gt];
        part
    }
}
