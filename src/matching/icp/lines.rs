//! Laying lines through the points of a scan, in integers.
//!
//! Neighbouring points that are near each other form a run. A line's direction is the chord between the means of
//! the K points before and the K after; where the points next to it leave that chord (a corner, clutter) the line
//! is borrowed from a neighbour that has a good one, else laid through three points, else it faces the lidar.

use crate::{
    matching::icp::reference::Line,
    math::{reciprocal, rough_length},
    scan::ScanPoint,
};

/// Half the length of wall that a line is laid through, where the points are dense enough (mm).
///
/// Longer lines average more noise, shorter ones keep more corners; anything from 80 to 300 gives the same accuracy
/// to a few per cent.
const HALF_WINDOW_MM: u32 = 150;
/// Most and fewest points on each side.
const MOST: usize = 8;
const FEWEST: usize = 2;
/// Points farther than this from their chord end it (mm): twice the noise of a cheap lidar.
const FLAT_MM: i32 = 22;
/// Three points bend if the middle one is this far from the chord of the others (mm).
const BENT_MM: i32 = 40;
/// Two neighbours belong to one surface if their ranges differ by less than this (mm) and ...
const GAP_MM: u32 = 100;
/// ... this many times their distance across the beams: walls down to 7° of grazing.
const GAP_SLOPE: u32 = 8;
/// Widest angle between two neighbours (1/65536 turn): 5.5°.
const GAP_TURN: u32 = 1000;

/// 1/K and 1/(2K + 1) in Q15.
const PER_SIDE: [i32; MOST + 1] = [0, 32768, 16384, 10923, 8192, 6554, 5461, 4681, 4096];
const PER_WINDOW: [i32; MOST + 1] = [32768, 10923, 6554, 4681, 3641, 2979, 2521, 2185, 1928];

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
    let mut count = 0;
    let mut rest = points;
    while let Some((run, others)) = rest.split_at_checked(run_length(rest)) {
        if run.is_empty() {
            break;
        }
        count += lay_run(lines, run, grid);
        rest = others;
    }
    count
}

/// Number of points from the first on that lie on one surface.
fn run_length(points: &[ScanPoint]) -> usize {
    let breaks = points.windows(2).position(|pair| {
        let [a, b] = pair else { return true };
        let turn = u32::from((b.bearing.0.wrapping_sub(a.bearing.0) as i16).unsigned_abs());
        if turn > GAP_TURN {
            return true;
        }
        let (near, far) = if a.range < b.range {
            (a.range, b.range)
        } else {
            (b.range, a.range)
        };
        // 2π/65536 is 25.13/2¹⁸.
        let across = (u32::from(near) * turn * 25) >> 18;
        u32::from(far - near) > GAP_MM + GAP_SLOPE * across
    });
    breaks.map_or(points.len(), |at| at + 1)
}

/// Where a bearing falls among the lines.
#[derive(Clone, Copy)]
struct Grid {
    bins: u32,
    /// Lines per radian, Q6.
    per_radian: u32,
}

impl Grid {
    fn new(bins: usize) -> Self {
        let bins = bins as u32;
        // 1/2π in Q16 is 10 430.
        Self {
            bins,
            per_radian: (bins * 10_430) >> 10,
        }
    }

    fn bin(self, point: &ScanPoint) -> usize {
        // Half a line's width on, so that a bearing falls to the nearest line.
        let half = 32_768 / self.bins;
        ((u32::from(point.bearing.0.wrapping_add(half as u16)) * self.bins) >> 16) as usize
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

/// Lays the lines of one run.
fn lay_run(lines: &mut [Line], run: &[ScanPoint], grid: Grid) -> u16 {
    let mut before = None;
    for (i, point) in run.iter().enumerate() {
        let half = half_window(point, grid);
        // A run's ends have fewer points on one side: take as many on the other.
        let half = half.min(i).min(run.len() - 1 - i);
        let laid = if half >= FEWEST {
            centred(run, i, half)
        } else {
            None
        };
        let bin = grid.bin(point);
        let line = laid.map_or(Line::NONE, |laid| store(point, &laid, grid, false));
        if let Some(slot) = lines.get_mut(bin) {
            *slot = line;
        }
        fill_between(lines, before, bin, line);
        before = Some(bin);
    }
    let mut count = 0;
    for (i, point) in run.iter().enumerate() {
        let bin = grid.bin(point);
        if lines.get(bin).is_some_and(|line| !line.is_some()) {
            let half = half_window(point, grid);
            let borrowed = [
                i + half,
                i.wrapping_sub(half),
                i + FEWEST,
                i.wrapping_sub(FEWEST),
            ]
            .into_iter()
            .find_map(|from| borrow(lines.get(grid.bin(run.get(from)?))?, point));
            let line = match borrowed {
                Some(laid) => store(point, &laid, grid, false),
                None => {
                    let laid = [i.wrapping_sub(1), i, i.wrapping_sub(2)]
                        .into_iter()
                        .find_map(|from| three(run, from, point));
                    store(point, &laid.unwrap_or(facing(point)), grid, true)
                }
            };
            if let Some(slot) = lines.get_mut(bin) {
                *slot = line;
            }
        }
        count += 1;
    }
    count
}

/// Points on each side of `point` that make up half a window.
fn half_window(point: &ScanPoint, grid: Grid) -> usize {
    // window / (range · angle between two lines): Q24 · Q6 · mm.
    let half = ((reciprocal(u32::from(point.range)) >> 6)
        * ((grid.per_radian * HALF_WINDOW_MM) >> 6))
        >> 18;
    (half as usize).clamp(FEWEST, MOST)
}

/// Line through the means of the `half` points before and after the `i`-th; `None` where the points leave it.
fn centred(run: &[ScanPoint], i: usize, half: usize) -> Option<Laid> {
    let point = run.get(i)?;
    let (first, last) = (run.get(i - half)?, run.get(i + half)?);
    let (ax, ay) = sum(run.get(i + 1..=i + half)?);
    let (bx, by) = sum(run.get(i - half..i)?);
    let per_side = *PER_SIDE.get(half)?;
    let (dx, dy) = (((ax - bx) * per_side) >> 15, ((ay - by) * per_side) >> 15);
    let (nx, ny) = normal(dx, dy)?;
    let per_window = *PER_WINDOW.get(half)?;
    let (px, py) = (i32::from(point.x), i32::from(point.y));
    // Relative to the point, so that the products stay small.
    let n = 2 * half as i32;
    let (mx, my) = (
        ((ax + bx - n * px) * per_window + (1 << 14)) >> 15,
        ((ay + by - n * py) * per_window + (1 << 14)) >> 15,
    );
    let offset = nx * mx + ny * my;
    let off = |p: &ScanPoint| nx * (i32::from(p.x) - px) + ny * (i32::from(p.y) - py) - offset;
    let limit = FLAT_MM << 10;
    let flat = offset.abs() < limit && off(first).abs() < limit && off(last).abs() < limit;
    flat.then_some(Laid {
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
    let sum = a + b + c;
    // One of the three is the point itself: on a straight line the sum is a few centimetres.
    ((b - a).abs() < BENT_MM << 10 && sum.abs() < 1 << 22).then(|| Laid {
        nx,
        ny,
        // A third of the sum, in 1/16 mm.
        offset: (sum * 341 + (1 << 15)) >> 16,
    })
}

/// A surface that faces the lidar: all that can be said of a point on its own.
fn facing(point: &ScanPoint) -> Laid {
    let inverse = reciprocal(u32::from(point.range)) as i32;
    Laid {
        nx: (i32::from(point.x) * inverse) >> 14,
        ny: (i32::from(point.y) * inverse) >> 14,
        offset: 0,
    }
}

/// Unit normal (Q10, to 4 %) of the direction `(dx, dy)` (mm); `None` for one shorter than 5 mm.
fn normal(dx: i32, dy: i32) -> Option<(i32, i32)> {
    let (mut dx, mut dy) = (dx, dy);
    let mut length = rough_length(dx, dy);
    if length < 5 {
        return None;
    }
    // The reciprocal wants 128 to 32 767.
    while length < 256 {
        (dx, dy, length) = (dx << 2, dy << 2, length << 2);
    }
    while length > 32_767 {
        (dx, dy, length) = (dx >> 1, dy >> 1, length >> 1);
    }
    let inverse = reciprocal(length) as i32;
    Some(((-dy * inverse) >> 14, (dx * inverse) >> 14))
}

fn sum(points: &[ScanPoint]) -> (i32, i32) {
    points
        .iter()
        .fold((0, 0), |(x, y), p| (x + i32::from(p.x), y + i32::from(p.y)))
}

/// Weights the normal and finds what leads to the line's place among the others.
fn store(point: &ScanPoint, laid: &Laid, grid: Grid, doubtful: bool) -> Line {
    let (px, py) = (i32::from(point.x), i32::from(point.y));
    let inverse = reciprocal(u32::from(point.range));
    // |cos β| = |n · p| / |p|: Q10.
    let cos = (((laid.nx * px + laid.ny * py).unsigned_abs() >> 8) * inverse) >> 16;
    let mut weight = i32::from(WEIGHT.get((cos >> 5) as usize).copied().unwrap_or(1000));
    if doubtful {
        weight = (weight * 3) >> 2;
    }
    // Lines per radian over the distance: Q16 a millimetre.
    let pull = ((inverse >> 4) * grid.per_radian) >> 10;
    let towards = |p: i32| {
        let unit = (p * inverse as i32) >> 9;
        let u = (unit * (if pull > 16_383 { 16_383 } else { pull as i32 })) >> 15;
        u as i16
    };
    Line {
        qx: (px + ((laid.nx * laid.offset + (1 << 13)) >> 14)) as i16,
        qy: (py + ((laid.ny * laid.offset + (1 << 13)) >> 14)) as i16,
        mx: ((laid.nx * weight + 512) >> 10) as i16,
        my: ((laid.ny * weight + 512) >> 10) as i16,
        ux: towards(px),
        uy: towards(py),
    }
}

/// Gives a line that stayed empty between two neighbours on one surface to the later one.
fn fill_between(lines: &mut [Line], before: Option<usize>, bin: usize, line: Line) {
    let Some(before) = before else { return };
    let between = if bin == before + 2 {
        before + 1
    } else if before == bin + 2 {
        bin + 1
    } else {
        return;
    };
    if let Some(slot) = lines.get_mut(between) {
        *slot = line;
    }
}
