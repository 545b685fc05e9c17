//! What holds of every match, whatever the scene.

use beamfix::{
    geometry::Pose,
    matching::{
        Match, MatchError,
        icp::{IcpConfig, Reference, align},
    },
    math,
    scan::{Bearing, ScanPoint},
};

/// Share of its standard deviation that a match may be from the end of its way.
const CONVERGED: f32 = 0.3;

/// Walls of a room with a box in it, as ends of segments (m).
const WALLS: [[f32; 4]; 8] = [
    [-3.0, -2.0, 4.0, -2.0],
    [4.0, -2.0, 4.0, 2.5],
    [4.0, 2.5, -3.0, 2.5],
    [-3.0, 2.5, -3.0, -2.0],
    [1.5, 0.8, 2.1, 0.8],
    [2.1, 0.8, 2.1, 1.5],
    [2.1, 1.5, 1.5, 1.5],
    [1.5, 1.5, 1.5, 0.8],
];

/// Numbers that look random, evenly from -1 to 1.
struct Noise(u32);

impl Noise {
    fn even(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 8_388_608.0 - 1.0
    }

    /// Of standard deviation 1, nearly normal.
    fn normal(&mut self) -> f32 {
        self.even() + self.even() + self.even()
    }
}

/// What a lidar of N beams sees from `pose`, walls `scale` times as far away, ranges off by `sigma` m.
fn scan<const N: usize>(pose: Pose, scale: f32, sigma: f32, noise: &mut Noise) -> [ScanPoint; N] {
    core::array::from_fn(|k| {
        let bearing = Bearing((k * 65_536 / N) as u16);
        let (s, c) = math::sin_cos(pose.theta + bearing.radians());
        let range = WALLS.iter().fold(f32::INFINITY, |nearest, wall| {
            let [ax, ay, bx, by] = wall.map(|v| scale * v);
            let (ex, ey, qx, qy) = (bx - ax, by - ay, ax - pose.x, ay - pose.y);
            let across = c * ey - s * ex;
            let (t, u) = ((qx * ey - qy * ex) / across, (qx * s - qy * c) / across);
            if t > 0.0 && (0.0..=1.0).contains(&u) {
                math::min(nearest, t)
            } else {
                nearest
            }
        });
        ScanPoint::at(bearing, (1e3 * (range + sigma * noise.normal())) as u16)
    })
}

/// The same scan in a mirror that stands along x.
fn mirrored<const N: usize>(points: &[ScanPoint; N]) -> [ScanPoint; N] {
    core::array::from_fn(|k| {
        let point = points[N - 1 - k];
        ScanPoint::at(Bearing(point.bearing().0.wrapping_neg()), point.range())
    })
}

fn matched<const N: usize>(
    reference: &[ScanPoint; N],
    points: &[ScanPoint; N],
    guess: Pose,
) -> Result<Match, MatchError> {
    let mut lines = Reference::<N>::new();
    lines.assign(reference);
    align(&lines, points, guess, &IcpConfig::DEFAULT)
}

fn poses(noise: &mut Noise) -> (Pose, Pose, Pose) {
    let from = Pose::new(0.4 * noise.even(), 0.3 * noise.even(), 3.1 * noise.even());
    let motion = Pose::new(0.1 * noise.even(), 0.1 * noise.even(), 0.1 * noise.even());
    let guess = Pose::new(
        motion.x + 0.03 * noise.even(),
        motion.y + 0.03 * noise.even(),
        motion.theta + 0.03 * noise.even(),
    );
    (from, motion, guess)
}

#[test]
fn a_match_of_a_match_moves_nothing() {
    let mut noise = Noise(1);
    for case in 0..40 {
        let (from, motion, guess) = poses(&mut noise);
        let reference = scan::<360>(from, 1.0, 0.01, &mut noise);
        let points = scan::<360>(from * motion, 1.0, 0.01, &mut noise);
        let first = matched(&reference, &points, guess).expect("determined");
        let again = matched(&reference, &points, first.pose).expect("determined");
        let moved = first.pose.between(again.pose);
        let sigma = |v: f32| math::sqrt(v);
        let covariance = first.covariance.0;
        // Two ends within `CONVERGED` of the same place, each with as much again left of the way.
        let allowed = 4.0 * CONVERGED;
        assert!(
            math::abs(moved.x) < allowed * sigma(math::max(covariance.xx, covariance.yy))
                && math::abs(moved.y) < allowed * sigma(math::max(covariance.xx, covariance.yy))
                && math::abs(moved.theta) < allowed * sigma(covariance.tt),
            "case {case}: {moved:?}, {covariance:?}"
        );
    }
}

#[test]
fn mirrored_scans_match_mirrored() {
    //  noise (m); allowed: a hundredth of a degree at 1 cm, as much more as there is more noise.
    for (sigma, allowed) in [(0.01, 0.01), (0.03, 0.03), (0.05, 0.05)] {
        let mut noise = Noise(7);
        let (mut sum, mut count) = (0.0, 0.0);
        for _ in 0..40 {
            let (from, motion, guess) = poses(&mut noise);
            let reference = scan::<360>(from, 1.0, sigma, &mut noise);
            let points = scan::<360>(from * motion, 1.0, sigma, &mut noise);
            let mirror = |pose: Pose| Pose::new(pose.x, -pose.y, -pose.theta);
            let found = matched(&reference, &points, guess).expect("determined");
            let other = matched(&mirrored(&reference), &mirrored(&points), mirror(guess))
                .expect("determined");
            sum += math::wrap_angle(found.pose.theta + other.pose.theta);
            count += 1.0;
        }
        let degrees = (sum / count).to_degrees();
        assert!(
            math::abs(degrees) < allowed,
            "{sigma} m: {degrees}° to one side"
        );
    }
}

#[test]
fn a_lidar_that_turns_the_other_way_finds_the_same() {
    for sigma in [0.01, 0.03] {
        let mut noise = Noise(11);
        for case in 0..40 {
            let (from, motion, guess) = poses(&mut noise);
            let mut reference = scan::<360>(from, 1.0, sigma, &mut noise);
            let mut points = scan::<360>(from * motion, 1.0, sigma, &mut noise);
            let found = matched(&reference, &points, guess).expect("determined");
            reference.reverse();
            points.reverse();
            let other = matched(&reference, &points, guess).expect("determined");
            let moved = found.pose.between(other.pose);
            let c = found.covariance.0;
            // Other points share a pass: both ends are within `CONVERGED` of the same place, and the ends of windows fall
            // elsewhere.
            let allowed = 3.0 * CONVERGED;
            assert!(
                moved.distance() < allowed * math::sqrt(c.xx + c.yy)
                    && math::abs(moved.theta) < allowed * math::sqrt(c.tt),
                "case {case}, {sigma} m: {moved:?}, {c:?}"
            );
        }
    }
}

#[test]
fn the_covariance_holds_at_any_noise() {
    for sigma in [0.01, 0.02, 0.03, 0.05] {
        let mut noise = Noise(3);
        let (mut translation, mut heading, mut count) = (0.0, 0.0, 0.0);
        for _ in 0..60 {
            let (from, motion, guess) = poses(&mut noise);
            let reference = scan::<360>(from, 1.0, sigma, &mut noise);
            let points = scan::<360>(from * motion, 1.0, sigma, &mut noise);
            let found = matched(&reference, &points, guess).expect("determined");
            let (x, y) = (found.pose.x - motion.x, found.pose.y - motion.y);
            let turned = math::wrap_angle(found.pose.theta - motion.theta);
            let c = found.covariance.0;
            let determinant = c.xx * c.yy - c.xy * c.xy;
            translation += (c.yy * x * x - 2.0 * c.xy * x * y + c.xx * y * y) / determinant;
            heading += turned * turned / c.tt;
            count += 1.0;
        }
        // 2 and 1 are ideal; of 60 matches the mean is good to a fifth.
        let (translation, heading) = (translation / count, heading / count);
        assert!(
            (0.8..3.4).contains(&translation) && (0.4..1.7).contains(&heading),
            "{sigma} m: {translation}, {heading}"
        );
    }
}

#[test]
fn few_beams_and_far_walls_still_match() {
    //  walls so many times as far away: 4 to 29 m; 64 beams of 5.6°.
    for scale in [1.0, 3.0, 7.0] {
        let mut noise = Noise(5);
        let mut right = 0;
        for _ in 0..20 {
            let (from, motion, guess) = poses(&mut noise);
            let reference = scan::<64>(from, scale, 0.01, &mut noise);
            let points = scan::<64>(from * motion, scale, 0.01, &mut noise);
            if let Ok(found) = matched(&reference, &points, guess) {
                let off = motion.between(found.pose);
                right += u32::from(off.distance() < 0.05 && math::abs(off.theta) < 0.02);
            }
        }
        assert!(
            right >= 18,
            "walls {scale} times as far away: {right} of 20"
        );
    }
}
