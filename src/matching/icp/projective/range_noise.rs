//! Noise of a lidar's ranges, from one of its scans.

use crate::scan::{
    ScanPoint,
    surface::{Gap, across_mm},
};

/// Standard deviation of a range, as a scan itself shows it, by the range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RangeNoise {
    /// Of a usual range (mm): 10 to 80, to 160 where it grows.
    pub sigma: u8,
    /// What it grows by with the range, Q12; 0 where it is the same at any range.
    pub share: u8,
}

impl RangeNoise {
    /// Of no scan.
    pub const NONE: Self = Self { sigma: 0, share: 0 };

    /// Standard deviation (mm) of a range (mm). Half of the usual one and what grows; at most six times the usual one, so
    /// that normals weighed by it stay longer than 128, which their reciprocal wants.
    #[inline(always)]
    pub fn at(self, range: u16) -> u32 {
        let usual = u32::from(self.sigma);
        if self.share == 0 {
            return usual;
        }
        let grown = usual / 2 + ((u32::from(self.share) * u32::from(range)) >> 12);
        grown.min(6 * usual)
    }
}

/// Least and largest standard deviation that is told (mm).
///
/// 10: surfaces, footprints and mixed pixels add what one beam after another does not show; a cheap lidar's data sheet says
/// as much. 80: twice what any data sheet allows; more is clutter.
const LEAST: u32 = 10;
const LARGEST: u32 = 80;
/// Largest where it grows with the range: 3.5 % of 5 m.
const LARGEST_GROWN: u32 = 160;
/// Two ranges two beams apart may differ by a sixteenth of the range and by twice their distance: more than noise of 3.5 % of it, and
/// walls seen at less than about 70°.
const NOISY: u32 = 16;
/// Places that are looked at, about: the estimate is then good to a tenth.
const ENOUGH: usize = 128;

/// Differences are counted in so many steps: 2 mm below 64 mm, an eighth of the power of two from there to 1024 mm.
const STEPS: usize = 64;

/// The step that a difference (mm) falls into.
const fn step_of(difference: u32) -> usize {
    if difference < 64 {
        return (difference / 2) as usize;
    }
    let octave = 25 - difference.leading_zeros();
    (32 + 8 * octave + ((difference >> (3 + octave)) & 7)) as usize
}

/// Where a step begins (mm): the smallest difference that falls into it.
const fn start_of(step: usize) -> u32 {
    let step = step as u32;
    if step < 32 {
        return 2 * step;
    }
    (8 + (step & 7)) << (3 + (step - 32) / 8)
}

/// Differences of one half of the ranges.
struct Half {
    counts: [u8; STEPS],
    all: u32,
    /// Sum of their ranges (mm).
    ranges: u32,
}

impl Half {
    const EMPTY: Self = Self {
        counts: [0; STEPS],
        all: 0,
        ranges: 0,
    };

    fn push(&mut self, difference: u32, range: u16) {
        if let Some(count) = self.counts.get_mut(step_of(difference).min(STEPS - 1)) {
            *count = count.saturating_add(1);
            self.all += 1;
            self.ranges += u32::from(range);
        }
    }
}

/// What some quarters of the differences are smaller than, and a range's standard deviation over that, in 26ths.
struct Quantile {
    quarters: u32,
    per_sigma: u32,
}

/// A difference has the variance of 1 + 2/4 ranges. Half of normal ones are below 0.6745 of their standard deviation, a quarter
/// below 0.3186.
const MEDIAN: Quantile = Quantile {
    quarters: 2,
    per_sigma: 31,
};
const QUARTILE: Quantile = Quantile {
    quarters: 1,
    per_sigma: 67,
};

/// Standard deviation of a range (mm) by a quantile of differences.
fn sigma(counts: impl Iterator<Item = u32>, all: u32, by: &Quantile) -> u32 {
    let wanted = by.quarters * all;
    let mut below = 0;
    for (step, count) in counts.enumerate() {
        if 4 * (below + count) >= wanted {
            let (start, end) = (start_of(step), start_of(step + 1));
            let within = 16 * (end - start) * (wanted - 4 * below) / (4 * count).max(1);
            return (16 * start + within) * by.per_sigma / (26 * 16);
        }
        below += count;
    }
    0
}

/// Standard deviation of a usual range, from 10 to 80 mm, and what it grows by where that is seen: to 160 mm then.
///
/// A range is compared with that of the straight line through its neighbours' places, whatever angle it is seen at: 1/r
/// changes linearly with sine and cosine of the bearing, so that `r = 2 cos δ · ab/(a + b)` for neighbours at `a` and `b`,
/// δ to both sides. Neighbours that lie on no wall are left out, and medians do not see what corners and people are left.
/// Neighbours are at most `gap` (1/65536 turn) apart.
pub(super) fn estimate(points: &[ScanPoint], gap: u16) -> RangeNoise {
    let stride = (points.len() / ENOUGH).max(1);
    let (sum, count) = points
        .iter()
        .step_by(8 * stride)
        .fold((0u32, 0u32), |(sum, count), point| {
            (sum + u32::from(point.range), count + 1)
        });
    let middle = sum / count.max(1);
    let (mut near, mut far) = (Half::EMPTY, Half::EMPTY);
    for triple in points.windows(3).step_by(stride) {
        let [a, b, c] = triple else { continue };
        let Some(difference) = difference(a, b, c, gap) else {
            continue;
        };
        let half = if u32::from(b.range) < middle {
            &mut near
        } else {
            &mut far
        };
        half.push(difference, b.range);
    }
    let together = near.counts.iter().zip(&far.counts);
    let usual = sigma(
        together.map(|(a, b)| u32::from(*a) + u32::from(*b)),
        near.all + far.all,
        &MEDIAN,
    );
    let grown = usual.clamp(LEAST, LARGEST_GROWN);
    let share = growth(&near, &far, grown);
    let sigma = if share > 0 { grown } else { grown.min(LARGEST) } as u8;
    RangeNoise { sigma, share }
}

/// What the standard deviation grows by with the range, Q12: 0 unless the farther half's is larger by more than chance.
fn growth(near: &Half, far: &Half, usual: u32) -> u8 {
    /// Fewer differences in a half tell nothing.
    const FEWEST: u32 = 24;
    if near.all < FEWEST || far.all < FEWEST {
        return 0;
    }
    let of = |half: &Half, by| sigma(half.counts.iter().map(|&n| u32::from(n)), half.all, by);
    let nearer = of(near, &MEDIAN).max(of(near, &QUARTILE)).max(LEAST);
    // What is far has more corners and edges between two beams, which noise has not: they leave the smallest differences as they are.
    let farther = of(far, &MEDIAN).min(of(far, &QUARTILE)).max(LEAST);
    // Of medians of 64 each, half as much again is two and a half standard deviations: what is more than chance counts, and all
    // of it from three times as much on.
    let more = (4 * farther).saturating_sub(6 * nearer) / 3;
    if more == 0 {
        return 0;
    }
    let farther = farther.min(nearer + more);
    let range = (far.ranges / far.all).max(1);
    ((farther.saturating_sub(usual / 2) << 12) / range).min(255) as u8
}

/// Distance (mm) of `b` along its beam from the line through `a` and `c`; `None` unless they are its neighbours at about
/// the same angle.
fn difference(a: &ScanPoint, b: &ScanPoint, c: &ScanPoint, gap: u16) -> Option<u32> {
    let before = (b.bearing.0.wrapping_sub(a.bearing.0) as i16).unsigned_abs();
    let after = (c.bearing.0.wrapping_sub(b.bearing.0) as i16).unsigned_abs();
    let uneven = before.abs_diff(after) > before / 8 + 4;
    if uneven || before > gap || before == 0 || a.range == 0 {
        return None;
    }
    // What stands before the wall, and the wall's edges, are no noise.
    let surface = Gap {
        widest: gap,
        ..Gap::WALL
    };
    let joins = |a: &ScanPoint, b: &ScanPoint| {
        let step = u32::from(a.range.abs_diff(b.range));
        surface.joins(before, a.range.min(b.range), step)
    };
    if !joins(a, b) || !joins(b, c) {
        return None;
    }
    // Where the beams graze a wall, each niche of it is an edge.
    let (ra, rc) = (u32::from(a.range), u32::from(c.range));
    let nearer = a.range.min(c.range);
    if ra.abs_diff(rc) > 2 * across_mm(nearer, before) + u32::from(nearer) / NOISY {
        return None;
    }
    let harmonic = ra.wrapping_mul(rc) / (ra + rc);
    // 2 cos δ is 2 - δ²; (2π/65536)² is 158 / 2³⁴.
    let square = (u32::from(before) * u32::from(before)) >> 8;
    let shorter = ((square.wrapping_mul(harmonic) >> 12).wrapping_mul(158)) >> 14;
    Some(
        (2 * harmonic)
            .saturating_sub(shorter)
            .abs_diff(u32::from(b.range)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::random::Random, scan::Bearing};

    /// A wall 2 m away, seen from -45° to 45°, every second range longer by `by` than the others.
    fn wall(beams: u16, by: f32) -> [ScanPoint; 120] {
        core::array::from_fn(|k| {
            let bearing = Bearing(((k as i32 - 60) * 16_384 / i32::from(beams)) as u16);
            let (_, cos) = crate::math::sin_cos(bearing.radians());
            let noise = if k % 2 == 0 { by } else { -by };
            ScanPoint::at(bearing, (2000.0 / cos + noise) as u16)
        })
    }

    #[test]
    fn a_straight_wall_has_no_noise_and_alternating_ranges_have() {
        //  ± mm, expected: the difference is twice that, the median of a normal one 0.826 sigma.
        for (by, least, most) in [(0.0, 10, 10), (5.0, 10, 13), (20.0, 45, 50), (70.0, 80, 80)] {
            let sigma = u32::from(estimate(&wall(120, by), 1000).sigma);
            assert!((least..=most).contains(&sigma), "±{by} mm: {sigma}");
        }
    }

    /// A round room so large (mm) whose half ahead is three times as far away, seen by 360 beams with noise of so many mm and
    /// of so large a share of the range.
    fn noisy(near: f32, sigma: f32, share: f32, seed: u32) -> [ScanPoint; 360] {
        let mut random = Random::new(seed);
        core::array::from_fn(|k| {
            let far = if (90..270).contains(&k) { 3.0 } else { 1.0 };
            let range = far * near;
            let noise = crate::math::sqrt(sigma * sigma + share * share * range * range);
            let range = range + noise * random.normals()[0];
            ScanPoint::at(Bearing((k * 65_536 / 360) as u16), range as u16)
        })
    }

    #[test]
    fn noise_that_grows_with_the_range_is_told_from_noise_that_does_not() {
        let (mut grown, mut constant, mut far) = (0, 0, 0);
        for seed in 1..=50 {
            let noise = estimate(&noisy(1500.0, 5.0, 0.03, seed), 1000);
            grown += u32::from(noise.share > 0);
            far += noise.at(4500);
            constant += u32::from(estimate(&noisy(1500.0, 30.0, 0.0, seed), 1000).share > 0);
        }
        // 3 % of 4.5 m are 135 mm.
        assert!(
            grown >= 48 && (115..155).contains(&(far / 50)),
            "{grown}, {}",
            far / 50
        );
        assert!(constant <= 2, "{constant}");
    }

    #[test]
    fn posts_before_a_wall_and_mirrors_are_no_noise() {
        let mut points = noisy(1500.0, 10.0, 0.0, 1);
        for point in points.iter_mut().step_by(3) {
            point.range = if point.range > 3000 { 1200 } else { 9000 };
        }
        for point in points.iter_mut().skip(1).step_by(9) {
            point.range += 700;
        }
        let noise = estimate(&points, 1000);
        assert!(noise.sigma < 14 && noise.share == 0, "{noise:?}");
    }

    #[test]
    fn a_range_s_noise_stays_within_its_bounds() {
        let noise = RangeNoise {
            sigma: 160,
            share: 255,
        };
        assert_eq!((noise.at(0), noise.at(32_000)), (80, 960));
        // Steps follow one another without a gap.
        for difference in 0..1100u32 {
            let step = step_of(difference).min(STEPS - 1);
            let is_last = step == STEPS - 1;
            assert!(start_of(step) <= difference, "{difference}");
            assert!(is_last || difference < start_of(step + 1), "{difference}");
        }
    }

    #[test]
    fn sparse_beams_on_a_slant_are_not_noise() {
        // 5.6° apart: the ranges themselves differ by decimetres.
        let points: [ScanPoint; 16] = core::array::from_fn(|k| {
            let bearing = Bearing(((k as i32 - 8) * 1024) as u16);
            let (_, cos) = crate::math::sin_cos(bearing.radians() - 0.3);
            ScanPoint::at(bearing, (3000.0 / crate::math::max(cos, 0.2)) as u16)
        });
        let noise = estimate(&points, 2048);
        assert!(noise.sigma <= 12 && noise.share == 0, "{noise:?}");
    }
}
