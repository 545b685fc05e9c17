//! Laying lines through the points of a scan, in integers.
//!
//! Neighbouring points that are near each other form a run; each of its directions gets the line of a point there, and those
//! between two points the nearer one's. No direction comes first: a scan and its mirror image give mirrored lines.

use crate::{
    matching::icp::projective::{
        line::Line,
        line_fit::{FEWEST, Laid, MOST, Noise, Sums, few},
        range_noise::{self, RangeNoise},
    },
    math::{self, reciprocal},
    scan::{
        ScanPoint,
        slots::Slots,
        surface::{Gap, turn_between},
    },
};

/// Half the length of wall that a line is laid through, in standard deviations of a range: a normal through two points
/// so far to both sides is good to 1/15 · 1/√2 = 2.7°, through more of them to less.
const HALF_WINDOW_SIGMAS: u32 = 15;
/// Two beams of a full turn, and no more than this apart (1/65536 turn, 12°), are neighbours, however few there are.
const WIDEST_GAP: u32 = 2200;

/// Neighbours at least this many lines apart share those between.
const WIDEST_FILL: usize = 4;

/// Weight of a line by the cosine of the angle at which the beam hits it, in 32 steps: Q10.
///
/// Noise lies along the beam, so a residual across the surface has `σ cos β` of it: the weight is the
/// inverse, `1/√(cos²β + 0.6²)`, where 0.6 stands for all other noise: the beam's footprint, the surface's own unevenness,
/// the line's error where it is seen at a slant.
const WEIGHT: [u16; 34] = weights();

const fn weights() -> [u16; 34] {
    let mut table = [0; 34];
    let mut i = 0;
    while i < 34 {
        // cos² + 0.6² in Q20, its root in Q10.
        let cos = 32 * i as u32;
        let root = math::isqrt(cos * cos + 377_487);
        table[i] = ((1 << 20) / root) as u16;
        i += 1;
    }
    table
}

/// What the scan's beams decide of how lines are laid.
#[derive(Clone, Copy)]
struct Scale {
    noise: RangeNoise,
    /// By the usual range.
    usual: Noise,
    gap: Gap,
    /// Most lines from one neighbour to the next that are filled between.
    fill: usize,
}

impl Scale {
    fn new(points: &[ScanPoint], bins: usize) -> Self {
        let count = points.len().max(1);
        let mut gap = Gap::WALL;
        let two_beams = (2 * 65_536 / (count as u32).max(1)).min(WIDEST_GAP) as u16;
        gap.widest = gap.widest.max(two_beams);
        let noise = range_noise::estimate(points, gap.widest);
        let sigma = u32::from(noise.sigma);
        // Neighbours of one surface are one range apart, whose noise is that of two.
        gap.mm = gap.mm.max(6 * sigma);
        Self {
            noise,
            usual: Noise::new(sigma),
            gap,
            fill: (3 * bins / (2 * count)).max(WIDEST_FILL),
        }
    }
}

/// Fills `lines` from `points`; gives the number of points that have one, and the noise of the ranges.
pub(super) fn lay(lines: &mut [Line], points: &[ScanPoint]) -> (u16, RangeNoise) {
    lines.fill(Line::NONE);
    let grid = Grid::new(lines.len());
    let scale = Scale::new(points, lines.len());
    let mut rest = points;
    while let Some((run, others)) = rest.split_at_checked(run_length(rest, scale)) {
        if run.is_empty() {
            break;
        }
        lay_run(lines, run, grid, scale);
        rest = others;
    }
    (points.len() as u16, scale.noise)
}

/// Number of points from the first on that lie on one surface, by their ranges: [`Gap::run_length`] by places would cost
/// two products a point.
fn run_length(points: &[ScanPoint], Scale { noise, gap, .. }: Scale) -> usize {
    let breaks = points.windows(2).position(|pair| {
        let [a, b] = pair else { return true };
        let step = u32::from(a.range.abs_diff(b.range));
        let range = a.range.min(b.range);
        let mut gap = gap;
        if noise.share > 0 {
            gap.mm = gap.mm.max(6 * noise.at(range));
        }
        !gap.joins(turn_between(a, b), range, step)
    });
    breaks.map_or(points.len(), |at| at + 1)
}

/// Where a bearing falls among the lines.
#[derive(Clone, Copy)]
struct Grid {
    slots: Slots,
    /// Lines per radian, Q6.
    per_radian: u32,
}

impl Grid {
    fn new(bins: usize) -> Self {
        // 1/2π in Q16 is 10 430.
        Self {
            slots: Slots::new(bins),
            per_radian: (bins as u32 * 10_430) >> 10,
        }
    }

    fn bin(self, point: &ScanPoint) -> usize {
        self.slots.of(point.bearing.0)
    }

    /// Angle between a point and the middle of a line's directions (1/65536 turn).
    fn off(self, point: &ScanPoint, bin: usize) -> u16 {
        (point.bearing.0.wrapping_sub(self.slots.middle(bin)) as i16).unsigned_abs()
    }
}

/// Points of a run that one half of a window has at a metre's distance, Q6: see [`Density::half_window`].
#[derive(Clone, Copy)]
struct Density(u32);

impl Density {
    /// By the angle between the first and the last point of a run.
    fn new(run: &[ScanPoint]) -> Self {
        let (Some(first), Some(last)) = (run.first(), run.last()) else {
            return Self(0);
        };
        // A run of more than half a turn is so dense that the bound below holds anyway.
        let span = u32::from((last.bearing.0.wrapping_sub(first.bearing.0) as i16).unsigned_abs());
        // Points per radian, Q6: 65536/2π in Q6 is 667 544.
        // A thousand points per radian are more than any window wants.
        Self(((run.len() as u32).saturating_mul(667_544) / span.max(64)).min(1 << 16))
    }

    /// Points on each side that make up half a window of `window` mm, for a point at `1/inverse`.
    fn half_window(self, inverse: u32, window: u32) -> usize {
        // window · points per radian / range: mm · Q6 · Q18.
        let half = ((inverse >> 6) * ((self.0 * window) >> 6).min(1 << 20)) >> 18;
        (half as usize).clamp(FEWEST, MOST)
    }
}

/// Lays a line for each direction of a run.
fn lay_run(lines: &mut [Line], run: &[ScanPoint], grid: Grid, scale: Scale) {
    let density = Density::new(run);
    let mut sums = Sums::new(run);
    let mut before = None;
    for (i, point) in run.iter().enumerate() {
        let bin = grid.bin(point);
        // One line for the points of a direction: the one nearest to its middle, whichever comes first.
        let next = run.get(i + 1).filter(|next| grid.bin(next) == bin);
        if before == Some(bin)
            || next.is_some_and(|next| grid.off(next, bin) < grid.off(point, bin))
        {
            continue;
        }
        let inverse = reciprocal(u32::from(point.range));
        let noise = if scale.noise.share == 0 {
            scale.usual
        } else {
            Noise::new(scale.noise.at(point.range))
        };
        let half = density.half_window(inverse, HALF_WINDOW_SIGMAS * noise.sigma);
        sums.reach(i);
        let laid = sums
            .lay(i, half, noise)
            .unwrap_or_else(|| few(run, i, point, inverse, noise));
        if let Some(slot) = lines.get_mut(bin) {
            store(slot, point, &laid, (inverse, scale.noise), grid);
        }
        fill_between(lines, before, bin, scale.fill);
        before = Some(bin);
    }
}

/// Weights the normal and finds what leads to the line's place among the others.
fn store(
    slot: &mut Line,
    point: &ScanPoint,
    laid: &Laid,
    (inverse, noise): (u32, RangeNoise),
    grid: Grid,
) {
    let (px, py) = (i32::from(point.x), i32::from(point.y));
    // A point whose range is not its distance, which no scan has, gives a wrong line: hence the wrapping.
    // |cos β| = |n · p| / |p|: Q10.
    let cos = ((laid.nx * px + laid.ny * py).unsigned_abs() >> 8).wrapping_mul(inverse) >> 16;
    let mut weight = i32::from(WEIGHT.get((cos >> 5) as usize).copied().unwrap_or(1000));
    if noise.share > 0 {
        // By the standard deviation of this range, too: a sixth to 2.2 times as much.
        weight = weight * i32::from(noise.sigma) / (noise.at(point.range) as i32).max(1);
    }
    // Direction, and lines per radian over the distance: Q15 and Q16 a millimetre.
    let pull = ((((inverse >> 4) * grid.per_radian) >> 10).min(16_383)) as i32;
    let towards = |p: i32| ((p.wrapping_mul(inverse as i32) >> 9).wrapping_mul(pull) >> 15) as i16;
    *slot = Line {
        qx: foot(px, laid.nx * laid.offset),
        qy: foot(py, laid.ny * laid.offset),
        mx: ((laid.nx * weight + 512) >> 10) as i16,
        my: ((laid.ny * weight + 512) >> 10) as i16,
        ux: towards(px),
        uy: towards(py),
    };
}

/// A coordinate of a point moved to its line (mm): -32 768 would be no line.
fn foot(place: i32, moved: i32) -> i16 {
    (place + ((moved + (1 << 13)) >> 14)).clamp(-32_767, 32_767) as i16
}

/// Gives the lines between two neighbours on one surface, where there are more lines than points, to the nearer one of
/// them, the one in the middle to that nearer to the lidar.
fn fill_between(lines: &mut [Line], before: Option<usize>, bin: usize, most: usize) {
    let Some(before) = before else { return };
    let (low, high) = if before < bin {
        (before, bin)
    } else {
        (bin, before)
    };
    if !(2..=most).contains(&(high - low)) {
        return;
    }
    let (Some(&a), Some(&b)) = (lines.get(low), lines.get(high)) else {
        return;
    };
    let square = |l: Line| i32::from(l.qx).pow(2).wrapping_add(i32::from(l.qy).pow(2)) as u32;
    let between = high - low - 1;
    let lower = between / 2 + usize::from(between % 2 == 1 && square(a) <= square(b));
    if let Some((first, second)) = lines
        .get_mut(low + 1..high)
        .and_then(|between| between.split_at_mut_checked(lower))
    {
        first.fill(a);
        second.fill(b);
    }
}
