//! What a simulated lidar measures: one beam from where it is at that moment.

use beamfix::scan::{Beam, Bearing, Range};

use super::noise::Noise;
use super::pose::TruePose;
use super::world::World;

/// What a sensor can measure.
#[derive(Debug, Clone, Copy)]
pub struct Ranging {
    /// Standard deviation of a range (m). Default 0.01.
    pub sigma: f64,
    /// Nearest range (m). Default 0.02.
    pub nearest: f64,
    /// Farthest range (m). Default 12.
    pub farthest: f64,
}

impl Ranging {
    /// The LD06.
    pub const DEFAULT: Self = Self {
        sigma: 0.01,
        nearest: 0.02,
        farthest: 12.0,
    };

    /// What there is, however far.
    pub const TRUE: Self = Self {
        sigma: 0.0,
        nearest: 0.0,
        farthest: f64::INFINITY,
    };

    /// Range (mm, with noise) from `sensor` in the direction `bearing` (rad, counter-clockwise from its front).
    pub fn measure(
        &self,
        world: &World,
        sensor: TruePose,
        bearing: f64,
        noise: &mut Noise,
    ) -> Option<f64> {
        let direction = sensor.theta + bearing;
        let towards = [libm::cos(direction), libm::sin(direction)];
        // Drawn in any case, so that a shot's noise does not depend on the shots before it.
        let error = noise.normal(self.sigma);
        let range = world.cast([sensor.x, sensor.y], towards)? + error;
        (self.nearest..=self.farthest)
            .contains(&range)
            .then_some(range * 1000.0)
    }
}

/// A scan taken at one moment, for scan pairs.
#[derive(Debug, Clone, Copy)]
pub struct Still {
    /// Number of beams.
    pub beams: usize,
    /// Direction of the first (rad).
    pub first: f64,
    /// From one to the next, counter-clockwise (rad).
    pub step: f64,
    /// What the sensor can measure.
    pub ranging: Ranging,
}

impl Still {
    /// `beams` all around, starting behind.
    #[must_use]
    pub fn full_turn(beams: usize) -> Self {
        use core::f64::consts::{PI, TAU};
        Self {
            beams,
            first: -PI,
            step: TAU / beams as f64,
            ranging: Ranging::DEFAULT,
        }
    }

    /// The beams seen from `sensor`, all at time 0.
    pub fn scan(&self, world: &World, sensor: TruePose, noise: &mut Noise) -> Vec<Beam> {
        (0..self.beams)
            .map(|k| {
                let bearing = self.first + self.step * k as f64;
                let mm = self.ranging.measure(world, sensor, bearing, noise);
                Beam {
                    bearing: Bearing::from_radians(bearing as f32),
                    range: Range::from_mm(libm::round(mm.unwrap_or(0.0)) as u32),
                    time_us: 0,
                    quality: quality(mm),
                }
            })
            .collect()
    }
}

/// Strength of a return: falls with the distance, as on the sensors.
#[must_use]
pub fn quality(range_mm: Option<f64>) -> u8 {
    range_mm.map_or(0, |mm| 250 - (mm / 64.0).clamp(0.0, 200.0) as u8)
}
