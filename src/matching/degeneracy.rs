//! What the scene determines of a pose, and what it leaves open: one judge for all matchers.
//!
//! A distance from a line only changes when the scan moves across the line. Along a corridor, or about the centre of a
//! round room, every pose fits equally well: the direction is *degenerate* (Zhang, Kaess, Singh, ICRA 2016). There the
//! curvature of the cost is next to nothing, what is left of it is noise, and the pose keeps the guess.
//!
//! A heading is compared with a distance by a *lever*: turning by θ moves a point at the mean distance `lever` from the
//! lidar by `lever · θ`. Directions are unit vectors over (x, y, lever · heading).

use super::{DegenerateDirection, MatchError};
use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    math,
    scan::ScanPoint,
};

/// How far off the guess may be along a direction that only the guess tells (m).
const GUESS_SIGMA: f32 = 0.3;
/// What is known of every direction in any case (1/m², 1/rad²): 10 m, 10 rad.
const BOUND: f32 = 0.01;

/// Mean distance of the points (m), at least 0.1: the lever of a scan.
pub(super) fn mean_range(points: &[ScanPoint]) -> f32 {
    let sum = points
        .iter()
        .fold(0u32, |sum, p| sum.saturating_add(u32::from(p.range)));
    math::max(sum as f32 * 1e-3 / points.len() as f32, 0.1)
}

/// A direction that the scan leaves open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Open {
    /// Unit vector over (x, y, lever · heading).
    pub direction: [f32; 3],
    /// m.
    pub lever: f32,
}

/// The direction along which the curvature is below `threshold`, if there is one; refuses two.
///
/// `curvature` is over (x, y, lever · heading).
pub(super) fn find(
    curvature: &Sym3,
    lever: f32,
    threshold: f32,
) -> Result<Option<Open>, MatchError> {
    // No eigenvalue is smaller than the inverse of the sum of their inverses: most matches need no more.
    if let Some(inverse) = curvature.inverse()
        && (inverse.xx + inverse.yy + inverse.tt) * threshold < 1.0
    {
        return Ok(None);
    }
    find_among(&curvature.eigen(), lever, threshold)
}

/// As [`find`], from eigenvalues in ascending order and their eigenvectors.
pub(super) fn find_among(
    [(least, direction), (second, _), (most, _)]: &[(f32, [f32; 3]); 3],
    lever: f32,
    threshold: f32,
) -> Result<Option<Open>, MatchError> {
    let determined = *second >= threshold && (least + second + most).is_finite();
    if !determined {
        return Err(MatchError::Degenerate);
    }
    Ok((*least < threshold).then_some(Open {
        direction: *direction,
        lever,
    }))
}

impl Open {
    /// `pose` with the guess kept along the direction.
    pub fn keep(&self, pose: Pose, guess: Pose) -> Pose {
        let ([x, y, t], lever) = (self.direction, self.lever);
        let turned = math::wrap_angle(pose.theta - guess.theta) * lever;
        let along = x * (pose.x - guess.x) + y * (pose.y - guess.y) + t * turned;
        Pose::new(
            pose.x - along * x,
            pose.y - along * y,
            pose.theta - along * t / lever,
        )
    }

    /// The direction over (x, y, heading): m and m·rad.
    fn row(&self) -> [f32; 3] {
        let [x, y, t] = self.direction;
        [x, y, t * self.lever]
    }

    /// A curvature over (x, y, heading) without what the noise of the normals pretends to know along the direction.
    fn closed(&self, h: &Sym3) -> Sym3 {
        let pretended = h.theta_scaled(1.0 / self.lever).quadratic(self.direction);
        h.plus(&Sym3::outer(self.row()).scaled(-pretended))
    }

    /// What the guess knows along the direction (1/m²).
    fn guess(&self) -> Sym3 {
        Sym3::outer(self.row()).scaled(1.0 / (GUESS_SIGMA * GUESS_SIGMA))
    }

    /// As a match tells it.
    pub fn told(&self, covariance: &Covariance) -> DegenerateDirection {
        DegenerateDirection {
            direction: self.direction,
            lever: self.lever,
            sigma: math::sqrt(covariance.0.quadratic(self.row())),
        }
    }
}

/// Information and covariance of a pose by the curvature of the cost over (x, y, heading) and the variance of a residual
/// (m²): along an open direction the scan knows nothing, and the pose is as uncertain as the guess.
///
/// # Errors
/// [`MatchError::Degenerate`] where the curvature is no number.
pub(super) fn uncertainty(
    curvature: &Sym3,
    noise: f32,
    open: Option<&Open>,
) -> Result<(Information, Covariance), MatchError> {
    let known = open.map_or(*curvature, |open| open.closed(curvature));
    let information = known.scaled(1.0 / noise);
    let mut all = information.plus(&Sym3::diagonal(BOUND, BOUND, BOUND));
    if let Some(open) = open {
        all = all.plus(&open.guess());
    }
    let covariance = all.inverse().ok_or(MatchError::Degenerate)?;
    Ok((Information(information), Covariance(covariance)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Curvature of `count` beams on walls along x, the lidar in their middle, and what noise adds along them.
    fn corridor(count: f32) -> Sym3 {
        Sym3 {
            xx: 0.01 * count,
            yy: count,
            tt: 4.0 * count,
            ..Sym3::default()
        }
    }

    #[test]
    fn a_corridor_is_open_along_it_and_a_single_curvature_is_refused() {
        let lever = 2.0;
        let scaled = corridor(100.0).theta_scaled(1.0 / lever);
        assert_eq!(find(&scaled, lever, 0.5), Ok(None), "1 is more than 0.5");
        let open = find(&scaled, lever, 2.0).expect("two are determined");
        let open = open.expect("one is open");
        assert!(open.direction[0].abs() > 0.999, "{open:?}");
        // Walls and heading have 100 each.
        assert_eq!(find(&scaled, lever, 102.0), Err(MatchError::Degenerate));
        let nothing = Sym3::diagonal(f32::NAN, 1.0, 1.0);
        assert_eq!(find(&nothing, lever, 0.5), Err(MatchError::Degenerate));
    }

    #[test]
    fn the_guess_is_kept_along_the_open_direction_and_nowhere_else() {
        let open = Open {
            direction: [0.6, 0.0, 0.8],
            lever: 2.0,
        };
        let (guess, pose) = (Pose::new(1.0, 2.0, 3.0), Pose::new(1.5, 2.5, -3.2));
        let kept = open.keep(pose, guess);
        let off = |a: Pose, b: Pose| {
            let turned = open.lever * math::wrap_angle(a.theta - b.theta);
            [a.x - b.x, a.y - b.y, turned]
        };
        let along = |[x, _, t]: [f32; 3]| 0.6 * x + 0.8 * t;
        let across = |[x, _, t]: [f32; 3]| 0.8 * x - 0.6 * t;
        assert!(along(off(kept, guess)).abs() < 1e-5, "{kept:?}");
        assert!(across(off(kept, pose)).abs() < 1e-5, "{kept:?}");
        assert_eq!(kept.y, pose.y);
    }

    #[test]
    fn along_an_open_direction_the_pose_is_as_uncertain_as_the_guess() {
        let h = corridor(100.0);
        let open = Open {
            direction: [1.0, 0.0, 0.0],
            lever: 2.0,
        };
        let (information, covariance) = uncertainty(&h, 1e-4, Some(&open)).expect("numbers");
        assert!(information.0.xx.abs() < 1e-2, "{information:?}");
        let told = open.told(&covariance);
        assert!((told.sigma - GUESS_SIGMA).abs() < 1e-3, "{told:?}");
        assert!((covariance.0.yy - 1e-6).abs() < 1e-8, "{covariance:?}");
    }
}
