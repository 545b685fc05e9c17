//! Noise of a lidar's ranges, from one of its scans.

use crate::scan::ScanPoint;

/// Least and largest standard deviation that is told (mm).
///
/// 10: surfaces, footprints and mixed pixels add what one beam after another does not show; a cheap lidar's data sheet says
/// as much. 80: twice what any data sheet allows; more is clutter.
const LEAST: u32 = 10;
const LARGEST: u32 = 80;
/// Places that are looked at, about: the estimate is then good to a tenth.
const ENOUGH: usize = 128;

/// Deviations are counted in so many steps of [`STEP_MM`].
const STEPS: usize = 64;
const STEP_MM: u32 = 2;

/// Standard deviation of a range (mm), from 10 to 80.
///
/// A range is compared with that of the straight line through its neighbours' places, whatever angle it is seen at: 1/r
/// changes linearly with sine and cosine of the bearing, so that `r = 2 cos δ · ab/(a + b)` for neighbours at `a` and `b`,
/// δ to both sides. The median of the differences does not see corners, edges and people.
/// Neighbours are at most `gap` (1/65536 turn) apart.
pub(super) fn sigma(points: &[ScanPoint], gap: u16) -> u16 {
    let mut counts = [0u16; STEPS];
    let mut all = 0u32;
    let stride = (points.len() / ENOUGH).max(1);
    for triple in points.windows(3).step_by(stride) {
        let [a, b, c] = triple else { continue };
        let Some(difference) = difference(a, b, c, gap) else {
            continue;
        };
        let step = (difference / STEP_MM) as usize;
        if let Some(count) = counts.get_mut(step.min(STEPS - 1)) {
            *count += 1;
            all += 1;
        }
    }
    // In 1/16 mm.
    let mut median = 0;
    let mut below = 0;
    for count in counts.map(u32::from) {
        if 2 * (below + count) >= all {
            median += 16 * STEP_MM * (all - 2 * below) / (2 * count).max(1);
            break;
        }
        below += count;
        median += 16 * STEP_MM;
    }
    // The difference has the variance of 1 + 2/4 ranges; a median is 0.6745 sigma.
    let sigma = median * 31 / (26 * 16);
    sigma.clamp(LEAST, LARGEST) as u16
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
    let (ra, rc) = (u32::from(a.range), u32::from(c.range));
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
    use crate::scan::Bearing;

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
            let sigma = sigma(&wall(120, by), 1000);
            assert!((least..=most).contains(&sigma), "±{by} mm: {sigma}");
        }
    }

    #[test]
    fn sparse_beams_on_a_slant_are_not_noise() {
        // 5.6° apart: the ranges themselves differ by decimetres.
        let points: [ScanPoint; 16] = core::array::from_fn(|k| {
            let bearing = Bearing(((k as i32 - 8) * 1024) as u16);
            let (sin, cos) = crate::math::sin_cos(bearing.radians() - 0.3);
            let _ = sin;
            ScanPoint::at(bearing, (3000.0 / crate::math::max(cos, 0.2)) as u16)
        });
        assert!(sigma(&points, 2048) <= 12, "{}", sigma(&points, 2048));
    }
}
