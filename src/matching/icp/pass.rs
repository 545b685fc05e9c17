//! One pass over the points: associate by projection, weigh, sum the normal equations. The hot loop, in integers.

use crate::{geometry::Pose, linalg::Sym3, matching::icp::reference::Line, math, scan::ScanPoint};

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
    /// Nearest fixed pose; `None` for one that is not finite or farther than 32 m away.
    pub fn new(pose: Pose) -> Option<Self> {
        let inside = |v: f32| v > -32.0 && v < 32.0;
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

    /// Started elsewhere: any number of turns, held within the 32 m.
    pub fn moved_far(self, by: [f32; 3]) -> Self {
        let (s, c) = math::sin_cos(self.turn as i32 as f32 / PER_RADIAN);
        let limit = 32 * 16_000;
        let ahead = |v: f32| math::round_to_i32(v * PER_METRE);
        Self {
            x: (self.x + ahead(c * by[0] - s * by[1])).clamp(-limit, limit),
            y: (self.y + ahead(s * by[0] + c * by[1])).clamp(-limit, limit),
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

    /// Moved by a step (m, m, rad), itself held within 0.5 m and 0.3 rad.
    pub fn moved(self, step: [f32; 3]) -> Self {
        let held = |v: f32, most: f32| math::max(math::min(v, most), -most);
        let limit = 32 * 16_000;
        Self {
            x: (self.x + math::round_to_i32(held(step[0], 0.5) * PER_METRE)).clamp(-limit, limit),
            y: (self.y + math::round_to_i32(held(step[1], 0.5) * PER_METRE)).clamp(-limit, limit),
            turn: self
                .turn
                .wrapping_add(math::round_to_i32(held(step[2], 0.3) * PER_RADIAN) as u32),
        }
    }
}

/// Which points a pass takes, and how far off they may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass {
    /// Every how many-th point.
    pub stride: u8,
    /// The gate: points farther than `4 << gate` mm from their line do not count. Half weight at 0.16 of it.
    pub gate: u8,
}

/// What a pass found.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// `Σ w a aᵀ`, upper triangle by rows, `a` the row `(mx, my, lever)`.
    h: [i64; 6],
    /// `Σ w a e`.
    b: [i64; 3],
    /// Bits that levers were shifted down by.
    lever_shift: u32,
    /// Points that met a line.
    pub overlap: u16,
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

/// Points after which the 32-bit sums are moved to 64 bits: 13-bit rows, 8-bit weights cannot overflow before.
const BLOCK: usize = 16;

/// Runs one pass of `points` at `at` against `lines`.
///
/// About 65 instructions a point on an M4F, 110 on an M0.
pub(super) fn run(
    lines: &[Line],
    points: &[ScanPoint],
    at: FixedPose,
    pass: Pass,
    first: usize,
) -> Sums {
    let stride = usize::from(pass.stride).max(1);
    let mut sums = Sums {
        lever_shift: lever_shift(points),
        ..Sums::default()
    };
    let Some(points) = points.get(first..) else {
        return sums;
    };
    let projection = Projection::new(lines, at);
    let mut before = 0;
    for chunk in points.chunks(BLOCK * stride) {
        let mut h = [0i32; 6];
        let mut b = [0i32; 3];
        for point in chunk.iter().step_by(stride) {
            let placed = projection.place(point);
            let Some(line) = projection.line(&placed) else {
                continue;
            };
            sums.overlap += 1;
            let Some(e) = residual(line, &placed, pass.gate) else {
                continue;
            };
            sums.inliers += 1;
            let step = (e.unsigned_abs() >> pass.gate) as usize;
            let w = i32::from(KERNEL.get(step).copied().unwrap_or(0));
            let (mx, my) = (i32::from(line.mx), i32::from(line.my));
            let lever = (my * (placed.rx >> 4) - mx * (placed.ry >> 4)) >> sums.lever_shift;
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
            sums.weight += w as u32;
            let we = (w * e) >> 4;
            sums.cost += i64::from(we * (e >> 4));
            sums.cross += i64::from(we * before);
            before = e >> 4;
        }
        for (sum, block) in sums.h.iter_mut().zip(h) {
            *sum += i64::from(block);
        }
        for (sum, block) in sums.b.iter_mut().zip(b) {
            *sum += i64::from(block);
        }
    }
    sums
}

/// Bits that bring every lever below 2¹³, the bound of a weighted normal: as many as the farthest range has.
fn lever_shift(points: &[ScanPoint]) -> u32 {
    let farthest = points
        .iter()
        .fold(0, |most, p| if p.range > most { p.range } else { most });
    32 - u32::from(farthest).leading_zeros()
}

/// Where a point comes to lie.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    /// Turned, not yet moved (1/16 mm).
    pub rx: i32,
    /// As `rx`.
    pub ry: i32,
    /// In the reference's frame (1/16 mm).
    pub x: i32,
    /// As `x`.
    pub y: i32,
    /// Bearing of the point there if the lidars stood at the same place.
    turn: u16,
}

/// Projection association: the line seen by the reference in the direction of a point.
pub(super) struct Projection<'a> {
    lines: &'a [Line],
    at: FixedPose,
    sin: i32,
    cos: i32,
    /// Turn and half a line's width.
    turn: u16,
    /// Half a line's width.
    half: u16,
}

impl<'a> Projection<'a> {
    pub fn new(lines: &'a [Line], at: FixedPose) -> Self {
        let (sin, cos) = math::sin_cos_q15_fine(at.turn);
        let half = (32_768 / (lines.len() as u32).max(1)) as u16;
        Self {
            lines,
            at,
            sin,
            cos,
            turn: ((at.turn.wrapping_add(1 << 15) >> 16) as u16).wrapping_add(half),
            half,
        }
    }

    pub fn place(&self, point: &ScanPoint) -> Placed {
        let (px, py) = (i32::from(point.x), i32::from(point.y));
        let rx = (self.cos * px - self.sin * py + (1 << 10)) >> 11;
        let ry = (self.sin * px + self.cos * py + (1 << 10)) >> 11;
        Placed {
            rx,
            ry,
            x: rx + self.at.x,
            y: ry + self.at.y,
            turn: point.bearing.0.wrapping_add(self.turn),
        }
    }

    /// The line in the direction of the point, `None` where no surface was seen.
    ///
    /// The line where the point would be if the lidars stood at one place tells how far off that is, to first order:
    /// enough for a few lines, and for no more. Farther off, the direction is worked out.
    pub fn line(&self, placed: &Placed) -> Option<&'a Line> {
        const NEAR: i32 = 2;
        let bins = self.lines.len() as i32;
        let (x, y) = (placed.x >> 4, placed.y >> 4);
        let index = ((u32::from(placed.turn) * bins as u32) >> 16) as i32;
        let line = self.lines.get(index as usize)?;
        let across = i32::from(line.ux) * y - i32::from(line.uy) * x;
        let off = (across + (1 << 15)) >> 16;
        let found = if line.is_some() && (-NEAR..=NEAR).contains(&off) {
            let moved = index + off;
            if moved < 0 {
                moved + bins
            } else if moved >= bins {
                moved - bins
            } else {
                moved
            }
        } else {
            let turn = math::atan2_turn(y, x).wrapping_add(self.half);
            ((u32::from(turn) * bins as u32) >> 16) as i32
        };
        self.lines.get(found as usize).filter(|line| line.is_some())
    }
}

/// Weighted distance of a point from its line (1/16 mm); `None` beyond the gate or a metre away.
pub(super) fn residual(line: &Line, placed: &Placed, gate: u8) -> Option<i32> {
    let (dx, dy) = (
        placed.x - (i32::from(line.qx) << 4),
        placed.y - (i32::from(line.qy) << 4),
    );
    // Below 2¹⁷ the products with 13-bit normals stay in 32 bits.
    const FAR: u32 = 1 << 17;
    if dx.unsigned_abs() >= FAR || dy.unsigned_abs() >= FAR {
        return None;
    }
    let e = (i32::from(line.mx) * dx + i32::from(line.my) * dy + 512) >> 10;
    (e.unsigned_abs() >> gate < 64).then_some(e)
}

impl Sums {
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

    /// Root of the weighted mean square residual (m).
    pub fn residual(&self) -> f32 {
        if self.weight == 0 {
            return 0.0;
        }
        math::sqrt(self.cost as f32 / self.weight as f32) * 1e-3
    }

    /// The normal equations over a step (m, m, rad): `(H, -b)`, residuals in metres.
    pub fn equations(&self) -> (Sym3, [f32; 3]) {
        /// Rows carry normals in Q10; their weights were shifted out already.
        const N: f32 = 1.0 / 1024.0;
        let lever = (1u32 << self.lever_shift) as f32 * (1e-3 / 1024.0);
        let [xx, xy, xt, yy, yt, tt] = self.h.map(|v| v as f32);
        let [bx, by, bt] = self.b.map(|v| v as f32 / PER_METRE);
        (
            Sym3 {
                xx: xx * N * N,
                xy: xy * N * N,
                xt: xt * N * lever,
                yy: yy * N * N,
                yt: yt * N * lever,
                tt: tt * lever * lever,
            },
            [-bx * N, -by * N, -bt * lever],
        )
    }
}
