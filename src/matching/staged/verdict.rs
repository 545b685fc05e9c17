//! What a staged match is worth: enough to go by, covariance, weak direction.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    matching::{
        Match, MatchError, WeakDirection,
        staged::{Cloud, Limits, Pair, minimisation::normal_equations},
    },
    math,
    scan::ScanPoint,
};

/// Share of the weight below which a direction is not determined, as in `icp::quality`.
const WEAK_SHARE: f32 = 0.02;
/// Longest last step of a match that is believed (m, rad).
const TOO_LONG: (f32, f32) = (0.01, 0.005);
/// Distance at which a pair counts half in the score (m).
const HALF_SCORE: f32 = 0.04;

/// Refuses scans that are too small and guesses that are no poses.
pub(super) fn enough(
    reference: &[ScanPoint],
    points: &[ScanPoint],
    guess: Pose,
    limits: &Limits,
) -> Result<(), MatchError> {
    let needed = limits.pairs;
    if points.len() < usize::from(needed) {
        let found = points.len() as u16;
        return Err(MatchError::TooFewBeams { found, needed });
    }
    if reference.len() < usize::from(needed) {
        let found = reference.len() as u16;
        return Err(MatchError::TooFewLines { found, needed });
    }
    let inside = |v: f32| v > -32.0 && v < 32.0;
    if inside(guess.x) && inside(guess.y) && guess.theta.is_finite() {
        Ok(())
    } else {
        Err(MatchError::BadGuess)
    }
}

fn counting(pairs: &[Pair]) -> impl Iterator<Item = &Pair> {
    pairs.iter().filter(|pair| pair.weight > 0.0)
}

/// Refuses passes in which too few pairs count.
pub(super) fn enough_pairs(pairs: &[Pair], limits: &Limits) -> Result<(), MatchError> {
    let (found, needed) = (counting(pairs).count() as u16, limits.pairs);
    if found < needed {
        return Err(MatchError::TooFewCorrespondences { found, needed });
    }
    Ok(())
}

/// Judges the pose that the last pass led to, and keeps the guess along a direction that nothing determines.
pub(super) fn judge(
    pairs: &[Pair],
    reference: Cloud<'_>,
    current: Cloud<'_>,
    [guess, pose, step]: [Pose; 3],
    iterations: u8,
    limits: &Limits,
) -> Result<Match, MatchError> {
    if step.distance() > TOO_LONG.0 || math::abs(step.theta) > TOO_LONG.1 {
        let step = step.distance() + math::abs(step.theta);
        return Err(MatchError::NotConverged { step });
    }
    let (h, _) = normal_equations(pairs, reference, pose);
    let (mut weight, mut squares, mut score) = (0.0, 0.0, 0.0);
    for pair in counting(pairs) {
        weight += pair.weight;
        squares += pair.weight * pair.across * pair.across;
    }
    for pair in pairs {
        let ratio = pair.across / HALF_SCORE;
        score += 1.0 / (1.0 + ratio * ratio);
    }
    let residual = math::sqrt(squares / weight);
    let noise = math::max(residual * residual, limits.range_sigma * limits.range_sigma);
    let lever = mean_range(current.points);
    let eigen = h.theta_scaled(1.0 / lever).eigen();
    let threshold = WEAK_SHARE * weight;
    if !(eigen[1].0 >= threshold) {
        return Err(MatchError::Degenerate);
    }
    let weak = (eigen[0].0 < threshold).then(|| WeakDirection {
        direction: eigen[0].1,
        lever,
        sigma: math::sqrt(noise / math::max(eigen[0].0, 1e-3)),
    });
    let pose = weak.map_or(pose, |weak| keep(&weak, guess, pose));
    let information = h.scaled(1.0 / noise);
    // A direction that is not determined at all still has a finite variance: 10 m, 10 rad.
    let bounded = information.plus(&Sym3::diagonal(0.01, 0.01, 0.01));
    let covariance = bounded.inverse().ok_or(MatchError::Degenerate)?;
    Ok(Match {
        pose,
        covariance: Covariance(covariance),
        information: Information(information),
        inliers: counting(pairs).count() as u16,
        overlap: pairs.len() as u16,
        beams: current.points.len() as u16,
        score: score / pairs.len() as f32,
        residual,
        weak,
        iterations,
        starts: 1,
        rival: 0.0,
    })
}

/// The pose with the guess's part along the weak direction: Zhang, Kaess, Singh, ICRA 2016.
fn keep(weak: &WeakDirection, guess: Pose, pose: Pose) -> Pose {
    let [x, y, t] = weak.direction;
    let turned = math::wrap_angle(pose.theta - guess.theta) * weak.lever;
    let along = x * (pose.x - guess.x) + y * (pose.y - guess.y) + t * turned;
    Pose::new(
        pose.x - along * x,
        pose.y - along * y,
        pose.theta - along * t / weak.lever,
    )
}

/// Mean distance of the points (m), which makes a heading comparable with a distance.
fn mean_range(points: &[ScanPoint]) -> f32 {
    let sum = points
        .iter()
        .fold(0.0, |sum, p| sum + f32::from(p.range) * 1e-3);
    math::max(sum / points.len() as f32, 0.1)
}
