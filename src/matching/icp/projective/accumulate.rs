//! One pass over the points: associate by projection, weigh, sum the normal equations. The hot loop, in integers.

use crate::{
    geometry::Pose, linalg::Sym3, matching::icp::projective::line::Line, math, scan::ScanPoint,
};

/// A pose in whole numbers: what a pass works with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FixedPose {
    /// 1/16 mm.
    pub x: i32,
    /// 1/16 mm.
    pub y: i32,
    /// 2⁻³² turn.
    pub turn: u32,
}

/// 1/16 mm in a metre.
const PER_METRE: f32 = 16_000.0;
/// 2⁻³² turns in a radian.
const PER_RADIAN: f32 = 4_294_967_296.0 / core::f32::consts::TAU;

impl FixedPose {
    /// Nearest fixed pose; `None` for one that is not finite or farther than 27 m away.
    pub fn new(pose: Pose) -> Option<Self> {
        let inside = |v: f32| v > -27.0 && v < 27.0;
        if !(inside(pose.x) && inside(pose.y) && pose.theta.is_finite()) {
            return None;
        }
        Some(Self {
            x: math::round_to_i32(pose.x * PER_METRE),
            y: math::round_to_i32(pose.y * PER_METRE),
            turn: math::round_to_i32(math::wrap_angle(pose.theta) * PER_RADIAN) as u32,
        })
    }

    /// Metres and radians again.
    pub fn pose(self) -> Pose {
        Pose::new(
            self.x as f32 / PER_METRE,
            self.y as f32 / PER_METRE,
            self.turn as i32 as f32 / PER_RADIAN,
        )
    }

    /// Started elsewhere.
    pub fn moved_far(self, by: [f32; 3]) -> Self {
        let (s, c) = math::sin_cos(self.turn as i32 as f32 / PER_RADIAN);
        let ahead = |v: f32| math::round_to_i32(v * PER_METRE);
        Self {
            x: self.x + ahead(c * by[0] - s * by[1]),
            y: self.y + ahead(s * by[0] + c * by[1]),
            turn: self
                .turn
                .wrapping_add(math::round_to_i32(math::wrap_angle(by[2]) * PER_RADIAN) as u32),
        }
    }

    /// Distance between the two places (m).
    pub fn distance_only(self, other: Self) -> f32 {
        let (dx, dy) = (
            (self.x - other.x) as f32 / PER_METRE,
            (self.y - other.y) as f32 / PER_METRE,
        );
        math::sqrt(dx * dx + dy * dy)
    }

    /// Distance between two poses (m), a turn counted at 3 m.
    pub fn distance(self, other: Self) -> f32 {
        let turn = math::abs(self.turn.wrapping_sub(other.turn) as i32 as f32 / PER_RADIAN);
        self.distance_only(other) + 3.0 * turn
    }

    /// Moved by a step: by `dx`, `dy` (1/16 mm) and by `turn` (rad) about the reference's origin, itself held within
    /// 0.5 m and 0.3 rad, and the pose within [`REACH_MM`] of where the search started.
    pub fn moved(self, [dx, dy, turn]: [f32; 3], home: Self) -> Self {
        let held = |v: f32, most: f32| math::max(math::min(v, most), -most);
        let turn = held(turn, 0.3);
        let step = |d: f32| math::round_to_i32(held(d, 0.5 * PER_METRE));
        let reach = |v: i32, home: i32| v.max(home - 16 * REACH_MM).min(home + 16 * REACH_MM);
        Self {
            x: reach(self.x + step(dx - turn * self.y as f32), home.x),
            y: reach(self.y + step(dy + turn * self.x as f32), home.y),
            turn: self
                .turn
                .wrapping_add(math::round_to_i32(turn * PER_RADIAN) as u32),
        }
    }
}

/// How far from its start a search may get (mm).
const REACH_MM: i32 = 4000;

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
        // Steps of the kernel in 1/16 mm, Q16.
        Self((64 << 16) / (16 * if width < 16 { 16 } else { width }))
    }
}

/// What passes found.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// `Σ w a aᵀ`, upper triangle by rows, `a` the row `(mx, my, lever)`.
    h: [i64; 6],
    /// `Σ w a e`.
    b: [i64; 3],
    /// Points nearer to their line than the gate.
    pub inliers: u16,
    /// `Σ w`, Q8.
    weight: u32,
    /// `Σ w e²` (mm², Q8).
    cost: i64,
    /// `Σ w e e′`, `e′` the residual of the point before (mm², Q8).
    cross: i64,
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
    mx: i32,
    my: i32,
    lever: i32,
    /// Residual (1/16 mm).
    e: i32,
    /// Q8.
    w: i32,
}

/// A Gauss–Newton step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// See [`FixedPose::moved`].
    pub by: [f32; 3],
    /// What it takes off the weighted sum of the squared residuals, were they linear (mm²): over the variance of a residual,
    /// the square of the step in standard deviations of the pose.
    pub gain: f32,
}

/// How much larger errors are than the residuals of one scan say: the reference's noise is as large as the scan's and
/// averaged over in its lines.
const INFLATION: f32 = 1.6;

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
) -> Sums {
    let mut sums = Sums::default();
    let mut projection = Projection::new(lines, at);
    let mut rows = [Row::default(); BLOCK];
    let mut filled = 0;
    for chunk in points.chunks(usize::from(pass.period).max(1)) {
        let part = chunk.get(usize::from(pass.first)..).unwrap_or_default();
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
                    mx,
                    my,
                    lever,
                    e,
                    w,
                };
            }
            filled += 1;
            if filled >= BLOCK {
                sums.add(&rows);
                filled = 0;
            }
        }
    }
    sums.add(rows.get(..filled).unwrap_or_default());
    sums
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
    // Below 2¹⁷ the products with 13-bit normals stay in 32 bits.
    const FAR: i32 = 1 << 17;
    let (dx, dy) = (
        placed.x - (i32::from(line.qx) << 4),
        placed.y - (i32::from(line.qy) << 4),
    );
    if ((dx + FAR) | (dy + FAR)) as u32 >= 2 * FAR as u32 {
        return None;
    }
    let e = (i32::from(line.mx) * dx + i32::from(line.my) * dy + 512) >> 10;
    // Below 2¹⁹, and the factor is below 2¹⁵: a product too large for 32 bits is held at the end.
    let weight = KERNEL.get((e.unsigned_abs().saturating_mul(gate.0) >> 16) as usize)?;
    Some((e, i32::from(*weight)))
}

impl Sums {
    /// Adds at most [`BLOCK`] rows.
    fn add(&mut self, rows: &[Row]) {
        let mut h = [0i32; 6];
        let mut b = [0i32; 3];
        for row in rows {
            let &Row {
                mx,
                my,
                lever,
                e,
                w,
            } = row;
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
            let (e, we) = (row.e >> 4, (row.w * row.e) >> 4);
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

    /// Sum of the weights.
    pub fn total_weight(&self) -> f32 {
        self.weight as f32 / 256.0
    }

    /// How alike the residuals of neighbouring points are, 0 to 0.9: where they share an error of the reference's
    /// surface, they are worth fewer points than there are.
    pub fn correlation(&self) -> f32 {
        if self.cost <= 0 {
            return 0.0;
        }
        math::max(0.0, math::min(0.9, self.cross as f32 / self.cost as f32))
    }

    pub fn inflation(&self) -> f32 {
        let alike = self.correlation();
        INFLATION * (1.0 + alike) / (1.0 - alike)
    }

    /// Root of the weighted mean square residual (m).
    pub fn residual(&self) -> f32 {
        if self.weight == 0 {
            return 0.0;
        }
        math::sqrt(self.cost as f32 / self.weight as f32) * 1e-3
    }

    /// The Gauss–Newton step by the normal equations: see [`FixedPose::moved`]. `None` where they are singular.
    pub fn step(&self, lever_shift: u32) -> Option<Step> {
        let [xx, xy, xt, yy, yt, tt] = self.h.map(|v| v as f32);
        // A direction that the points leave open keeps still instead of making the system singular.
        let ridge = 4e-6 * (xx + yy + tt);
        let (xx, yy, tt) = (xx + ridge, yy + ridge, tt + ridge);
        let h = Sym3 {
            xx,
            xy,
            xt,
            yy,
            yt,
            tt,
        };
        let b = self.b.map(|v| v as f32);
        let [dx, dy, turn] = h.solve(b)?;
        // Normals are Q10, residuals 1/16 mm, levers mm of Q10 shifted down.
        let per_lever = 64.0 / (1u32 << (lever_shift & 31)) as f32;
        let [bx, by, bt] = b;
        Some(Step {
            by: [-1024.0 * dx, -1024.0 * dy, -per_lever * turn],
            gain: (bx * dx + by * dy + bt * turn) * (1.0 / 256.0),
        })
    }

    /// `Σ w a aᵀ` over a motion of the lidar, which is at `at` (1, m, m²).
    pub fn curvature(&self, lever_shift: u32, at: FixedPose) -> Sym3 {
        const N: f32 = 1.0 / 1024.0;
        let lever = (1u32 << (lever_shift & 31)) as f32 * (1e-3 / 1024.0);
        let [xx, xy, xt, yy, yt, tt] = self.h.map(|v| v as f32);
        Sym3 {
            xx: xx * N * N,
            xy: xy * N * N,
            xt: xt * N * lever,
            yy: yy * N * N,
            yt: yt * N * lever,
            tt: tt * lever * lever,
        }
        .about(at.x as f32 / PER_METRE, at.y as f32 / PER_METRE)
    }
}

/// Length of a step of [`Sums::step`] (m), a turn counted at 3 m.
pub(super) fn length(step: [f32; 3]) -> f32 {
    let [x, y, turn] = step.map(math::abs);
    (x + y) / PER_METRE + 3.0 * turn
}
