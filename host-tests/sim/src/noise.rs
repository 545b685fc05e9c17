//! Seeded random numbers that are the same everywhere.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// A stream of random numbers; streams of one seed do not depend on each other.
#[derive(Debug, Clone)]
pub struct Noise(ChaCha8Rng);

impl Noise {
    /// Stream number `stream` of `seed`.
    #[must_use]
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self(rng)
    }

    /// Even in `[low, high)`.
    pub fn even(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// Normal with mean 0 and standard deviation `sigma`.
    pub fn normal(&mut self, sigma: f64) -> f64 {
        // Box and Muller; 1 - u is never 0.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.even(0.0, 1.0)));
        sigma * radius * libm::cos(self.even(0.0, core::f64::consts::TAU))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_have_their_mean_and_spread() {
        let mut noise = Noise::new(1, 0);
        let values: Vec<f64> = (0..20_000).map(|_| noise.normal(2.0)).collect();
        let mean = values.iter().sum::<f64>() / 20_000.0;
        let spread = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 20_000.0;
        // Five standard errors: 2/√20000 = 0.014 and 4·√(2/20000) = 0.04.
        assert!(
            mean.abs() < 0.07 && (spread - 4.0).abs() < 0.2,
            "{mean} {spread}"
        );
    }
}
