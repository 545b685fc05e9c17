//! What a match is worth: covariance, degenerate direction, verdict.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    matching::{
        DegenerateDirection, Match, MatchError, Starts,
        icp::projective::{
            FINE, Task,
            accumulate::{FixedPose, Pass},
            multistart::Best,
        },
    },
    math,
};

/// How much larger errors are than the residuals of one scan say: the reference's noise is as large as the scan's and
/// averaged over in its lines. Calibrated on simulated and recorded pairs: the mean normalised squared error
/// of what `pairs --out` writes is near 3 for the former, 3 to 4 for the latter; 3 is ideal.
const INFLATION: f32 = 1.9;
/// Errors that no residual shows (m, rad).
const FLOOR: (f32, f32) = (0.0005, 0.0001);
/// How far off the guess may be along a direction that only it tells (m).
const GUESS_SIGMA: f32 = 0.3;
/// Longest last step of a match that is believed (m).
const TOO_LONG: f32 = 0.05;

/// Judges the best candidate and keeps the guess along a direction that the scene does not determine.
pub(super) fn verdict(task: &Task<'_>, best: &Best, guess: Pose) -> Result<Match, MatchError> {
    let config = task.config;
    if best.last.sums.inliers < config.min_inliers {
        return Err(MatchError::TooFewCorrespondences {
            found: best.last.sums.inliers,
            needed: config.min_inliers,
        });
    }
    let lever = mean_range(task);
    if best.candidate.value < config.min_score {
        return Err(MatchError::Unlikely {
            score: best.candidate.value,
        });
    }
    let sums = &best.last.sums;
    let mut h = sums.curvature(task.lever_shift, best.last.at);
    let residual = sums.residual();
    let noise = math::max(
        residual * residual,
        config.min_range_sigma * config.min_range_sigma,
    );
    let mut pose = best.last.at.pose();
    let degenerate_direction = degenerate_direction(
        &h.theta_scaled(1.0 / lever),
        lever,
        noise,
        config.min_constraint_share * sums.total_weight(),
    )?;
    let step = best.last.length;
    if degenerate_direction.is_none() && step > TOO_LONG {
        return Err(MatchError::NotConverged { step });
    }
    if let Some(DegenerateDirection { direction, .. }) = degenerate_direction {
        let [x, y, t] = direction;
        // What the noise of the normals pretends to know along it is not known.
        let pretended = h.theta_scaled(1.0 / lever).quadratic(direction);
        let known = noise / (GUESS_SIGMA * GUESS_SIGMA);
        h = h.plus(&outer([x, y, t * lever]).scaled(known - pretended));
        pose = kept(task, pose, guess, [x, y, t], lever);
    }
    let alike = sums.correlation();
    let information = h.scaled(1.0 / noise);
    // A direction that is not determined at all still has a finite variance: 10 m, 10 rad.
    let bounded = information.plus(&Sym3::diagonal(0.01, 0.01, 0.01));
    let spread = bounded
        .inverse()
        .ok_or(MatchError::Degenerate)?
        .scaled(INFLATION * (1.0 + alike) / (1.0 - alike));
    let (t, r) = FLOOR;
    let covariance = spread.plus(&Sym3::diagonal(t * t, t * t, r * r));
    Ok(Match {
        pose,
        covariance: Covariance(covariance),
        information: Information(information),
        inliers: best.last.sums.inliers,
        overlap: best.candidate.overlap,
        beams: task.points.len() as u16,
        score: best.candidate.value,
        residual,
        degenerate_direction,
        iterations: best.iterations,
        starts: Some(Starts {
            tried: best.starts,
            rival: best.ratio,
        }),
    })
}

/// `pose`, but the guess along a direction that is not determined.
// Seldom needed: apart, so that the passes of every match keep their registers.
#[cold]
#[inline(never)]
fn kept(task: &Task<'_>, pose: Pose, guess: Pose, direction: [f32; 3], lever: f32) -> Pose {
    const ALL: Pass = Pass {
        period: 1,
        first: 0,
        length: 1,
        gate: FINE,
    };
    let kept = without(pose, guess, direction, lever);
    // The direction is straight where the scene may be round: two passes lead back across it.
    let mut pose = kept;
    for _ in 0..2 {
        let Some(at) = FixedPose::new(pose) else {
            break;
        };
        if let Ok(across) = task.step(at, ALL, None) {
            pose = without(across.at.pose(), kept, direction, lever);
        }
    }
    pose
}

/// `pose` without what it differs from `other` along a direction, headings as long as `lever`.
fn without(pose: Pose, other: Pose, [x, y, t]: [f32; 3], lever: f32) -> Pose {
    let turned = math::wrap_angle(pose.theta - other.theta) * lever;
    let along = x * (pose.x - other.x) + y * (pose.y - other.y) + t * turned;
    Pose::new(
        pose.x - along * x,
        pose.y - along * y,
        pose.theta - along * t / lever,
    )
}

/// The direction that is not determined, if there is one; refuses two.
///
/// `h` is the curvature with headings as long as distances, `threshold` what it must have along a direction.
fn degenerate_direction(
    h: &Sym3,
    lever: f32,
    noise: f32,
    threshold: f32,
) -> Result<Option<DegenerateDirection>, MatchError> {
    // No eigenvalue is smaller than the inverse of the sum of their inverses: most matches need no more.
    if let Some(inverse) = h.inverse()
        && (inverse.xx + inverse.yy + inverse.tt) * threshold < 1.0
    {
        return Ok(None);
    }
    let [(least, direction), (second, _), _] = h.eigen();
    if second < threshold {
        return Err(MatchError::Degenerate);
    }
    Ok((least < threshold).then(|| DegenerateDirection {
        direction,
        lever,
        sigma: math::sqrt(noise / math::max(least, 1e-3)),
    }))
}

/// `v vᵀ`.
fn outer([x, y, t]: [f32; 3]) -> Sym3 {
    Sym3 {
        xx: x * x,
        xy: x * y,
        xt: x * t,
        yy: y * y,
        yt: y * t,
        tt: t * t,
    }
}

/// Mean distance of the points (m), which makes a heading comparable with a distance.
fn mean_range(task: &Task<'_>) -> f32 {
    let sum = task
        .points
        .iter()
        .fold(0u32, |sum, p| sum.saturating_add(u32::from(p.range)));
    math::max(sum as f32 * 1e-3 / task.points.len() as f32, 0.1)
}
