//! What a modular match is worth: enough to go by, covariance, degenerate direction.

use crate::{
    geometry::Pose,
    linalg::Sym3,
    matching::{
        Match, MatchError,
        degeneracy::{self, Open},
        icp::modular::{
            limits::Limits, minimisation::normal_equations, normals::Cloud, pair::Pair,
        },
    },
    math,
    scan::ScanPoint,
};

/// Share of the weight below which a direction is not determined, as in `IcpConfig::min_constraint_share`.
const MIN_CONSTRAINT_SHARE: f32 = 0.02;
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
    let needed = limits.min_pairs;
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
    let (found, needed) = (counting(pairs).count() as u16, limits.min_pairs);
    if found < needed {
        return Err(MatchError::TooFewCorrespondences { found, needed });
    }
    Ok(())
}

/// What the pairs determine: the curvature of the cost, and the direction that they leave open, if one.
pub(super) struct Determined {
    h: Sym3,
    open: Option<Open>,
}

impl Determined {
    /// `lever`: see [`degeneracy::mean_range`].
    pub fn by(
        pairs: &[Pair],
        reference: Cloud<'_>,
        pose: Pose,
        lever: f32,
    ) -> Result<Self, MatchError> {
        let (h, _) = normal_equations(pairs, reference, pose);
        let weight = counting(pairs).fold(0.0, |sum, pair| sum + pair.weight);
        let open = degeneracy::find(
            &h.theta_scaled(1.0 / lever),
            lever,
            MIN_CONSTRAINT_SHARE * weight,
        )?;
        Ok(Self { h, open })
    }

    /// The motion without its part along the open direction.
    pub fn part_of(&self, motion: Pose) -> Pose {
        self.open
            .map_or(motion, |open| open.keep(motion, Pose::IDENTITY))
    }
}

/// Judges the pose that the last pass led to, and keeps the guess along a direction that nothing determines.
pub(super) fn judge(
    pairs: &[Pair],
    current: Cloud<'_>,
    determined: &Determined,
    [guess, pose, step]: [Pose; 3],
    iterations: u8,
    limits: &Limits,
) -> Result<Match, MatchError> {
    if step.distance() > TOO_LONG.0 || math::abs(step.theta) > TOO_LONG.1 {
        let step = step.distance() + math::abs(step.theta);
        return Err(MatchError::NotConverged { step });
    }
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
    let noise = math::max(
        residual * residual,
        limits.min_range_sigma * limits.min_range_sigma,
    );
    let open = determined.open;
    let pose = open.map_or(pose, |open| open.keep(pose, guess));
    let (information, covariance) = degeneracy::uncertainty(&determined.h, noise, open.as_ref())?;
    Ok(Match {
        pose,
        covariance,
        information,
        inliers: counting(pairs).count() as u16,
        overlap: pairs.len() as u16,
        beams: current.points.len() as u16,
        score: score / pairs.len() as f32,
        residual,
        degenerate_direction: open.map(|open| open.told(&covariance)),
        iterations,
        starts: None,
    })
}
