//! What a modular match is worth: enough to go by, covariance, degenerate direction.

use crate::{
    geometry::Pose,
    linalg::{Covariance, Information, Sym3},
    matching::{
        DegenerateDirection, Match, MatchError,
        icp::modular::{Cloud, Limits, Pair, minimisation::normal_equations},
    },
    math,
    scan::ScanPoint,
};

/// Share of the weight below which a direction is not determined, as in `icp::projective::verdict`.
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

/// What the pairs determine: the information but for its scale, and the direction that they leave open, if one.
pub(super) struct Determined {
    h: Sym3,
    /// Curvature and unit vector over (x, y, heading · lever).
    open: Option<(f32, [f32; 3])>,
    lever: f32,
}

impl Determined {
    /// `lever`: see [`mean_range`].
    pub fn by(
        pairs: &[Pair],
        reference: Cloud<'_>,
        pose: Pose,
        lever: f32,
    ) -> Result<Self, MatchError> {
        let (h, _) = normal_equations(pairs, reference, pose);
        let [least, middle, _] = h.theta_scaled(1.0 / lever).eigen();
        let weight = counting(pairs).fold(0.0, |sum, pair| sum + pair.weight);
        let threshold = WEAK_SHARE * weight;
        if !(middle.0 >= threshold) {
            return Err(MatchError::Degenerate);
        }
        let open = (least.0 < threshold).then_some(least);
        Ok(Self { h, open, lever })
    }

    /// The information but for its scale, without the open direction's: that little is the normals' noise.
    fn known(&self) -> Sym3 {
        let Some((curvature, [x, y, t])) = self.open else {
            return self.h;
        };
        let t = t * self.lever;
        let outer = Sym3 {
            xx: x * x,
            xy: x * y,
            xt: x * t,
            yy: y * y,
            yt: y * t,
            tt: t * t,
        };
        self.h.plus(&outer.scaled(-curvature))
    }

    /// The motion without its part along the open direction: Zhang, Kaess, Singh, ICRA 2016.
    pub fn part_of(&self, motion: Pose) -> Pose {
        let Some((_, [x, y, t])) = self.open else {
            return motion;
        };
        let along = x * motion.x + y * motion.y + t * motion.theta * self.lever;
        Pose::new(
            motion.x - along * x,
            motion.y - along * y,
            motion.theta - along * t / self.lever,
        )
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
    let moved = determined.part_of(Pose::new(
        pose.x - guess.x,
        pose.y - guess.y,
        pose.theta - guess.theta,
    ));
    let information = determined.known().scaled(1.0 / noise);
    // A direction that is not determined at all still has a finite variance: 10 m, 10 rad.
    let bounded = information.plus(&Sym3::diagonal(0.01, 0.01, 0.01));
    let covariance = bounded.inverse().ok_or(MatchError::Degenerate)?;
    let degenerate_direction = determined.open.map(|(_, direction)| {
        let [x, y, t] = direction;
        let variance = covariance.quadratic([x, y, t * determined.lever]);
        DegenerateDirection {
            direction,
            lever: determined.lever,
            sigma: math::sqrt(variance),
        }
    });
    Ok(Match {
        pose: Pose::new(
            guess.x + moved.x,
            guess.y + moved.y,
            guess.theta + moved.theta,
        ),
        covariance: Covariance(covariance),
        information: Information(information),
        inliers: counting(pairs).count() as u16,
        overlap: pairs.len() as u16,
        beams: current.points.len() as u16,
        score: score / pairs.len() as f32,
        residual,
        degenerate_direction,
        iterations,
        starts: None,
    })
}

/// Mean distance of the points (m), which makes a heading comparable with a distance.
pub(super) fn mean_range(points: &[ScanPoint]) -> f32 {
    let sum = points
        .iter()
        .fold(0.0, |sum, p| sum + f32::from(p.range) * 1e-3);
    math::max(sum / points.len() as f32, 0.1)
}
