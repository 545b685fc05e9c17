//! How right the matches of a list are: the rules of `../shared/tools/pairs_eval.py`.

use std::collections::BTreeMap;

use beamfix::geometry::Pose;

use beamfix_sim::TruePose;

/// A match is right below these (m, degrees).
const RIGHT: (f64, f64) = (0.05, 1.0);

/// Distance (m) and angle (degrees) between a pose found and the true one.
#[must_use]
pub fn error(found: Pose, truth: Pose) -> (f64, f64) {
    let (found, truth) = (TruePose::from(found), TruePose::from(truth));
    let rotation = beamfix_sim::pose::wrap(found.theta - truth.theta);
    let (x, y) = (found.x - truth.x, found.y - truth.y);
    (libm::sqrt(x * x + y * y), rotation.to_degrees().abs())
}

/// Whether an error is small enough.
#[must_use]
pub fn is_right((metres, degrees): (f64, f64)) -> bool {
    metres < RIGHT.0 && degrees < RIGHT.1
}

/// The errors of one level.
#[derive(Debug, Clone, Default)]
pub struct Level {
    /// Pairs.
    pub pairs: usize,
    /// Accepted and right.
    pub right: usize,
    /// Accepted and wrong.
    pub wrong: usize,
    /// Errors of all (m), refused ones by their guess.
    pub metres: Vec<f64>,
    /// The same (degrees).
    pub degrees: Vec<f64>,
}

/// Scores by level.
#[derive(Debug, Clone, Default)]
pub struct Score(pub BTreeMap<i32, Level>);

impl Score {
    /// Takes a pair in; `accepted` is what the matcher itself says.
    pub fn push(&mut self, level: i32, found: Pose, truth: Pose, accepted: bool) {
        let error = error(found, truth);
        let level = self.0.entry(level).or_default();
        level.pairs += 1;
        level.right += usize::from(accepted && is_right(error));
        level.wrong += usize::from(accepted && !is_right(error));
        level.metres.push(error.0);
        level.degrees.push(error.1);
    }
}

/// Mean; 0 of nothing.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The value below which `share` of the values lie, interpolated; 0 of nothing.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(
            (
                quantile(&values, 0.5),
                quantile(&values, 1.0),
                quantile(&[], 0.5)
            ),
            (2.5, 4.0, 0.0)
        );
        assert_eq!(mean(&values), 2.5);
    }

    #[test]
    fn refused_is_neither_right_nor_wrong() {
        let mut score = Score::default();
        let angle = core::f32::consts::PI - 0.001;
        let truth = Pose::new(1.0, 0.0, angle);
        score.push(1, Pose::new(1.04, 0.0, -angle), truth, true);
        score.push(1, Pose::new(1.06, 0.0, angle), truth, true);
        score.push(1, Pose::new(0.0, 0.0, 0.0), truth, false);
        let level = &score.0[&1];
        assert_eq!((level.pairs, level.right, level.wrong), (3, 1, 1));
    }
}
