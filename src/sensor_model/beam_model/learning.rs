//! Beam models from data by expectation maximisation: Thrun, Burgard, Fox, table 6.2.
//!
//! With weighted responsibilities, as the likelihood of a mixture asks for, and with the exact maximum for λ of
//! the *cut* exponential: the printed `Σe / Σe·z` takes ranges behind the expected one as possible.

use super::BeamModel;
use crate::math;

/// Bins of the expected range of unexpected returns.
const BINS: usize = 24;

/// Sums over beams from which a model follows: 300 bytes, whatever the number of beams.
///
/// Batch: [`Learner::add`] all beams, [`Learner::model`], [`Learner::clear`], again. Streaming: add a scan, now and
/// then take the model and [`Learner::forget`] some.
#[derive(Debug, Clone)]
pub struct Learner {
    /// Whose responsibilities are summed.
    model: BeamModel,
    total: Sums,
    /// The last few hundred beams: small numbers are added to small sums first.
    recent: Sums,
    count: u16,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Responsibilities of the four causes.
    causes: [f32; 4],
    /// Of hits, times their squared deviation (m²).
    square: f32,
    /// Of unexpected returns, times their range (m).
    range: f32,
    /// Of unexpected returns, by expected range: the sum, and the sum times the expected range (m).
    expected: [(f32, f32); BINS],
    log_likelihood: f32,
    beams: f32,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        for (sum, part) in self.causes.iter_mut().zip(other.causes) {
            *sum += part;
        }
        for (sum, part) in self.expected.iter_mut().zip(other.expected) {
            sum.0 += part.0;
            sum.1 += part.1;
        }
        self.square += other.square;
        self.range += other.range;
        self.log_likelihood += other.log_likelihood;
        self.beams += other.beams;
    }
}

impl Learner {
    /// Starts from a model.
    #[must_use]
    pub fn new(model: BeamModel) -> Self {
        Self {
            model,
            total: Sums::default(),
            recent: Sums::default(),
            count: 0,
        }
    }

    /// Takes a beam: its range (m; `None`: no return) and the one that the map says.
    ///
    /// An expected range that is not between 0 and the longest is left out.
    pub fn add(&mut self, range: Option<f32>, expected: f32) {
        let range_max = self.model.range_max;
        if !(expected > 0.0 && expected < range_max) || range.is_some_and(|z| !(z >= 0.0)) {
            return;
        }
        let causes = self.model.causes(range, expected);
        let likelihood = causes.iter().sum::<f32>();
        if !(likelihood > 0.0) {
            return;
        }
        let share = causes.map(|cause| cause / likelihood);
        let sums = &mut self.recent;
        for (sum, share) in sums.causes.iter_mut().zip(share) {
            *sum += share;
        }
        if let Some(z) = range {
            sums.square += share[0] * (z - expected) * (z - expected);
            sums.range += share[1] * z;
            let bin = (expected / range_max * BINS as f32) as usize;
            if let Some(bin) = sums.expected.get_mut(bin) {
                bin.0 += share[1];
                bin.1 += share[1] * expected;
            }
        }
        sums.log_likelihood += math::ln(likelihood);
        sums.beams += 1.0;
        self.count += 1;
        if self.count >= 256 {
            self.settle();
        }
    }

    fn settle(&mut self) {
        self.total.add(&self.recent);
        self.recent = Sums::default();
        self.count = 0;
    }

    /// Beams taken, those forgotten in part counted in part.
    #[must_use]
    pub fn beams(&self) -> f32 {
        self.total.beams + self.recent.beams
    }

    /// Mean log-likelihood of the beams under the model that they were summed with (nat); 0 without beams.
    #[must_use]
    pub fn mean_log_likelihood(&self) -> f32 {
        let sum = self.total.log_likelihood + self.recent.log_likelihood;
        sum / math::max(self.beams(), 1.0)
    }

    /// Takes the next model from the sums and sums with it from now on; without beams it stays as it is.
    pub fn model(&mut self) -> BeamModel {
        self.settle();
        let sums = &self.total;
        if !(sums.beams >= 1.0) {
            return self.model;
        }
        // No cause dies out: it could never come back.
        let mut weights = sums.causes.map(|sum| math::max(sum / sums.beams, 0.001));
        let whole = weights.iter().sum::<f32>();
        weights = weights.map(|weight| weight / whole);
        let [z_hit, z_short, z_max, z_rand] = weights;
        let sigma = if sums.causes[0] > 1e-3 {
            math::sqrt(sums.square / sums.causes[0])
        } else {
            self.model.sigma
        };
        self.model = BeamModel {
            z_hit,
            z_short,
            z_max,
            z_rand,
            sigma: math::min(math::max(sigma, 0.002), 1.0),
            lambda: sums.lambda().unwrap_or(self.model.lambda),
            range_max: self.model.range_max,
        };
        self.model
    }

    /// Forgets all beams; the model stays.
    pub fn clear(&mut self) {
        self.total = Sums::default();
        self.recent = Sums::default();
        self.count = 0;
    }

    /// Keeps so much (0…1) of the beams taken so far: 0.999 a scan follows changes over a thousand scans.
    pub fn forget(&mut self, keep: f32) {
        self.settle();
        let mut kept = Sums::default();
        let keep = math::min(math::max(keep, 0.0), 1.0);
        let scaled = Sums {
            causes: self.total.causes.map(|sum| sum * keep),
            square: self.total.square * keep,
            range: self.total.range * keep,
            expected: self.total.expected.map(|(a, b)| (a * keep, b * keep)),
            log_likelihood: self.total.log_likelihood * keep,
            beams: self.total.beams * keep,
        };
        kept.add(&scaled);
        self.total = kept;
    }
}

impl Sums {
    /// λ that makes the cut exponential likeliest, by bisection: where the mean range is as it should be.
    ///
    /// `None` where there are too few unexpected returns to say.
    fn lambda(&self) -> Option<f32> {
        let weight = self.causes[1];
        if !(weight > 1.0) {
            return None;
        }
        // Mean of an exponential cut at s: 1/λ − s/(e^{λs} − 1), which falls as λ grows.
        let expected_sum = |lambda: f32| {
            let mut sum = 0.0;
            for &(weight, weighted) in &self.expected {
                if weight > 0.0 {
                    let s = weighted / weight;
                    let power = math::min(lambda * s, 80.0);
                    let mean = if power < 1e-2 {
                        s * (0.5 - power / 12.0)
                    } else {
                        1.0 / lambda - s / (math::exp(power) - 1.0)
                    };
                    sum += weight * mean;
                }
            }
            sum
        };
        let (mut low, mut high) = (0.01, 10.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if expected_sum(middle) > self.range {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(0.5 * (low + high))
    }
}

/// Models by angle of incidence: up to 30°, 60°, 80°, and flatter.
#[derive(Debug, Clone)]
pub struct ByIncidence<T> {
    /// From head-on to grazing.
    pub bins: [T; 4],
}

impl<T> ByIncidence<T> {
    /// Cosines of 30°, 60° and 80°.
    pub const COSINES: [f32; 3] = [0.866_025_4, 0.5, 0.173_648_18];

    /// The bin of a beam that meets its surface's normal at an angle of this cosine (its sign does not matter).
    pub fn of(&mut self, cosine: f32) -> &mut T {
        let cosine = math::abs(cosine);
        let [first, second, third, fourth] = &mut self.bins;
        let [steep, middle, flat] = Self::COSINES;
        if cosine >= steep {
            first
        } else if cosine >= middle {
            second
        } else if cosine >= flat {
            third
        } else {
            fourth
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beams_that_are_all_hits_give_their_spread() {
        let mut learner = Learner::new(BeamModel::DEFAULT);
        for _ in 0..30 {
            learner.clear();
            for k in 0..1000 {
                let off = if k % 2 == 0 { 0.02 } else { -0.02 };
                learner.add(Some(3.0 + off), 3.0);
            }
            learner.model();
        }
        let model = learner.model();
        assert!(
            (model.sigma - 0.02).abs() < 1e-3 && model.z_hit > 0.98,
            "{model:?}"
        );
        assert!(model.checked().is_ok());
    }

    #[test]
    fn what_is_no_beam_is_left_out() {
        let mut learner = Learner::new(BeamModel::DEFAULT);
        for (range, expected) in [
            (Some(f32::NAN), 3.0),
            (Some(1.0), f32::NAN),
            (None, 20.0),
            (Some(-1.0), 2.0),
        ] {
            learner.add(range, expected);
        }
        assert_eq!(learner.beams(), 0.0);
        assert_eq!(learner.model(), BeamModel::DEFAULT);
        learner.add(None, 3.0);
        learner.forget(0.5);
        assert_eq!(learner.beams(), 0.5);
    }

    #[test]
    fn incidence_has_four_bins() {
        let mut bins = ByIncidence { bins: [0, 1, 2, 3] };
        for (cosine, bin) in [(1.0, 0), (-0.9, 0), (0.7, 1), (0.3, 2), (0.1, 3), (0.0, 3)] {
            assert_eq!(*bins.of(cosine), bin, "{cosine}");
        }
    }
}
