//! One pass over the points: associate by projection, weigh, sum the normal equations. The hot loop, in integers.

use crate::{
    linalg::Sym3,
    matching::icp::projective::{
        fixed_pose::{FixedPose, REACH_MM},
        line::Line,
        normal_equations::Sums,
    },
    math,
    scan::ScanPoint,
};

/// Which points a pass takes, and how far off they may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    /// Points in a period: of each period the same part is used.
    pub period: u16,
    /// First point used of a period.
    pub first: u16,
    /// Points used of a period.
    pub length: u16,
    pub gate: Gate,
}

/// How far off its line a point may be: half weight at 0.16 of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gate(u32);

impl Gate {
    /// Points farther than `width` mm from their line do not count; at least 16.
    pub const fn new(width: u32) -> Self {
        // 64 steps of the kernel, in 1/16 mm: Q16.
        Self((4 << 16) / if width < 16 { 16 } else { width })
    }
}

/// Geman–McClure weights `(k²/(k² + e²))²` by the residual in 64 steps up to the gate, `k` 16 of them: Q8.
const KERNEL: [u8; 64] = kernel();

const fn kernel() -> [u8; 64] {
    let mut table = [0; 64];
    let mut i = 0;
    while i < 64 {
        let d = 256 + (i * i) as u32;
        let w = (256 * 256 * 255 + d * d / 2) / (d * d);
        table[i] = w as u8;
        i += 1;
    }
    table
}

/// A row of the system of equations, with its weight.
#[derive(Clone, Copy, Default)]
struct Row {
    /// Residual (1/16 mm).
    e: i32,
    mx: i16,
    my: i16,
    lever: i16,
    /// Q8.
    w: i16,
}

/// [`Sums`] while rows are added.
#[derive(Default)]
struct Totals {
    h: [i64; 6],
    b: [i64; 3],
    inliers: u16,
    weight: u32,
    cost: i64,
    cross: i64,
}

/// Rows after which the 32-bit sums are moved to 64 bits: 13-bit rows, 8-bit weights cannot overflow before.
const BLOCK: usize = 16;

/// Runs one pass of `points` at `at` against `lines`.
///
/// What `bench` counts for a match is little else.
pub(super) fn run(
    lines: &[Line],
    points: &[ScanPoint],
    at: FixedPose,
    lever_shift: u32,
    pass: Pass,
    known: &mut Sums,
) {
    let mut totals = Totals::default();
    let mut projection = Projection::new(lines, at);
    let mut rows = [Row::default(); BLOCK];
    let mut filled = 0;
    let mut from = usize::from(pass.first);
    while let Some(part) = points.get(from..)
        && !part.is_empty()
    {
        for point in part.iter().take(usize::from(pass.length)) {
            let placed = projection.place(point);
            let Some(line) = projection.line(point, placed) else {
                continue;
            };
            let Some((e, w)) = residual(line, placed, pass.gate) else {
                continue;
            };
            let (mx, my) = (i32::from(line.mx), i32::from(line.my));
            let lever = (my * (placed.x >> 4) - mx * (placed.y >> 4)) >> lever_shift;
            if let Some(row) = rows.get_mut(filled) {
                *row = Row {
                    e,
                    mx: line.mx,
                    my: line.my,
                    lever: lever as i16,
                    w: w as i16,
                };
            }
            filled += 1;
            if filled >= BLOCK {
                totals.add(&rows);
                filled = 0;
            }
        }
        from += usize::from(pass.period).max(1);
    }
    totals.add(rows.get(..filled).unwrap_or_default());
    *known = totals.sums();
}

/// Bits that bring every lever below 2¹³, the bound of a weighted normal: as many as the farthest place has that a
/// point can come to lie at.
pub(super) fn lever_shift(points: &[ScanPoint], start: FixedPose) -> u32 {
    let ranges = points.iter().fold(0, |bits, p| bits | p.range);
    let moved = start.x.unsigned_abs().max(start.y.unsigned_abs()) / 16 + REACH_MM as u32;
    33 - (u32::from(ranges) | moved).leading_zeros()
}

/// Where a point comes to lie in the reference's frame (1/16 mm).
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub x: i32,
    pub y: i32,
}

/// Projection association: the line seen by the reference in the direction of a point.
pub(super) struct Projection<'a> {
    lines: &'a [Line],
    /// Position and half a unit, to be shifted down with the turned point.
    x: i32,
    y: i32,
    sin: i32,
    cos: i32,
    /// Offset added to a point's bearing to guess its slot: the pose's rotation, half a slot, and the parallax seen at the
    /// previous point. (A twin of `Slots`, whose half slot is part of this sum: one addition a point less.)
    turn: u16,
    /// Half a line's width.
    half: u16,
}

impl<'a> Projection<'a> {
    /// Points of at most 32 m at poses of at most 31 m (27 m and the reach) stay within 32 bits.
    pub fn new(lines: &'a [Line], at: FixedPose) -> Self {
        let (sin, cos) = math::sin_cos_q15_fine(at.turn);
        let half = (32_768 / (lines.len() as u32).max(1)) as u16;
        Self {
            lines,
            x: (at.x << 11) + (1 << 10),
            y: (at.y << 11) + (1 << 10),
            sin,
            cos,
            turn: ((at.turn.wrapping_add(1 << 15) >> 16) as u16).wrapping_add(half),
            half,
        }
    }

    pub fn place(&self, point: &ScanPoint) -> Placed {
        let (px, py) = (i32::from(point.x), i32::from(point.y));
        Placed {
            x: self.x.wrapping_add(self.cos * px - self.sin * py) >> 11,
            y: self.y.wrapping_add(self.sin * px + self.cos * py) >> 11,
        }
    }

    /// The line in the direction of the point, `None` where no surface was seen.
    ///
    /// The line at the place of the last point's tells how far off that is, to first order: enough for a few lines, and
    /// for no more. Farther off, the direction is worked out.
    pub fn line(&mut self, point: &ScanPoint, placed: Placed) -> Option<&'a Line> {
        /// Lines that the last point's parallax is good for.
        const NEAR: i32 = 2;
        let bins = self.lines.len() as u32;
        let (x, y) = (placed.x >> 4, placed.y >> 4);
        let index = (u32::from(point.bearing.0.wrapping_add(self.turn)) * bins) >> 16;
        let line = self.lines.get(index as usize)?;
        let across = i32::from(line.ux) * y - i32::from(line.uy) * x;
        let off = (across + (1 << 15)) >> 16;
        let mut found = index.wrapping_add(off as u32);
        if (off + NEAR) as u32 > 2 * NEAR as u32 || found >= bins {
            let bearing = self.bearing(x, y);
            self.turn = bearing.wrapping_sub(point.bearing.0);
            found = (u32::from(bearing) * bins) >> 16;
        }
        self.lines.get(found as usize).filter(|line| line.is_some())
    }

    /// Direction of a place, half a line's width on. Apart, so that the loop around it keeps its registers.
    #[cold]
    #[inline(never)]
    fn bearing(&self, x: i32, y: i32) -> u16 {
        math::atan2_turn(y, x).wrapping_add(self.half)
    }
}

/// Weighted distance of a point from its line (1/16 mm) and its weight (Q8); `None` beyond the gate or 8 m away.
pub(super) fn residual(line: &Line, placed: Placed, gate: Gate) -> Option<(i32, i32)> {
    /// 8 m in 1/16 mm: below it the products with 13-bit normals stay in 32 bits.
    const FAR: i32 = 1 << 17;
    let (dx, dy) = (
        placed.x - (i32::from(line.qx) << 4),
        placed.y - (i32::from(line.qy) << 4),
    );
    if ((dx + FAR) | (dy + FAR)) as u32 >= 2 * FAR as u32 {
        return None;
    }
    let e = (i32::from(line.mx) * dx + i32::from(line.my) * dy + 512) >> 10;
    // Below 2²⁰, and the factor is below 2¹⁵: a product too large for 32 bits is held at the end.
    let weight = KERNEL.get((e.unsigned_abs().saturating_mul(gate.0) >> 16) as usize)?;
    Some((e, i32::from(*weight)))
}

impl Totals {
    /// Adds at most [`BLOCK`] rows.
    fn add(&mut self, rows: &[Row]) {
        let mut h = [0i32; 6];
        let mut b = [0i32; 3];
        for row in rows {
            let e = row.e;
            let [mx, my, lever, w] = [row.mx, row.my, row.lever, row.w].map(i32::from);
            let (wx, wy, wt) = ((w * mx) >> 8, (w * my) >> 8, (w * lever) >> 8);
            h[0] += wx * mx;
            h[1] += wx * my;
            h[2] += wx * lever;
            h[3] += wy * my;
            h[4] += wy * lever;
            h[5] += wt * lever;
            b[0] += wx * e;
            b[1] += wy * e;
            b[2] += wt * e;
        }
        let (mut weight, mut cost, mut cross, mut before) = (0, 0i32, 0i32, 0);
        for row in rows {
            let (e, we) = (row.e >> 4, (i32::from(row.w) * row.e) >> 4);
            weight += row.w as u32;
            cost += we * e;
            cross += we * before;
            before = e;
        }
        for (sum, block) in self.h.iter_mut().zip(h) {
            *sum += i64::from(block);
        }
        for (sum, block) in self.b.iter_mut().zip(b) {
            *sum += i64::from(block);
        }
        self.weight += weight;
        self.cost += i64::from(cost);
        self.cross += i64::from(cross);
        self.inliers += rows.len() as u16;
    }

    fn sums(&self) -> Sums {
        let [xx, xy, xt, yy, yt, tt] = self.h.map(|v| v as f32);
        Sums {
            h: Sym3 {
                xx,
                xy,
                xt,
                yy,
                yt,
                tt,
            },
            b: self.b.map(|v| v as f32),
            inliers: self.inliers,
            weight: self.weight as f32,
            cost: self.cost as f32,
            cross: self.cross as f32,
        }
    }
}
