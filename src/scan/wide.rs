//! Beams as wide as the gap to the next one: a ring of multi-zone rangers.

use super::{Beam, Bearing, ScanPoint, surface::turn_between};
use crate::math;

/// Where a beam's nearest surface lies, which is what a ranger of wide beams reports.
///
/// In a beam `width` (1/65536 turn) wide that meets a wall askew, that is the edge at which the wall comes nearer: the
/// place to which the perpendicular from the ranger falls, or the edge next to it. The ranges of the neighbours tell the
/// slope; where they end on other things, the middle. `None` without a range.
pub(crate) fn surface(
    here: &Beam,
    before: Option<&Beam>,
    after: Option<&Beam>,
    width: u16,
) -> Option<(Bearing, u16)> {
    let range = here.range.mm().ok()?;
    // Distance to the neighbour's range where it seems to be the same wall: askew by at most 75° at these widths.
    let rise = |other: Option<&Beam>| {
        let other = other?;
        let point = |beam: &Beam, range| ScanPoint {
            bearing: beam.bearing,
            range,
            ..ScanPoint::default()
        };
        let mm = other.range.mm().ok()?;
        let turn = turn_between(&point(here, range), &point(other, mm));
        let is_next = turn > 0 && turn <= width + width / 2;
        let is_same = u32::from(mm.abs_diff(range)) * 20 < u32::from(range) * 7;
        let rise = i32::from(mm) - i32::from(range);
        // Counter-clockwise is ahead.
        let ahead = other.bearing.0.wrapping_sub(here.bearing.0).cast_signed() > 0;
        (is_next && is_same).then_some(if ahead { rise } else { -rise })
    };
    let slope = match (rise(before), rise(after)) {
        (Some(a), Some(b)) => (a + b) / 2,
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => 0,
    };
    // r(θ) = d / cos(θ − φ): the slope over the range is the tangent of θ − φ.
    // As `across_mm`, for wider beams than its 32 bits hold.
    let across = ((u64::from(range) * u64::from(width) * 25) >> 18) as i32;
    let off = math::atan2_turn(-slope, across.max(1)).cast_signed();
    let half = (width / 2).cast_signed();
    let off = off.clamp(-half, half);
    Some((Bearing(here.bearing.0.wrapping_add_signed(off)), range))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Range;

    #[test]
    fn a_wall_askew_is_met_at_the_beams_nearer_edge() {
        // Walls 1 m away whose perpendicular falls at these bearings; 64 beams, the one at 0.
        let width = 1024u16;
        let edge = 0.5 * f32::from(width) / 65_536.0 * core::f32::consts::TAU;
        for foot in [-1.0f32, -0.3, -0.02, 0.0, 0.03, 0.2, 0.8, 1.1] {
            let nearest = |middle: f32| {
                let off = (middle - foot).abs();
                let off = if off > edge { off - edge } else { 0.0 };
                1.0 / math::sin_cos(off).1
            };
            let beam = |k: f32| Beam {
                bearing: Bearing::from_radians(2.0 * edge * k),
                range: Range::from_metres(nearest(2.0 * edge * k)),
                time_us: 0,
                quality: 0,
            };
            let (before, here, after) = (beam(-1.0), beam(0.0), beam(1.0));
            for (one, other) in [(&before, &after), (&after, &before)] {
                let (bearing, _) = surface(&here, Some(one), Some(other), width).expect("a range");
                let wanted = foot.clamp(-edge, edge);
                // Near the foot the neighbours' own edges shorten the slope.
                let off = (bearing.radians() - wanted).abs();
                assert!(off < 0.035, "{foot}: {} {wanted}", bearing.radians());
                assert!(foot.abs() < 0.15 || off < 1e-3, "{foot}: {off}");
            }
        }
        assert_eq!(
            surface(
                &Beam {
                    bearing: Bearing(0),
                    range: Range::from_mm(0),
                    time_us: 0,
                    quality: 0
                },
                None,
                None,
                width
            ),
            None
        );
    }
}
