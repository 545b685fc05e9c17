//! The line of one point of a run, in integers.
//!
//! Its direction is that from the mean of the first third of the points around to the mean of the last third: nearly as good
//! as least squares, and whole sums do for it. Where the points bend or leave the line (a corner, clutter), windows that end
//! at the point are tried, then the smallest ones, then three points, else the line faces the lidar.

use crate::{
    math::{reciprocal, rough_length},
    scan::ScanPoint,
};

/// Most and fewest points on each side: more than 12 average the noise no further than the surface's own unevenness.
pub(super) const MOST: usize = 12;
pub(super) const FEWEST: usize = 2;
/// Three points bend if the middle one is so many standard deviations from the chord of the others, whose own noise counts.
const BENT_SIGMAS: u32 = 4;

/// Points farther than so many tenths of a standard deviation from their line end it: one of fifty is by chance.
const FLAT_TENTHS: u32 = 22;

/// How far off a line its points may be.
#[derive(Clone, Copy)]
pub(super) struct Noise {
    /// Standard deviation of a range (mm).
    pub sigma: u32,
    /// Farthest distance of a point from its line (mm).
    flat: i32,
}

impl Noise {
    pub fn new(sigma: u32) -> Self {
        Self {
            sigma,
            // So that a window's sum times 2¹⁶/n stays in 32 bits.
            flat: (FLAT_TENTHS * sigma / 10).min(2047) as i32,
        }
    }
}

/// A line's direction before it is weighted and stored.
#[derive(Clone, Copy)]
pub(super) struct Laid {
    /// Unit normal, Q10.
    pub nx: i32,
    pub ny: i32,
    /// Distance of the line from the point, along the normal (1/16 mm).
    pub offset: i32,
}

/// Points whose sums are kept: two windows to both sides of a point.
const KEPT: usize = 64;

/// Sums of a run's points up to each of those around one point: any window's sum is a difference of two.
pub(super) struct Sums<'a> {
    run: &'a [ScanPoint],
    /// Of the first k points, at k modulo [`KEPT`].
    up_to: [(i32, i32); KEPT],
    filled: usize,
}

/// Square roots of 0 to 8, Q4.
const ROOT: [i32; 9] = [0, 16, 23, 28, 32, 36, 39, 42, 45];
/// `2¹⁶/n`.
const SHARE: [i32; 2 * MOST + 2] = shares();

const fn shares() -> [i32; 2 * MOST + 2] {
    let mut table = [0; 2 * MOST + 2];
    let mut n = 1;
    while n < table.len() {
        table[n] = (1 << 16) / n as i32;
        n += 1;
    }
    table
}

impl<'a> Sums<'a> {
    pub fn new(run: &'a [ScanPoint]) -> Self {
        Self {
            run,
            up_to: [(0, 0); KEPT],
            filled: 0,
        }
    }

    /// Sums up to the farthest window of the `i`-th point.
    pub fn reach(&mut self, i: usize) {
        while self.filled < i + 2 * MOST + 1 {
            let Some(point) = self.run.get(self.filled) else {
                break;
            };
            let (x, y) = self.first(self.filled);
            self.filled += 1;
            if let Some(sum) = self.up_to.get_mut(self.filled % KEPT) {
                *sum = (x + i32::from(point.x), y + i32::from(point.y));
            }
        }
    }

    /// Sum of the first `k` points.
    fn first(&self, k: usize) -> (i32, i32) {
        self.up_to.get(k % KEPT).copied().unwrap_or_default()
    }

    /// The line of the `i`-th point, with `half` points on each side if it can be; `None` where even the smallest window
    /// bends.
    pub fn lay(&self, i: usize, half: usize, noise: Noise) -> Option<Laid> {
        let mut half = half;
        loop {
            if let Some(laid) = self.window(i, i.checked_sub(half), half, noise) {
                return Some(laid);
            }
            let behind = self.window(i, i.checked_sub(2 * half), half, noise);
            let ahead = self.window(i, Some(i), half, noise);
            if let Some(laid) = better(behind, ahead) {
                return Some(laid);
            }
            if half <= FEWEST {
                return None;
            }
            half = FEWEST;
        }
    }

    /// The line through `2 half + 1` points from the `from`-th on; `None` where they bend or the `i`-th is not on it.
    fn window(&self, i: usize, from: Option<usize>, half: usize, noise: Noise) -> Option<Laid> {
        let (from, n) = (from?, 2 * half + 1);
        let (first, last) = (self.run.get(from)?, self.run.get(from + n - 1)?);
        let point = self.run.get(i)?;
        let (px, py) = (i32::from(point.x), i32::from(point.y));
        let third = n.div_ceil(3).min(ROOT.len() - 1);
        let sum = |from: usize, to: usize| {
            let ((ax, ay), (bx, by)) = (self.first(from), self.first(to));
            let count = (to - from) as i32;
            (bx - ax - count * px, by - ay - count * py)
        };
        let begin = sum(from, from + third);
        let end = sum(from + n - third, from + n);
        let all = sum(from, from + n);
        let (nx, ny) = normal(end.0 - begin.0, end.1 - begin.1)?;
        // In 1/16 mm, times the points that it is a sum of.
        let across =
            |(x, y): (i32, i32)| (nx.wrapping_mul(x).wrapping_add(ny.wrapping_mul(y))) >> 6;
        let flat = 16 * noise.flat;
        let sum = across(all);
        if sum.abs() >= flat * n as i32 {
            return None;
        }
        let offset = (sum * SHARE.get(n)? + (1 << 15)) >> 16;
        // The middle's mean from the mean of both ends: its noise is less by the root of their number.
        let outer = across(begin) + across(end);
        let (t, m) = (third as i32, (n - 2 * third) as i32);
        let bend = 2 * (sum - outer) * t - outer * m;
        if bend.abs() >= (2 * flat * m * ROOT.get(third)?) >> 4 {
            return None;
        }
        let off = |p: &ScanPoint| across((i32::from(p.x) - px, i32::from(p.y) - py)) - offset;
        let ends = off(first).abs().max(off(last).abs());
        (2 * ends < 3 * flat).then_some(Laid { nx, ny, offset })
    }
}

/// The line that is nearer to the point.
fn better(a: Option<Laid>, b: Option<Laid>) -> Option<Laid> {
    match (a, b) {
        (Some(a), Some(b)) if b.offset.abs() < a.offset.abs() => Some(b),
        (a, b) => a.or(b),
    }
}

/// The line of a point in clutter: through three points, or facing the lidar.
pub(super) fn few(
    run: &[ScanPoint],
    i: usize,
    point: &ScanPoint,
    inverse: u32,
    noise: Noise,
) -> Laid {
    let three = |from: Option<usize>| three(run, from?, point, noise);
    three(i.checked_sub(1))
        .or_else(|| better(three(i.checked_sub(2)), three(Some(i))))
        .unwrap_or_else(|| facing(point, inverse))
}

/// Line through the three points from the `from`-th on, one of which is `point`; `None` where they bend.
fn three(run: &[ScanPoint], from: usize, point: &ScanPoint, noise: Noise) -> Option<Laid> {
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
    let bent = (BENT_SIGMAS * noise.sigma) as i32;
    ((b - a).abs() < bent << 10).then_some(Laid {
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
