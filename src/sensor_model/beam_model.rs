//! Likelihood of a range where the map says another: Thrun, Burgard, Fox, *Probabilistic Robotics*, table 6.1.
//!
//! A mixture of a hit with noise, something unexpected in the way, no return, and anything at all. It is not
//! smooth in the pose and takes beams as independent: use it to judge poses, not to climb.

#[cfg(not(feature = "internals"))]
pub(crate) mod learning;
#[cfg(feature = "internals")]
pub mod learning;

use crate::config::{self, ConfigError};
use crate::math;

/// The mixture's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BeamModel {
    /// Weight of hits.
    pub z_hit: f32,
    /// Weight of unexpected things in the way.
    pub z_short: f32,
    /// Weight of beams without a return.
    pub z_max: f32,
    /// Weight of ranges that mean nothing.
    pub z_rand: f32,
    /// Spread of hits (m).
    pub sigma: f32,
    /// Unexpected things per metre.
    pub lambda: f32,
    /// Longest range (m).
    pub range_max: f32,
}

impl BeamModel {
    /// Where learning starts: an indoor lidar of 12 m.
    pub const DEFAULT: Self = Self {
        z_hit: 0.8,
        z_short: 0.08,
        z_max: 0.04,
        z_rand: 0.08,
        sigma: 0.05,
        lambda: 0.5,
        range_max: 12.0,
    };

    /// The same, if it is a model: weights from 0.0001 on that sum to one, σ 1 mm…2 m, λ 0.01…20 per metre,
    /// longest range 0.5…100 m.
    ///
    /// # Errors
    /// [`ConfigError`] for a number out of its range, or weights that do not sum to 1.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("z_hit", self.z_hit, 0.0001, 1.0),
            config::within("z_short", self.z_short, 0.0001, 1.0),
            config::within("z_max", self.z_max, 0.0001, 1.0),
            config::within("z_rand", self.z_rand, 0.0001, 1.0),
            config::within("sigma", self.sigma, 0.001, 2.0),
            config::within("lambda", self.lambda, 0.01, 20.0),
            config::within("range_max", self.range_max, 0.5, 100.0),
        ];
        if let Err(error) = config::all(&checks) {
            return Err(error);
        }
        let sum = self.z_hit + self.z_short + self.z_max + self.z_rand;
        if !(sum >= 0.999 && sum <= 1.001) {
            return Err(ConfigError::Sum { sum });
        }
        Ok(self)
    }

    /// Weighted densities of the four causes: hit, unexpected, none, anything (1/m; a share for a beam without a
    /// return). `range` is `None` for a beam without a return.
    #[must_use]
    pub(crate) fn causes(&self, range: Option<f32>, expected: f32) -> [f32; 4] {
        /// 1/√(2π).
        const PEAK: f32 = 0.398_942_28;
        let Some(z) = range.filter(|z| *z < self.range_max) else {
            return [0.0, 0.0, self.z_max, 0.0];
        };
        let off = (z - expected) / self.sigma;
        let inside = normal_below((self.range_max - expected) / self.sigma)
            - normal_below(-expected / self.sigma);
        let hit = PEAK / self.sigma * math::exp(math::max(-0.5 * off * off, -80.0))
            / math::max(inside, 1e-3);
        let short = if z <= expected {
            let cut = 1.0 - math::exp(-self.lambda * expected);
            self.lambda * math::exp(-self.lambda * z) / math::max(cut, 1e-3)
        } else {
            0.0
        };
        [
            self.z_hit * hit,
            self.z_short * short,
            0.0,
            self.z_rand / self.range_max,
        ]
    }

    /// Likelihood of a range (1/m), or of none (a share), where `expected` (m) is what the map says.
    #[must_use]
    pub fn likelihood(&self, range: Option<f32>, expected: f32) -> f32 {
        let [hit, short, none, anything] = self.causes(range, expected);
        hit + short + none + anything
    }
}

impl Default for BeamModel {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Share of a normal distribution below `x` standard deviations; off by at most 8e-8 (Abramowitz, Stegun 26.2.17).
fn normal_below(x: f32) -> f32 {
    /// The formula's p.
    const P: f32 = 0.231_641_9;
    /// 1/√(2π).
    const PEAK: f32 = 0.398_942_28;
    let t = 1.0 / (1.0 + P * math::abs(x));
    let poly = t
        * (0.319_381_53
            + t * (-0.356_563_78 + t * (1.781_477_9 + t * (-1.821_256 + t * 1.330_274_4))));
    let tail = PEAK * math::exp(math::max(-0.5 * x * x, -80.0)) * poly;
    if x < 0.0 { tail } else { 1.0 - tail }
}

/// A beam model as integers: two tables and one logarithm, 2 KB in all.
///
/// Off by at most 0.1 nat from [`BeamModel::likelihood`] where the expected range is 3σ and more from both ends.
#[derive(Debug, Clone)]
pub struct BeamTable {
    /// Density of hits over the distance from the expected range, Q16 per metre.
    hit: [u32; 256],
    /// Of unexpected things over the range, before it is cut at the expected one.
    short: [u32; 128],
    /// One over what the cut leaves, Q12.
    cut: [u32; 128],
    /// log2 of 1…2, Q16.
    log: [u16; 65],
    /// Millimetres per entry of `short` and `cut`: 2 to this.
    step: u32,
    /// Entries of `hit` per millimetre, Q16.
    hit_per_mm: u32,
    anything: u32,
    none: i32,
    range_max_mm: u16,
    /// Spread of hits (m).
    sigma: f32,
}

impl BeamTable {
    /// Tables of `model`.
    #[must_use]
    pub fn new(model: &BeamModel) -> Self {
        let one =
            |density: f32| math::round_to_i32(math::min(density * 65_536.0, 2e9)).unsigned_abs();
        let range_max_mm = math::round_to_i32(math::min(model.range_max, 65.0) * 1000.0) as u16;
        let mut step = 0;
        while (u32::from(range_max_mm) >> step) > 126 {
            step += 1;
        }
        let mut hit = [0; 256];
        for (k, density) in hit.iter_mut().enumerate() {
            let off = (k as f32 + 0.5) / 256.0 * 5.0 * model.sigma;
            // Far from both ends, where nothing of the distribution is cut off.
            let middle = 0.5 * model.range_max;
            *density = one(model.causes(Some(middle + off), middle)[0]);
        }
        let mut short = [0; 128];
        let mut cut = [0; 128];
        for (k, (density, cut)) in short.iter_mut().zip(&mut cut).enumerate() {
            let metres = (k as f32 + 0.5) * (1u32 << step) as f32 * 1e-3;
            *density = one(model.z_short * model.lambda * math::exp(-model.lambda * metres));
            let left = 1.0 - math::exp(-model.lambda * metres);
            *cut = math::round_to_i32(4096.0 / math::max(left, 0.01)).unsigned_abs();
        }
        let mut log = [0; 65];
        for (k, log) in log.iter_mut().enumerate() {
            let log2 = math::ln(1.0 + k as f32 / 64.0) * core::f32::consts::LOG2_E;
            *log = math::round_to_i32(math::min(log2 * 65_536.0, 65_535.0)) as u16;
        }
        let mut table = Self {
            hit,
            short,
            cut,
            log,
            step,
            hit_per_mm: math::round_to_i32(256.0 * 65.536 / (5.0 * model.sigma)).unsigned_abs(),
            anything: one(model.z_rand / model.range_max).max(1),
            none: 0,
            range_max_mm,
            sigma: model.sigma,
        };
        table.none = table.log_q8(one(model.z_max));
        table
    }

    /// Spread of hits (m).
    pub(crate) const fn sigma(&self) -> f32 {
        self.sigma
    }

    /// Longest range (mm).
    pub(crate) const fn range_max_mm(&self) -> u16 {
        self.range_max_mm
    }

    /// Log-likelihood of a range (mm; `None`: no return) where the map says `expected_mm`: 256ths of a nat.
    #[must_use]
    pub fn log_likelihood(&self, range_mm: Option<u16>, expected_mm: u16) -> i32 {
        let Some(range) = range_mm.filter(|range| *range < self.range_max_mm) else {
            return self.none;
        };
        let off = u32::from(range.abs_diff(expected_mm));
        // Below 2³² for 65 m and σ from 1 mm on, once cut to what the table holds.
        let entry = (u64::from(off) * u64::from(self.hit_per_mm)) >> 16;
        let hit = self.hit.get(entry as usize).copied().unwrap_or(0);
        let at = |table: &[u32; 128], mm: u16| {
            table.get((mm >> self.step) as usize).copied().unwrap_or(0)
        };
        let short = if range <= expected_mm {
            (u64::from(at(&self.short, range)) * u64::from(at(&self.cut, expected_mm))) >> 12
        } else {
            0
        };
        self.log_q8(
            hit.saturating_add(short as u32)
                .saturating_add(self.anything),
        )
    }

    /// Natural logarithm of a Q16 number, Q8.
    fn log_q8(&self, q16: u32) -> i32 {
        /// ln 2, Q16.
        const LN_2: i64 = 45_426;
        let value = q16.max(1);
        let zeros = value.leading_zeros();
        let mantissa = value << zeros;
        let entry = ((mantissa >> 25) & 63) as usize;
        let rest = ((mantissa >> 9) & 0xffff) as i64;
        let (low, high) = match (self.log.get(entry), self.log.get(entry + 1)) {
            (Some(&low), Some(&high)) => (i64::from(low), i64::from(high)),
            _ => (0, 0),
        };
        let log2 = ((31 - i64::from(zeros) - 16) << 16) + low + (((high - low) * rest) >> 16);
        ((log2 * LN_2) >> 24) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_and_the_missing_share_sum_to_one() {
        let model = BeamModel::DEFAULT;
        for expected in [0.3, 2.0, 6.0, 11.9] {
            let steps = 24_000;
            let sum: f64 = (0..steps)
                .map(|k| {
                    f64::from(
                        model.likelihood(Some((k as f32 + 0.5) * 12.0 / steps as f32), expected),
                    )
                })
                .sum();
            let all = sum * 12.0 / f64::from(steps) + f64::from(model.likelihood(None, expected));
            assert!((all - 1.0).abs() < 2e-3, "{expected}: {all}");
        }
    }

    #[test]
    fn tables_agree_with_the_formula() {
        for sigma in [0.02, 0.05, 0.3] {
            let model = BeamModel {
                sigma,
                ..BeamModel::DEFAULT
            };
            let table = BeamTable::new(&model);
            for expected in [2000u16, 5000, 9000] {
                for range in (100..11_900).step_by(37) {
                    let exact =
                        model.likelihood(Some(f32::from(range) * 1e-3), f32::from(expected) * 1e-3);
                    let exact = math::ln(exact);
                    let got = table.log_likelihood(Some(range), expected) as f32 / 256.0;
                    // Half an entry of the hit table is 0.01σ, of the others 64 mm.
                    assert!(
                        (got - exact).abs() < 0.1,
                        "{sigma} {expected} {range}: {got} {exact}"
                    );
                }
                let none = table.log_likelihood(None, expected) as f32 / 256.0;
                assert!((none - math::ln(model.z_max)).abs() < 0.01, "{none}");
            }
        }
    }

    #[test]
    fn what_is_no_model_is_refused() {
        let good = BeamModel::DEFAULT;
        assert_eq!(good.checked(), Ok(good));
        for (bad, setting) in [
            (BeamModel { sigma: 0.0, ..good }, "sigma"),
            (
                BeamModel {
                    z_rand: -0.1,
                    ..good
                },
                "z_rand",
            ),
            (
                BeamModel {
                    lambda: f32::NAN,
                    ..good
                },
                "lambda",
            ),
        ] {
            let refused = bad.checked().expect_err(setting);
            assert!(
                matches!(refused, ConfigError::OutOfRange { setting: named, .. } if named == setting),
                "{setting}: {refused}"
            );
        }
        let heavy = BeamModel { z_hit: 0.9, ..good }.checked();
        assert!(matches!(heavy, Err(ConfigError::Sum { .. })), "{heavy:?}");
    }
}
