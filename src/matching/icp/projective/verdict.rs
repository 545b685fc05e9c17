//! What a match is worth: covariance, degenerate direction, verdict.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    matching::{
        Match, MatchError, Starts,
        degeneracy::{self, Open},
        icp::projective::{fixed_pose::FixedPose, multistart::Best, task::Task},
    },
    math,
};

/// Errors that no residual shows (m, rad).
const FLOOR: (f32, f32) = (0.0005, 0.0001);

/// Judges the best candidate and keeps the guess along a direction that the scene does not determine.
// Apart: what it holds need not lie below the passes on the stack.
#[inline(never)]
pub(super) fn verdict(task: &Task<'_>, best: &Best, guess: Pose) -> Result<Match, MatchError> {
    let config = task.config;
    if best.sums.inliers < config.min_inliers {
        return Err(MatchError::TooFewCorrespondences {
            found: best.sums.inliers,
            needed: config.min_inliers,
        });
    }
    if best.candidate.value < config.min_score {
        return Err(MatchError::Unlikely {
            score: best.candidate.value,
        });
    }
    let sums = &best.sums;
    let lever = degeneracy::mean_range(task.points);
    let h = sums.curvature(task.lever_shift, best.candidate.at);
    let open = degeneracy::find(
        &h.theta_scaled(1.0 / lever),
        lever,
        task.least_curvature(sums),
    )?;
    let mut pose = best.candidate.at.pose();
    if let Some(open) = &open {
        pose = kept(task, pose, guess, open);
    }
    let residual = sums.residual();
    let noise = math::max(
        residual * residual,
        config.min_range_sigma * config.min_range_sigma,
    );
    let (information, spread) = degeneracy::uncertainty(&h, noise, open.as_ref())?;
    let (t, r) = FLOOR;
    let covariance = Covariance(spread.0.scaled(sums.inflation()).plus(&Sym3::diagonal(
        t * t,
        t * t,
        r * r,
    )));
    Ok(Match {
        pose,
        covariance,
        information,
        inliers: best.sums.inliers,
        overlap: best.candidate.overlap,
        beams: task.points.len() as u16,
        score: best.candidate.value,
        residual,
        degenerate_direction: open.map(|open| open.told(&covariance)),
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
fn kept(task: &Task<'_>, pose: Pose, guess: Pose, open: &Open) -> Pose {
    let kept = open.keep(pose, guess);
    // The direction is straight where the scene may be round: two passes lead back across it.
    let mut pose = kept;
    for _ in 0..2 {
        let Some(at) = FixedPose::new(pose) else {
            break;
        };
        if let Ok(across) = task.step_by_all(at) {
            pose = open.keep(at.moved(across, task.start).pose(), kept);
        }
    }
    pose
}
