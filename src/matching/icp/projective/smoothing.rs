//! A new keyframe's points moved three quarters of the way to the old one's lines: a chain of keyframes then drifts less than
//! its matches are noisy.

use crate::{
    matching::icp::projective::{
        accumulate::{self, Gate, Projection},
        fixed_pose::FixedPose,
        line::Line,
        range_noise::RangeNoise,
    },
    math::rough_length,
    scan::{Points, ScanPoint},
};

/// Points nearer to their line than so many fifths of a standard deviation of a range saw the same surface again; farther
/// ones saw another.
const SAME_FIFTHS: u32 = 16;

/// Moves points seen from `at` along their beams, three quarters of the way to the lines that they meet: a mean, three
/// to one, of a surface as it was known and as it was seen once more.
pub(super) fn smooth_towards(
    lines: &[Line],
    points: &mut [ScanPoint],
    at: FixedPose,
    noise: RangeNoise,
) {
    let same = SAME_FIFTHS * u32::from(noise.sigma) / 5;
    let mut projection = Projection::new(lines, at);
    for point in points {
        let placed = projection.place(point);
        let Some(line) = projection.line(point, placed) else {
            continue;
        };
        let Some((beyond, _)) = accumulate::residual(line, placed, Gate::new(2 * same))
            .filter(|(beyond, _)| beyond.unsigned_abs() < 16 * same)
        else {
            continue;
        };
        // Along the beam the line is the farther the more the beam grazes it; up to four times as far is believed.
        let (bx, by) = ((placed.x - at.x) >> 4, (placed.y - at.y) >> 4);
        let facing = (i32::from(line.mx) * bx + i32::from(line.my) * by) >> 10;
        let distance = i32::from(point.range);
        let least = if noise.share == 0 {
            distance / 4
        } else {
            // As long as the weighted normal is.
            (distance * rough_length(line.mx.into(), line.my.into()) as i32) >> 12
        };
        let along = beyond * distance / facing.abs().max(least).max(1);
        // From 1/16 mm, and three quarters of it.
        let nearer = (3 * along + 32) >> 6;
        let range = distance - if facing >= 0 { nearer } else { -nearer };
        if (1..=i32::from(Points::<0>::MAX_RANGE_MM)).contains(&range) {
            *point = ScanPoint::within(point.bearing, range as u16);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::Pose, matching::icp::projective::Reference, scan::Bearing};

    const TEN: RangeNoise = RangeNoise {
        sigma: 10,
        share: 0,
    };

    /// What a lidar sees in the middle of a square room, its walls so far away (mm).
    fn room(wall: f32) -> [ScanPoint; 180] {
        core::array::from_fn(|k| {
            let bearing = Bearing((k * 65_536 / 180) as u16);
            let (s, c) = crate::math::sin_cos(bearing.radians());
            let ahead = crate::math::max(crate::math::abs(s), crate::math::abs(c));
            ScanPoint::at(bearing, (wall / ahead) as u16)
        })
    }

    #[test]
    fn points_near_a_known_wall_come_three_quarters_nearer_and_others_stay() {
        let mut reference = Reference::<180>::new();
        reference.assign(&room(2000.0));
        for (wall, expected) in [(2020.0, 2005.0), (1980.0, 1995.0), (2100.0, 2100.0)] {
            let mut points = room(wall);
            let at = FixedPose::new(Pose::IDENTITY).expect("near");
            smooth_towards(reference.lines(), &mut points, at, TEN);
            for point in &points {
                let distance = f32::from(point.x.unsigned_abs().max(point.y.unsigned_abs()));
                // In corners lines face the lidar, and less is drawn along the beam.
                let corner = point.x.unsigned_abs().abs_diff(point.y.unsigned_abs()) < 400;
                assert!(
                    corner || (distance - expected).abs() < 4.0,
                    "{wall}: {point:?}"
                );
            }
        }
    }

    #[test]
    fn noise_that_grows_draws_by_the_same_share() {
        // Seen by a lidar whose noise at 2 m is twice the usual one: lines weigh half as much.
        let noise = RangeNoise {
            sigma: 10,
            share: 31,
        };
        assert_eq!(noise.at(2000), 20);
        let half = |v: i16| v / 2;
        let mut reference = Reference::<180>::new();
        reference.assign(&room(2000.0));
        let lines: [Line; 180] = core::array::from_fn(|k| {
            let line = reference.lines()[k];
            Line {
                mx: half(line.mx),
                my: half(line.my),
                ..line
            }
        });
        let mut points = room(2020.0);
        let at = FixedPose::new(Pose::IDENTITY).expect("near");
        smooth_towards(&lines, &mut points, at, noise);
        for point in &points {
            let distance = f32::from(point.x.unsigned_abs().max(point.y.unsigned_abs()));
            let corner = point.x.unsigned_abs().abs_diff(point.y.unsigned_abs()) < 400;
            assert!(corner || (distance - 2005.0).abs() < 4.0, "{point:?}");
        }
    }

    #[test]
    fn a_wall_is_met_where_the_pose_puts_it() {
        let mut reference = Reference::<180>::new();
        reference.assign(&room(2000.0));
        // 1 m ahead and turned by half a turn: the wall ahead was behind, 3 m away.
        let pose = Pose::new(1.0, 0.0, core::f32::consts::PI);
        let at = FixedPose::new(pose).expect("near");
        let mut points = [ScanPoint::at(Bearing(0), 3012)];
        smooth_towards(reference.lines(), &mut points, at, TEN);
        assert!(points[0].range.abs_diff(3003) <= 2, "{points:?}");
    }
}
