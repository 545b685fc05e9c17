//! A lidar as a pattern of beams in time: any order, any rate, noise by a data sheet.

use beamfix::scan::Range;
use core::f64::consts::{PI, TAU};

use super::noise::Noise;

/// A lidar.
#[derive(Debug, Clone, Copy)]
pub struct Sensor {
    /// Beams of a scan.
    pub beams: usize,
    /// Sector that they cover (rad), its middle straight ahead.
    pub sector: f64,
    /// Revolutions a second.
    pub rate: f64,
    /// Beams are measured clockwise.
    pub clockwise: bool,
    /// Every so many beams are taken by one turn of the mirror, the ones between by the next: 1 takes all at once.
    pub interleaved: usize,
    /// Beams are handed over by bearing, not by time.
    pub by_bearing: bool,
    /// Standard deviation of a range (m), and as a share of it.
    pub sigma: (f64, f64),
    /// Nearest and farthest range (m).
    pub reach: (f64, f64),
    /// Share of the beams that measure anything between nothing and the farthest range.
    pub outliers: f64,
    /// Share of the beams without a return.
    pub dropped: f64,
    /// Sectors without a return (rad in the lidar's frame): from, to.
    pub blind: Option<(f64, f64)>,
    /// One beam of each scan is handed over with a time so much later (s).
    pub late: f64,
}

impl Sensor {
    /// An LD06: 450 beams clockwise, ten times a second, 12 m, 1 cm.
    pub const LD06: Self = Self {
        beams: 450,
        sector: TAU,
        rate: 10.0,
        clockwise: true,
        interleaved: 1,
        by_bearing: false,
        sigma: (0.01, 0.0),
        reach: (0.05, 12.0),
        outliers: 0.0,
        dropped: 0.0,
        blind: None,
        late: 0.0,
    };

    /// A SICK LMS: 180 deg, 361 beams counter-clockwise, 80 m, 12 mm.
    pub const SICK: Self = Self {
        beams: 361,
        sector: PI * 361.0 / 360.0,
        rate: 7.0,
        clockwise: false,
        sigma: (0.012, 0.0),
        reach: (0.05, 80.0),
        ..Self::LD06
    };

    /// The same lidar in a mirror.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self {
            clockwise: !self.clockwise,
            blind: self.blind.map(|(from, to)| (-to, -from)),
            ..self
        }
    }

    /// Times (s) since the scan's start of its beams in the order in which they are handed over, with their bearings (rad).
    #[must_use]
    pub fn pattern(&self) -> Vec<(f64, f64)> {
        /// One turn of an interleaving mirror (s).
        const MIRROR: f64 = 1.0 / 75.0;
        let step = self.sector / self.beams as f64;
        let sign = if self.clockwise { -1.0 } else { 1.0 };
        let passes = self.interleaved.max(1);
        let mut pattern: Vec<(f64, f64)> = (0..self.beams)
            .map(|k| {
                let along = (k as f64 + 0.5) / self.beams as f64;
                let bearing = sign * (step * (k as f64 + 0.5) - 0.5 * self.sector);
                let time = if passes == 1 {
                    // The sector's share of a revolution.
                    along * self.sector.min(TAU) / TAU / self.rate
                } else {
                    ((k % passes) as f64 + along * self.sector / TAU) * MIRROR
                };
                (time, bearing)
            })
            .collect();
        if !self.by_bearing {
            pattern.sort_by(|a, b| a.0.total_cmp(&b.0));
        } else if self.clockwise {
            pattern.reverse();
        }
        pattern
    }

    /// What one beam measures whose first surface is `range` metres away.
    pub fn measure(&self, bearing: f64, range: Option<f64>, noise: &mut Noise) -> Range {
        // Drawn in any case, so that a beam's noise does not depend on the beams before it.
        let error = noise.normal(1.0);
        let (chance, wild) = (noise.even(0.0, 1.0), noise.even(0.0, 1.0));
        let blind = self
            .blind
            .is_some_and(|(from, to)| (from..to).contains(&bearing));
        let (nearest, farthest) = self.reach;
        let measured = if blind || chance < self.dropped {
            None
        } else if chance < self.dropped + self.outliers {
            Some(nearest + wild * (farthest - nearest))
        } else {
            range.map(|range| range + error * libm::hypot(self.sigma.0, self.sigma.1 * range))
        };
        let within = measured.filter(|range| (nearest..=farthest).contains(range));
        Range::from_mm(within.map_or(0, |range| libm::round(range * 1000.0) as u32))
    }
}
