//! The model behind a field's bytes: a few numbers, and the bytes by distance that follow from them.

use crate::{
    config::{self, ConfigError},
    math,
};

/// Numbers of table 6.3.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FieldModel {
    z_hit: f32,
    z_rand: f32,
    z_max: f32,
    sigma: f32,
}

impl FieldModel {
    /// σ 0.075 m: 1.5 cells of 5 cm, so that the field bends smoothly from cell to cell; z_rand 0.1; z_max 12 m.
    pub const DEFAULT: Self = Self {
        z_hit: 0.9,
        z_rand: 0.1,
        z_max: 12.0,
        sigma: 0.075,
    };

    /// Weights of hits and of random returns (0.001…0.999, sum 1), longest range (0.5…100 m), spread of hits
    /// (0.005…1 m).
    ///
    /// # Errors
    /// [`ConfigError`] for a number out of its range, or weights that do not sum to 1.
    pub const fn new(z_hit: f32, z_rand: f32, z_max: f32, sigma: f32) -> Result<Self, ConfigError> {
        let checks = [
            config::within("z_hit", z_hit, 0.001, 0.999),
            config::within("z_rand", z_rand, 0.001, 0.999),
            config::within("z_max", z_max, 0.5, 100.0),
            config::within("sigma", sigma, 0.005, 1.0),
        ];
        if let Err(error) = config::all(&checks) {
            return Err(error);
        }
        let sum = z_hit + z_rand;
        if !(sum > 0.9999 && sum < 1.0001) {
            return Err(ConfigError::Sum { sum });
        }
        Ok(Self {
            z_hit,
            z_rand,
            z_max,
            sigma,
        })
    }

    /// Logarithm of the density `distance` metres from the nearest surface (nat, densities per metre).
    #[must_use]
    pub fn log_likelihood(&self, distance: f32) -> f32 {
        /// 1/√(2π).
        const PEAK: f32 = 0.398_942_28;
        let z = distance / self.sigma;
        let hit = self.z_hit * PEAK / self.sigma * math::exp(math::max(-0.5 * z * z, -80.0));
        math::ln(hit + self.z_rand / self.z_max)
    }

    /// How its bytes are to be read.
    #[must_use]
    pub fn scale(&self) -> Scale {
        let peak = self.log_likelihood(0.0);
        let floor = math::ln(self.z_rand / self.z_max);
        let step = (peak - floor) / 254.0;
        let code = 1 + math::round_to_i32((-math::ln(self.z_max) - floor) / step);
        Scale {
            floor,
            step,
            // A peak below 1/z_max makes no field; one code at each end stays free.
            unexplored: if code < 2 {
                2
            } else if code > 254 {
                254
            } else {
                code as u8
            },
            sigma: self.sigma,
        }
    }
}

/// What a field's bytes mean.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scale {
    /// Log-likelihood (nat) of byte 1: `ln(z_rand / z_max)`.
    pub floor: f32,
    /// From one byte to the next (nat).
    pub step: f32,
    /// The byte of unexplored cells, worth `1 / z_max`; no explored cell has it.
    pub unexplored: u8,
    /// Spread of hits (m).
    pub sigma: f32,
}

impl Scale {
    /// Byte of a cell `sigmas` standard deviations from a surface.
    pub(crate) fn byte_at(&self, sigmas: f32) -> u8 {
        let steps = 0.5 * sigmas * sigmas / self.step;
        255 - math::round_to_i32(math::min(steps, 250.0)) as u8
    }
}

/// The bytes of a model by squared distance: 528 bytes, made once, used where fields are built.
#[derive(Debug, Clone)]
pub struct Profile {
    /// 256ths of a byte over squares of distances in steps of a 256th of `reach_mm2`.
    bytes: [u16; 258],
    /// 2³² over `reach_mm2`, rounded down.
    per_mm2: u32,
    /// Beyond this the byte is 1 (mm²).
    reach_mm2: u32,
    scale: Scale,
}

impl Profile {
    /// The profile of `model`, out to where it is flat (4σ).
    #[must_use]
    pub fn new(model: &FieldModel) -> Self {
        let scale = model.scale();
        let reach = 4.0 * model.sigma;
        let reach_mm2 = math::round_to_i32(reach * reach * 1e6).unsigned_abs() + 1;
        let mut bytes = [0; 258];
        for (k, byte) in bytes.iter_mut().enumerate() {
            let distance = reach * math::sqrt(k as f32 / 256.0);
            let value = 1.0 + (model.log_likelihood(distance) - scale.floor) / scale.step;
            *byte = math::round_to_i32(value * 256.0) as u16;
        }
        Self {
            bytes,
            per_mm2: (u32::MAX).checked_div(reach_mm2).unwrap_or(0),
            reach_mm2,
            scale,
        }
    }

    /// How its bytes are to be read.
    #[must_use]
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    /// Distance (mm) from which on a cell is worth less than an unexplored one: 2.8σ by default.
    #[must_use]
    pub(crate) fn hit_reach_mm(&self) -> i32 {
        let limit = u16::from(self.scale.unexplored) << 8;
        let steps = self.bytes.iter().take_while(|&&byte| byte >= limit).count() as u32;
        let square = (u64::from(steps) * u64::from(self.reach_mm2)) >> 8;
        math::isqrt(square as u32) as i32 + 1
    }

    /// The byte of a cell whose middle is so far from the nearest surface (mm²).
    #[must_use]
    pub fn byte(&self, square_mm2: u32) -> u8 {
        if square_mm2 >= self.reach_mm2 {
            return 1;
        }
        // Below 2³²: `per_mm2` is at most 2³² over `reach_mm2`.
        let place = square_mm2.wrapping_mul(self.per_mm2) >> 16;
        let entry = (place >> 8) as usize;
        let (Some(&low), Some(&high)) = (self.bytes.get(entry), self.bytes.get(entry + 1)) else {
            return 1;
        };
        let (low, high) = (i32::from(low), i32::from(high));
        let fine = low + (((high - low) * (place & 255) as i32) >> 8);
        let byte = ((fine + 128) >> 8) as u8;
        if byte != self.scale.unexplored {
            byte
        } else if fine >= i32::from(byte) << 8 {
            byte + 1
        } else {
            byte - 1
        }
    }
}
