//! Weights, and particles drawn again by them.

use super::belief::Particle;
use crate::math;

/// Makes the heaviest weight 1; all of them where none is a number.
pub(super) fn normalise(particles: &mut [Particle]) {
    let heaviest = particles
        .iter()
        .map(|particle| particle.log_weight)
        .fold(f32::NEG_INFINITY, |most, weight| math::max(weight, most));
    for particle in particles {
        let weight = particle.log_weight - heaviest;
        // What has no likelihood counts as little as a number can say.
        particle.log_weight = if !heaviest.is_finite() {
            0.0
        } else {
            math::max(weight, -1e6)
        };
    }
}

/// Draws as many particles as there are in `to` from `from`: one random number for all, `start` in 0 to 1, and steps of even
/// length through the sum of the weights, so that each is drawn as often as its weight says or once more (Thrun, Burgard,
/// Fox, *Probabilistic Robotics*, table 4.4).
pub(super) fn low_variance(from: &[Particle], to: &mut [Particle], start: f32) {
    let weight = |particle: &Particle| math::exp(math::max(particle.log_weight, -80.0));
    let step = from.iter().map(weight).sum::<f32>() / math::max(to.len() as f32, 1.0);
    let mut rest = from.iter();
    let Some(mut current) = rest.next() else {
        return;
    };
    let mut reached = weight(current);
    for (k, particle) in to.iter_mut().enumerate() {
        let pointer = (start + k as f32) * step;
        while reached < pointer {
            // Rounding may leave the last steps beyond the sum.
            let Some(next) = rest.next() else { break };
            current = next;
            reached += weight(current);
        }
        *particle = Particle {
            pose: current.pose,
            log_weight: 0.0,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::Pose, math::random::Random};

    fn particles<const N: usize>(weights: [f32; N]) -> [Particle; N] {
        let mut number = 0.0;
        weights.map(|weight| {
            number += 1.0;
            Particle {
                pose: Pose::new(number, 0.0, 0.0),
                log_weight: math::ln(weight),
            }
        })
    }

    #[test]
    fn each_is_drawn_as_often_as_its_weight_says_or_once_more_and_on_the_mean_just_as_often() {
        let weights = [0.05f32, 0.4, 0.0001, 0.25, 0.2999];
        let from = particles(weights);
        let mut random = Random::new(5);
        let mut drawn = [0u32; 5];
        const RUNS: u32 = 4000;
        for _ in 0..RUNS {
            let mut to = from;
            low_variance(&from, &mut to, random.unit());
            for (k, weight) in weights.into_iter().enumerate() {
                let times = to.iter().filter(|p| p.pose == from[k].pose).count() as u32;
                let expected = 5.0 * weight;
                assert!((times as f32 - expected).abs() < 1.0, "{k}: {times}");
                drawn[k] += times;
            }
            assert!(to.iter().all(|particle| particle.log_weight == 0.0));
        }
        for (k, weight) in weights.into_iter().enumerate() {
            let share = drawn[k] as f32 / (5 * RUNS) as f32;
            // Five standard errors of a share that varies by one of five particles a run.
            assert!((share - weight).abs() < 5.0 * 0.1 / 63.0, "{k}: {share}");
        }
    }

    #[test]
    fn weights_beyond_all_numbers_stay_weights() {
        let mut some = particles([1.0; 3]);
        for (particle, weight) in some.iter_mut().zip([-3e5, -3.1e5, f32::NAN]) {
            particle.log_weight = weight;
        }
        normalise(&mut some);
        assert_eq!(some.map(|p| p.log_weight), [0.0, -1e4, -1e6]);
        for nothing in [f32::NAN, f32::NEG_INFINITY] {
            for particle in &mut some {
                particle.log_weight = nothing;
            }
            normalise(&mut some);
            assert_eq!(some.map(|p| p.log_weight), [0.0; 3]);
        }
    }
}
