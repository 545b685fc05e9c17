//! Beams as wide as the gap to the next one: a ring of multi-zone rangers.

use super::{Beam, Bearing};
use crate::math;

/// Beams that tell a surface's slope: two before, the one itself, two after.
pub(crate) const NEIGHBOURS: usize = 5;

/// Where the nearest surface of the middle one of these beams lies, which is what a ranger of wide beams reports.
///
/// In a beam `width` (1/65536 turn) wide that meets a wall askew, that is the edge at which the wall comes nearer: the
/// place to which the perpendicular from the ranger falls, or the edge next to it. The ranges of the neighbours tell the
/// slope, two on each side as far as they seem to lie on the same wall: of one, the noise of a range often shows the wrong
/// edge, which on a wall askew is a place in front of it. Where they end on other things, the middle. `None` without a range.
pub(crate) fn surface(beams: &[Option<Beam>; NEIGHBOURS], width: u16) -> Option<(Bearing, u16)> {
    let [second, first, here, third, fourth] = beams;
    let here = here.as_ref()?;
    let range = here.range.mm().ok()?;
    let mut line = SlopeSums::of(range.into());
    for (step, near, far) in [(-1, first, second), (1, third, fourth)] {
        let on_wall = |beam: &Option<Beam>, steps: i32, last: i32| {
            let beam = beam.as_ref()?;
            let mm = i32::from(beam.range.mm().ok()?);
            let turn = i32::from(beam.bearing.0.wrapping_sub(here.bearing.0).cast_signed());
            let is_there = (turn - steps * i32::from(width)).abs() <= i32::from(width / 2);
            // Askew by at most 75° at these widths.
            (is_there && mm.abs_diff(last) * 20 < last.unsigned_abs() * 7).then_some(mm)
        };
        let Some(next) = on_wall(near, step, range.into()) else {
            continue;
        };
        line.add(step, next);
        if let Some(after) = on_wall(far, 2 * step, next) {
            // A corner between them bends the line by more than noise.
            let bend = after - 2 * next + i32::from(range);
            if bend.unsigned_abs() * 100 <= u32::from(range) * 9 {
                line.add(2 * step, after);
            }
        }
    }
    // r(θ) = d / cos(θ − φ): the slope over the range is the tangent of θ − φ.
    // As `across_mm`, for wider beams than its 32 bits hold.
    let across = ((u64::from(range) * u64::from(width) * 25) >> 18) as i32;
    let off = math::atan2_turn(-line.slope(), across.max(1)).cast_signed();
    let half = (width / 2).cast_signed();
    let off = off.clamp(-half, half);
    Some((Bearing(here.bearing.0.wrapping_add_signed(off)), range))
}

/// Sums of the straight line that comes nearest to ranges (mm) at so many beams from one of them.
struct SlopeSums {
    count: i32,
    steps: i32,
    ranges: i32,
    squares: i32,
    products: i32,
}

impl SlopeSums {
    const fn of(range: i32) -> Self {
        Self {
            count: 1,
            steps: 0,
            ranges: range,
            squares: 0,
            products: 0,
        }
    }

    const fn add(&mut self, step: i32, range: i32) {
        self.count += 1;
        self.steps += step;
        self.ranges += range;
        self.squares += step * step;
        self.products += step * range;
    }

    /// How much the range grows from a beam to the next one counter-clockwise (mm); 0 for one range.
    fn slope(&self) -> i32 {
        let spread = self.count * self.squares - self.steps * self.steps;
        (self.count * self.products - self.steps * self.ranges)
            .checked_div(spread)
            .unwrap_or(0)
    }
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
            let beams = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| Some(beam(k)));
            let (bearing, _) = surface(&beams, width).expect("a range");
            let wanted = foot.clamp(-edge, edge);
            // Near the foot the neighbours' own edges shorten the slope.
            let off = (bearing.radians() - wanted).abs();
            assert!(off < 0.035, "{foot}: {} {wanted}", bearing.radians());
            assert!(foot.abs() < 0.15 || off < 1e-3, "{foot}: {off}");
        }
        let none = beam_at(0, 0);
        assert_eq!(surface(&[None, None, Some(none), None, None], width), None);
    }

    fn beam_at(steps: i16, mm: u32) -> Beam {
        Beam {
            bearing: Bearing((1024 * steps).cast_unsigned()),
            range: Range::from_mm(mm),
            time_us: 0,
            quality: 0,
        }
    }

    #[test]
    fn noise_of_one_neighbour_does_not_turn_a_wall() {
        // A wall 20° askew, 2 m away: 73 mm more from beam to beam; a neighbour errs by 120 mm.
        let beams = [1860, 1927, 2000, 1953, 2160];
        let places = |beams: [u32; 5]| {
            let mut step = -3;
            let beams = beams.map(|mm| {
                step += 1;
                (mm > 0).then(|| beam_at(step, mm))
            });
            surface(&beams, 1024).map(|(bearing, _)| bearing.0.cast_signed())
        };
        assert_eq!(places(beams), Some(-512));
        // What is beyond a jump or a corner tells nothing: as without it.
        assert_eq!(
            places([900, 1927, 2000, 0, 0]),
            places([0, 1927, 2000, 0, 0])
        );
        assert_eq!(
            places([0, 0, 2000, 2073, 1800]),
            places([0, 0, 2000, 2073, 0])
        );
        // Alone, the middle.
        assert_eq!(places([0, 0, 2000, 0, 0]), Some(0));
    }

    #[test]
    fn a_beam_counts_only_where_it_should_stand() {
        // A ring of three beams a step apart: the second after the first one is also the one before it.
        let (here, next, last) = (beam_at(0, 2000), beam_at(1, 2100), beam_at(-1, 1900));
        let ring = [Some(next), Some(last), Some(here), Some(next), Some(last)];
        let alone = [None, Some(last), Some(here), Some(next), None];
        assert_eq!(surface(&ring, 1024), surface(&alone, 1024));
    }
}
