//! Laying lines through the points of a scan, in integers.
//!
//! Neighbouring points that are near each other form a run. A line's direction is the chord between the means of
//! the K points before and the K after; where the points next to it leave that chord (a corner, clutter) the line
//! is borrowed from a neighbour that has a good one, else laid through three points, else it faces the lidar.

use crate::{
    matching::icp::projective::line::Line,
    math::{reciprocal, rough_length},
    scan::{
        ScanPoint,
        slots::Slots,
        surface::{Gap, turn_between},
    },
};

/// Half the length of wall that a line is laid through, where the points are dense enough (mm).
///
/// Longer lines average more noise, shorter ones keep more corners; anything from 80 to 300 gives the same accuracy
/// to a few per cent.
const HALF_WINDOW_MM: u32 = 150;
/// Most and fewest points on each side.
const MOST: usize = 6;
const FEWEST: usize = 2;
/// Points farther than this from their chord end it (mm): twice the noise of a cheap lidar.
const FLAT_MM: i32 = 22;
/// Three points bend if the middle one is this far from the chord of the others (mm).
const BENT_MM: i32 = 40;
/// Neighbours this many lines apart share those between.
const WIDEST_FILL: usize = 4;

/// Weight of a line by the cosine of the angle at which the beam hits it, in 32 steps: Q10.
///
/// Noise lies along the beam, so a residual across the surface has `σ cos β` of it: the weight is the
/// inverse, `1/√(cos²β + 0.2²)`, where 0.2 stands for all other noise.
const WEIGHT: [u16; 34] = weights();

const fn weights() -> [u16; 34] {
    let mut table = [0; 34];
    let mut i = 0;
    while i < 34 {
        // cos² + 0.2² in Q20, its root in Q10.
        let cos = 32 * i as u32;
        let root = crate::math::isqrt(cos * cos + 41_943);
        table[i] = ((1 << 20) / root) as u16;
        i += 1;
    }
    table
}

/// Fills `lines` from `points`; gives the number of points that have one.
pub(super) fn lay(lines: &mut [Line], points: &[ScanPoint]) -> u16 {
    lines.fill(Line::NONE);
    let grid = Grid::new(lines.len());
    let mut rest = points;
    while let Some((run, others)) = rest.split_at_checked(run_length(rest)) {
        if run.is_empty() {
            break;
        }
        if lay_flat(lines, run, grid) {
            lay_others(lines, run, grid);
        }
        rest = others;
    }
    points.len() as u16
}

/// Number of points from the first on that lie on one surface, by their ranges: [`Gap::run_length`] by places would cost
/// two products a point.
fn run_length(points: &[ScanPoint]) -> usize {
    let breaks = points.windows(2).position(|pair| {
        let [a, b] = pair else { return true };
        let step = u32::from(a.range.abs_diff(b.range));
        !Gap::WALL.joins(turn_between(a, b), a.range.min(b.range), step)
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

    /// Points on each side that make up half a window, for a point at `1/inverse`.
    fn half_window(self, inverse: u32) -> usize {
        // window · points per radian / range: mm · Q6 · Q18.
        let half = ((inverse >> 6) * ((self.0 * HALF_WINDOW_MM) >> 6)) >> 18;
        (half as usize).clamp(FEWEST, MOST)
    }
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
}

/// A line's direction before it is weighted and stored.
struct Laid {
    /// Unit normal, Q10.
    nx: i32,
    ny: i32,
    /// Distance of the line from the point, along the normal (1/16 mm).
    offset: i32,
}

/// Lays lines where a run is straight; empties the places of its other points, and tells whether there are any.
fn lay_flat(lines: &mut [Line], run: &[ScanPoint], grid: Grid) -> bool {
    let mut bent = false;
    let mut before = None;
    let last = run.len().saturating_sub(1);
    let density = Density::new(run);
    for (i, point) in run.iter().enumerate() {
        let bin = grid.bin(point);
        // One line for the points of a direction.
        if before == Some(bin) {
            continue;
        }
        let inverse = reciprocal(u32::from(point.range));
        // A run's ends have fewer points on one side: take as many on the other.
        let half = density.half_window(inverse).min(i).min(last - i);
        let Some(slot) = lines.get_mut(bin) else {
            continue;
        };
        match centred(run, i, half) {
            Some(laid) => store(slot, point, &laid, inverse, grid, false),
            None => {
                *slot = Line::NONE;
                bent = true;
            }
        }
        fill_between(lines, before, bin);
        before = Some(bin);
    }
    bent
}

/// Lays lines through the points of a run that have none yet.
fn lay_others(lines: &mut [Line], run: &[ScanPoint], grid: Grid) {
    let density = Density::new(run);
    for (i, point) in run.iter().enumerate() {
        let bin = grid.bin(point);
        if lines.get(bin).is_none_or(Line::is_some) {
            continue;
        }
        let inverse = reciprocal(u32::from(point.range));
        let half = density.half_window(inverse);
        let borrowed = [
            i + half,
            i.wrapping_sub(half),
            i + FEWEST,
            i.wrapping_sub(FEWEST),
        ]
        .into_iter()
        .find_map(|from| borrow(lines.get(grid.bin(run.get(from)?))?, point));
        let Some(slot) = lines.get_mut(bin) else {
            continue;
        };
        if let Some(laid) = borrowed {
            store(slot, point, &laid, inverse, grid, false);
            continue;
        }
        let laid = [i.wrapping_sub(1), i, i.wrapping_sub(2)]
            .into_iter()
            .find_map(|from| three(run, from, point))
            .unwrap_or_else(|| facing(point, inverse));
        store(slot, point, &laid, inverse, grid, true);
    }
}

/// Line along the chord between the `half`-th points before and after the `i`-th; `None` where the `i`-th or those half
/// way leave it.
fn centred(run: &[ScanPoint], i: usize, half: usize) -> Option<Laid> {
    if half < FEWEST {
        return None;
    }
    let (point, first, last) = (run.get(i)?, run.get(i - half)?, run.get(i + half)?);
    let (px, py) = (i32::from(point.x), i32::from(point.y));
    let (fx, fy) = (i32::from(first.x), i32::from(first.y));
    let (nx, ny) = normal(i32::from(last.x) - fx, i32::from(last.y) - fy)?;
    // The mean of the three: the ends lie on the chord, the point does not.
    let offset = (((nx * (fx - px) + ny * (fy - py)) >> 2) * 43) >> 4;
    let (before, after) = (run.get(i - half / 2)?, run.get(i + half / 2)?);
    let off = |p: &ScanPoint| nx * (i32::from(p.x) - px) + ny * (i32::from(p.y) - py) - offset;
    let flat = |v: i32| v.abs() < FLAT_MM << 10;
    (flat(offset) && flat(off(before)) && flat(off(after))).then_some(Laid {
        nx,
        ny,
        offset: (offset + 32) >> 6,
    })
}

/// The neighbour's line, if the point lies on it.
fn borrow(line: &Line, point: &ScanPoint) -> Option<Laid> {
    if !line.is_some() {
        return None;
    }
    let (nx, ny) = normal(i32::from(line.my), -i32::from(line.mx))?;
    let (dx, dy) = (
        i32::from(line.qx) - i32::from(point.x),
        i32::from(line.qy) - i32::from(point.y),
    );
    let offset = nx * dx + ny * dy;
    (offset.abs() < FLAT_MM << 10).then_some(Laid {
        nx,
        ny,
        offset: (offset + 32) >> 6,
    })
}

/// Line through the three points from the `from`-th on, one of which is `point`; `None` where they bend.
fn three(run: &[ScanPoint], from: usize, point: &ScanPoint) -> Option<Laid> {
    let [first, middle, last] = run.get(from..from.checked_add(3)?)? else {
        return None;
    };
    let (nx, ny) = normal(
        i32::from(last.x) - i32::from(first.x),
        i32::from(last.y) - i32::from(first.y),
    )?;
    let off = |p: &ScanPoint| {
        nx * (i32::from(p.x) - i32::from(point.x)) + ny * (i32::from(p.y) - i32::from(point.y))
    };
    let (a, b, c) = (off(first), off(middle), off(last));
    ((b - a).abs() < BENT_MM << 10).then_some(Laid {
        nx,
        ny,
        // A third of the sum, in 1/16 mm.
        offset: (((a >> 6) + (b >> 6) + (c >> 6)) * 341 + (1 << 9)) >> 10,
    })
}

/// A surface that faces the lidar: all that can be said of a point on its own.
fn facing(point: &ScanPoint, inverse: u32) -> Laid {
    Laid {
        nx: i32::from(point.x).wrapping_mul(inverse as i32) >> 14,
        ny: i32::from(point.y).wrapping_mul(inverse as i32) >> 14,
        offset: 0,
    }
}

/// Unit normal (Q10, to 4 %) of the direction `(dx, dy)` (mm); `None` for one shorter than 5 mm.
fn normal(dx: i32, dy: i32) -> Option<(i32, i32)> {
    let (mut dx, mut dy) = (dx, dy);
    let mut length = rough_length(dx, dy);
    // The reciprocal wants 128 to 32 767.
    if length < 128 {
        if length < 5 {
            return None;
        }
        (dx, dy, length) = (dx << 5, dy << 5, length << 5);
    }
    while length > 32_767 {
        (dx, dy, length) = (dx >> 2, dy >> 2, length >> 2);
    }
    let inverse = reciprocal(length) as i32;
    Some(((-dy * inverse) >> 14, (dx * inverse) >> 14))
}

/// Weights the normal and finds what leads to the line's place among the others.
fn store(
    slot: &mut Line,
    point: &ScanPoint,
    laid: &Laid,
    inverse: u32,
    grid: Grid,
    doubtful: bool,
) {
    let (px, py) = (i32::from(point.x), i32::from(point.y));
    // A point whose range is not its distance, which no scan has, gives a wrong line: hence the wrapping.
    // |cos β| = |n · p| / |p|: Q10.
    let cos = ((laid.nx * px + laid.ny * py).unsigned_abs() >> 8).wrapping_mul(inverse) >> 16;
    let mut weight = i32::from(WEIGHT.get((cos >> 5) as usize).copied().unwrap_or(1000));
    if doubtful {
        weight = (weight * 3) >> 2;
    }
    // Direction, and lines per radian over the distance: Q15 and Q16 a millimetre.
    let pull = ((((inverse >> 4) * grid.per_radian) >> 10).min(16_383)) as i32;
    let towards = |p: i32| ((p.wrapping_mul(inverse as i32) >> 9).wrapping_mul(pull) >> 15) as i16;
    *slot = Line {
        qx: (px + ((laid.nx * laid.offset + (1 << 13)) >> 14)) as i16,
        qy: (py + ((laid.ny * laid.offset + (1 << 13)) >> 14)) as i16,
        mx: ((laid.nx * weight + 512) >> 10) as i16,
        my: ((laid.ny * weight + 512) >> 10) as i16,
        ux: towards(px),
        uy: towards(py),
    };
}

/// Gives the lines between two neighbours on one surface, where there are more lines than points, to the later one.
fn fill_between(lines: &mut [Line], before: Option<usize>, bin: usize) {
    let Some(before) = before else { return };
    let (low, high) = if before < bin {
        (before, bin)
    } else {
        (bin, before)
    };
    if !(2..=WIDEST_FILL).contains(&(high - low)) {
        return;
    }
    let Some(&line) = lines.get(bin) else { return };
    if let Some(between) = lines.get_mut(low + 1..high) {
        between.fill(line);
    }
}
