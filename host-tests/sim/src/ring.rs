//! A ring of multi-zone time-of-flight rangers: few wide beams at once, each of which reports its nearest surface.

use core::f64::consts::TAU;

use beamfix::scan::{Beam, Bearing, Range};

use super::encoder::{Echo, Encoder};
use super::lidar::quality;
use super::noise::Noise;

/// Rays that a beam is cast with.
const RAYS: u32 = 9;

/// What a ring measures and how well.
#[derive(Debug, Clone, Copy)]
pub struct RingModel {
    /// Beams that a full ring has, each as wide as they are apart.
    pub beams: usize,
    /// Zones of a sensor, side by side.
    pub zones: usize,
    /// Every second sensor is missing.
    pub half: bool,
    /// Scans a second.
    pub rate: f64,
    /// Standard deviation of a range (m), and as a share of it.
    pub sigma: (f64, f64),
    /// Nearest and farthest range (m).
    pub reach: (f64, f64),
}

impl RingModel {
    /// Eight VL53L5CX of eight zones in 45°: 15 scans a second at a resolution of 8 x 8, 4 m. By its data sheet 15 mm up to
    /// 0.2 m and 5 % beyond are the limits of the error (three standard deviations).
    pub const VL53L5CX: Self = Self {
        beams: 64,
        zones: 8,
        half: false,
        rate: 15.0,
        sigma: (0.005, 0.0167),
        reach: (0.02, 4.0),
    };

    /// Four of these, with a gap as wide as each sees between them: 32 beams.
    pub const HALF: Self = Self {
        half: true,
        ..Self::VL53L5CX
    };

    /// Width of a beam (rad).
    #[must_use]
    pub fn width(&self) -> f64 {
        TAU / self.beams as f64
    }
}

/// A ring on a drive. It is read over I2C: nothing comes over a line.
#[derive(Debug, Clone)]
pub struct Ring {
    model: RingModel,
    noise: Noise,
    looks: usize,
    /// The scans so far: looks at the world until then, and the beams, counter-clockwise from behind, as
    /// recordings give beams of one moment.
    pub scans: Vec<(usize, Vec<Beam>)>,
}

impl Ring {
    /// Before its first scan.
    #[must_use]
    pub fn new(model: RingModel, seed: u64) -> Self {
        Self {
            model,
            noise: Noise::new(seed, 3),
            looks: 0,
            scans: Vec::new(),
        }
    }
}

impl Encoder for Ring {
    fn next_time_us(&self) -> f64 {
        1e6 * self.scans.len() as f64 / self.model.rate
    }

    fn fire(&mut self, look: &mut dyn FnMut(f64, f64) -> Option<Echo>, _line: &mut Vec<u8>) {
        let (time_us, width) = (self.next_time_us(), self.model.width());
        let model = self.model;
        let is_there = |k: &usize| !model.half || (k / model.zones).is_multiple_of(2);
        let mut beams: Vec<Beam> = (0..model.beams)
            .filter(is_there)
            .map(|k| {
                let middle = width * k as f64;
                let rays = (0..RAYS).filter_map(|ray| {
                    let off = (f64::from(ray) + 0.5) / f64::from(RAYS) - 0.5;
                    Some(look(time_us, middle + width * off)?.range_mm * 1e-3)
                });
                let nearest = rays.reduce(f64::min);
                // Drawn in any case, so that a beam's noise does not depend on the beams before it.
                let error = self.noise.normal(1.0);
                let (fixed, share) = self.model.sigma;
                let (low, high) = self.model.reach;
                let metres = nearest
                    .map(|range| range + error * libm::hypot(fixed, share * range))
                    .filter(|range| (low..=high).contains(range));
                let mm = metres.map(|range| libm::round(range * 1000.0));
                Beam {
                    bearing: Bearing::from_radians(middle as f32),
                    range: Range::from_mm(mm.unwrap_or(0.0) as u32),
                    time_us: time_us as u64 as u32,
                    quality: quality(mm),
                }
            })
            .collect();
        beams.sort_by_key(|beam| beam.bearing.0 as i16);
        self.looks += beams.len() * RAYS as usize;
        self.scans.push((self.looks, beams));
    }
}
