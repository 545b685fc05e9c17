//! What must hold for any numbers: laws of poses, twists and covariances, and symmetries of a match.

use beamfix::{
    geometry::{Point, Pose, Twist},
    linalg::{Covariance, Sym3},
    matching::{
        Match,
        icp::{self, IcpConfig, Reference},
    },
    scan::{Bearing, ScanPoint},
};
use beamfix_sim::{TruePose, noise::Noise, scenes};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

use crate::common::points_from;

/// Rounding of a place of up to 50 m put together from two: a few units in the last of 24 bits each, and an angle's of 3.14
/// seen over that distance.
const PLACE: f32 = 1e-4;
const ANGLE: f32 = 2e-6;

fn pose() -> impl Strategy<Value = Pose> {
    (-50.0..50.0f32, -50.0..50.0f32, -4.0..4.0f32).prop_map(|(x, y, theta)| Pose::new(x, y, theta))
}

/// Whether two poses are the same but for rounding.
fn same(a: Pose, b: Pose) -> bool {
    let off = TruePose::from(a).between(TruePose::from(b));
    off.distance() < f64::from(PLACE) && off.theta.abs() < f64::from(ANGLE)
}

/// `AAᵀ` and a little more: any positive definite matrix.
fn covariance() -> impl Strategy<Value = Covariance> {
    (prop::array::uniform9(-1.0..1.0f32), 1e-4..1.0f32).prop_map(|(a, least)| {
        let [p, q, r] = [[a[0], a[1], a[2]], [a[3], a[4], a[5]], [a[6], a[7], a[8]]];
        let sum = Sym3::outer(p)
            .plus(&Sym3::outer(q))
            .plus(&Sym3::outer(r))
            .plus(&Sym3::diagonal(least, least, least));
        Covariance(sum)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn poses_are_a_group(a in pose(), b in pose(), c in pose(), x in -50.0..50.0f32, y in -50.0..50.0f32) {
        prop_assert!(same((a * b) * c, a * (b * c)), "associative");
        prop_assert!(same(a * a.inverse(), Pose::IDENTITY), "inverse");
        prop_assert!(same(a * Pose::IDENTITY, a) && same(Pose::IDENTITY * a, a), "identity");
        prop_assert!(same(a.between(b), a.inverse() * b), "between");
        let (point, moved) = (Point::new(x, y), (a * b) * Point::new(x, y));
        let stepwise = a * (b * point);
        prop_assert!((moved.x - stepwise.x).abs() < PLACE && (moved.y - stepwise.y).abs() < PLACE, "{moved:?} {stepwise:?}");
    }

    /// Half a turn is where the logarithm is not unique: the motion stays a tenth of a radian short of it.
    #[test]
    fn a_twist_leads_back_to_its_motion(x in -2.0..2.0f32, y in -2.0..2.0f32, theta in -3.04..3.04f32, seconds in 0.01..2.0f32) {
        let motion = Pose::new(x, y, theta);
        let again = Twist::from_motion(motion, seconds).displacement(seconds);
        prop_assert!(same(motion, again), "{motion:?} {again:?}");
        let twist = Twist::from_motion(motion, seconds);
        let halves = twist.displacement(0.5 * seconds) * twist.displacement(0.5 * seconds);
        prop_assert!(same(motion, halves), "{motion:?} {halves:?}");
    }

    #[test]
    fn a_positive_definite_matrix_stays_one(c in covariance(), x in -5.0..5.0f32, y in -5.0..5.0f32) {
        for (name, changed) in [("inverse", c.0.inverse()), ("about", Some(c.0.about(x, y))), ("theta_scaled", Some(c.0.theta_scaled(1.0 + x.abs())))] {
            let changed = changed.expect(name);
            let [(least, _), _, (largest, _)] = changed.eigen();
            // Of the largest, 24 bits are left for the least.
            prop_assert!(least > -1e-5 * largest, "{name}: {least} of {largest}");
        }
        let reach = 1.0 + x.abs() + y.abs();
        let back = c.0.about(x, y).about(-x, -y);
        let [_, _, (largest, _)] = c.0.about(x, y).eigen();
        for (a, b) in [(back.xx, c.0.xx), (back.xy, c.0.xy), (back.yy, c.0.yy), (back.xt, c.0.xt), (back.yt, c.0.yt), (back.tt, c.0.tt)] {
            prop_assert!((a - b).abs() < 1e-5 * largest * reach * reach, "{a} {b}");
        }
    }
}

/// The same matrix in doubles, in another's hands.
fn twin(m: &Sym3) -> Matrix3<f64> {
    let [xx, xy, xt, yy, yt, tt] = [m.xx, m.xy, m.xt, m.yy, m.yt, m.tt].map(f64::from);
    Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Everything that a symmetric matrix is asked for, beside nalgebra in doubles: to what 24 bits leave of it.
    #[test]
    fn a_symmetric_matrix_is_nalgebras(a in covariance(), b in covariance(), v in prop::array::uniform3(-3.0..3.0f32), x in -5.0..5.0f32, y in -5.0..5.0f32) {
        let (ours, other, vector) = (a.0, b.0, Vector3::from(v.map(f64::from)));
        let (m, n) = (twin(&ours), twin(&other));
        let (x64, y64) = (f64::from(x), f64::from(y));
        // A turn about (x, y) is one about the origin and a shift by (y, -x).
        let shift = Matrix3::new(1.0, 0.0, y64, 0.0, 1.0, -x64, 0.0, 0.0, 1.0);
        let stretch = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, x64));
        let near = |what: &str, got: &Sym3, want: Matrix3<f64>, digits: f64| {
            let off = (twin(got) - want).abs().max();
            prop_assert!(off <= digits * want.abs().max(), "{what}: {got:?} for {want}");
            Ok(())
        };
        near("plus", &ours.plus(&other), m + n, 1e-6)?;
        near("scaled", &ours.scaled(x), m * x64, 1e-6)?;
        near("theta_scaled", &ours.theta_scaled(x), stretch * m * stretch, 1e-6)?;
        near("about", &ours.about(x, y), shift.transpose() * m * shift, 1e-5)?;
        near("congruent", &ours.congruent(&other), n * m * n, 1e-5)?;
        near("outer", &Sym3::outer(v), vector * vector.transpose(), 1e-6)?;
        let product = m * vector;
        let times = Vector3::from(ours.times(v).map(f64::from));
        let reach = m.abs().max() * vector.abs().max();
        prop_assert!((times - product).abs().max() <= 1e-6 * reach, "{times} for {product}");
        let quadratic = f64::from(ours.quadratic(v));
        prop_assert!((quadratic - vector.dot(&product)).abs() <= 1e-5 * reach * vector.abs().max());

        let values = m.symmetric_eigenvalues();
        let (least, largest) = (values.min(), values.max());
        let lost = 1e-6 * largest / least;
        near("inverse", &ours.inverse().expect("positive definite"), m.try_inverse().expect("regular"), 3.0 * lost)?;
        let solved = Vector3::from(ours.solve(v).expect("positive definite").map(f64::from));
        prop_assert!((m * solved - vector).abs().max() <= 10.0 * lost * vector.abs().max() + 1e-6, "{solved}");
        let root = ours.root().expect("positive definite");
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|axis| Vector3::from(root.times(axis).map(f64::from)));
        let root_twin = Matrix3::from_columns(&columns);
        let off = (root_twin * root_twin.transpose() - m).abs().max();
        prop_assert!(off <= 3e-6 * m.abs().max(), "a root of {m}: {root_twin}");
        let determinant = f64::from(root.determinant());
        prop_assert!((determinant.powi(2) / m.determinant() - 1.0).abs() <= 10.0 * lost);
        let mut sorted = [values[0], values[1], values[2]];
        sorted.sort_by(f64::total_cmp);
        for ((value, vector), want) in ours.eigen().into_iter().zip(sorted) {
            let vector = Vector3::from(vector.map(f64::from));
            prop_assert!((f64::from(value) - want).abs() <= 3e-6 * largest, "{value} for {want}");
            prop_assert!((vector.norm() - 1.0).abs() <= 1e-5);
            prop_assert!((m * vector - vector * f64::from(value)).norm() <= 1e-5 * largest);
        }
    }

    /// What is not positive definite has no inverse, no root and no solution.
    #[test]
    fn what_is_not_positive_definite_is_refused(a in covariance(), v in prop::array::uniform3(-1.0..1.0f32)) {
        // So much less in one direction that it is negative there.
        let length: f32 = v.iter().map(|x| x * x).sum();
        prop_assume!(length > 0.01);
        let [_, _, (largest, _)] = a.0.eigen();
        let ours = a.0.plus(&Sym3::outer(v).scaled(-1.1 * largest / length));
        prop_assert!(ours.inverse().is_none() && ours.root().is_none() && ours.solve(v).is_none());
    }
}

/// The scan as another lidar sees it that stands turned by so much (1/65536 turn).
fn turned(points: &[ScanPoint], by: u16) -> Vec<ScanPoint> {
    let mut points: Vec<ScanPoint> = points
        .iter()
        .map(|p| ScanPoint::at(Bearing(p.bearing().0.wrapping_sub(by)), p.range()))
        .collect();
    points.sort_by_key(|p| p.bearing().0);
    points
}

/// The scan of the mirrored world, left and right exchanged.
fn mirrored(points: &[ScanPoint]) -> Vec<ScanPoint> {
    let mut points: Vec<ScanPoint> = points
        .iter()
        .map(|p| ScanPoint::at(Bearing(p.bearing().0.wrapping_neg()), p.range()))
        .collect();
    points.sort_by_key(|p| p.bearing().0);
    points
}

fn matched(reference: &[ScanPoint], points: &[ScanPoint], guess: Pose) -> Option<Match> {
    let mut laid = Box::new(Reference::<360>::new());
    laid.assign(reference);
    icp::align(&laid, points, guess, &IcpConfig::DEFAULT).ok()
}

#[test]
fn a_match_does_not_depend_on_the_axes_and_does_not_move_again() {
    let world = scenes::room();
    let mut count = 0;
    for seed in 0..60 {
        let mut noise = Noise::new(seed, 9);
        let mut any = |most: f64| most * (2.0 * noise.even(0.0, 1.0) - 1.0);
        let place = TruePose::new(any(0.5), any(0.5), any(3.0));
        let motion = TruePose::new(any(0.1), any(0.1), any(0.1));
        let by = (65_536.0 * (0.5 + any(0.5))) as u16;
        let reference = points_from(&world, place, 360, &mut noise);
        let points = points_from(&world, place.then(motion), 360, &mut noise);
        let Some(found) = matched(&reference, &points, Pose::IDENTITY) else {
            continue;
        };
        count += 1;
        let sigma = |k: usize| f64::from(beamfix::math::sqrt(found.covariance.to_array()[k]));
        // Points are whole millimetres and lines whole directions, so that other axes are other roundings: less than what
        // the match says that it may be off.
        let allowed = (sigma(0) + sigma(2), sigma(5));
        let near = |what: &str, wanted: TruePose, other: Pose| {
            let off = wanted.between(other.into());
            assert!(
                off.distance() < allowed.0 && off.theta.abs() < allowed.1,
                "seed {seed}, {what}: {off:?}, allowed {allowed:?}"
            );
        };
        // The same in axes that are turned: the same motion, seen from there.
        let other = matched(
            &turned(&reference, by),
            &turned(&points, by),
            Pose::IDENTITY,
        );
        let axes = TruePose::new(0.0, 0.0, f64::from(by) * std::f64::consts::TAU / 65_536.0);
        let wanted = TruePose::new(0.0, 0.0, -axes.theta)
            .then(found.pose.into())
            .then(axes);
        near("turned", wanted, other.expect("a match").pose);
        // In the mirror: the mirrored motion.
        let other = matched(&mirrored(&reference), &mirrored(&points), Pose::IDENTITY);
        let wanted = TruePose::new(
            f64::from(found.pose.x),
            -f64::from(found.pose.y),
            -f64::from(found.pose.theta),
        );
        near("mirrored", wanted, other.expect("a match").pose);
        // From where it ended it does not move.
        let again = matched(&reference, &points, found.pose);
        near("again", found.pose.into(), again.expect("a match").pose);
        // And what it says of itself is a covariance.
        let [(least, _), ..] = found.covariance.0.eigen();
        assert!(least > 0.0, "seed {seed}: {found:?}");
    }
    assert!(count >= 55, "{count} of 60 matches");
}
