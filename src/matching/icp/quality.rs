//! What a match is worth: covariance, weak direction, verdict.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    matching::{
        Match, MatchError, WeakDirection,
        icp::{Task, hypotheses::Best},
    },
    math,
};

/// Share of the weight below which a direction is not determined: 2 of 100 beams, which is what the noise of the
/// normals alone amounts to in a corridor.
const WEAK_SHARE: f32 = 0.02;
/// How much larger errors are than the residuals of one scan say: the reference's noise is as large as the scan's and
/// averaged over in its lines. Calibrated on simulated and recorded pairs (NEES 2.4 and 3.9, 3 is ideal).
const INFLATION: f32 = 1.8;
/// Errors that no residual shows (m, rad).
const FLOOR: (f32, f32) = (0.0005, 0.0001);
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
    let step = best.last.length;
    if step > TOO_LONG {
        return Err(MatchError::NotConverged { step });
    }
    if best.candidate.value < config.min_score {
        return Err(MatchError::Unlikely {
            score: best.candidate.value,
        });
    }
    let (h, _) = best.last.sums.equations();
    let scaled = h.theta_scaled(1.0 / lever);
    let eigen = scaled.eigen();
    let threshold = WEAK_SHARE * best.last.sums.total_weight();
    if eigen[1].0 < threshold {
        return Err(MatchError::Degenerate);
    }
    let residual = best.last.sums.residual();
    let noise = math::max(residual * residual, config.range_sigma * config.range_sigma);
    let mut pose = best.candidate.at.pose();
    let mut weak = None;
    if eigen[0].0 < threshold {
        let [x, y, t] = eigen[0].1;
        let moved = [
            pose.x - guess.x,
            pose.y - guess.y,
            math::wrap_angle(pose.theta - guess.theta) * lever,
        ];
        let along = x * moved[0] + y * moved[1] + t * moved[2];
        pose = Pose::new(
            pose.x - along * x,
            pose.y - along * y,
            pose.theta - along * t / lever,
        );
        weak = Some(WeakDirection {
            direction: eigen[0].1,
            lever,
            sigma: math::sqrt(noise / math::max(eigen[0].0, 1e-3)),
        });
    }
    let alike = best.last.sums.correlation();
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
        overlap: best.last.sums.overlap,
        beams: task.points.len() as u16,
        score: best.candidate.value,
        residual,
        weak,
        iterations: best.candidate.passes,
        starts: best.starts,
        rival: best.ratio,
    })
}

/// Mean distance of the points (m), which makes a heading comparable with a distance.
fn mean_range(task: &Task<'_>) -> f32 {
    let sum = task
        .points
        .iter()
        .fold(0u32, |sum, p| sum.saturating_add(u32::from(p.range)));
    math::max(sum as f32 * 1e-3 / task.points.len() as f32, 0.1)
}
