//! Frames of Camsense sensors and their relatives.

use std::f64::consts::TAU;

use beamfix::lidar::Model;
use beamfix::lidar::model::Camsense;

use super::{Shot, Wire, fold, grid, q6};

/// Frames of 8, 12 or 16 points.
#[derive(Debug)]
pub struct Frames {
    sensor: Camsense,
    kind: u8,
    points: usize,
    speed_rpm_q6: u16,
    shots: Vec<Shot>,
}

impl Frames {
    /// Frames of one of the family's models.
    #[must_use]
    pub fn new(sensor: Camsense, model: &Model) -> Self {
        let (kind, points) = match model.name {
            "lds08rr" => (7, 12),
            "mystery-360" => (0x23, 16),
            _ => (3, 8),
        };
        Self {
            sensor,
            kind,
            points,
            speed_rpm_q6: model.revolutions_per_10s * 6 * 64,
            shots: Vec::new(),
        }
    }

    /// Distance between laser and receiver (mm).
    fn baseline(&self) -> f64 {
        match self.sensor {
            Camsense::X1 => 20.0,
            Camsense::X2 => 17.92,
            _ => 0.0,
        }
    }

    fn angle(&self, shot: &Shot) -> [u8; 2] {
        match self.sensor {
            Camsense::T2 => ((shot.angle * 36_000.0).round() as u32 % 36_000) as u16,
            _ => q6(shot.angle) + 0xa000,
        }
        .to_le_bytes()
    }
}

impl Wire for Frames {
    /// The middle of the sensor, the laser beside it and the place that it hits make a right angle at the laser.
    fn shift(&self, mm: f64) -> f64 {
        (self.baseline() / mm.max(40.0)).asin() / TAU
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if self.shots.len() < self.points {
            return;
        }
        let mut frame = vec![0x55, 0xaa, self.kind, self.points as u8];
        frame.extend(self.speed_rpm_q6.to_le_bytes());
        frame.extend(self.angle(&self.shots[0]));
        let last = self.angle(&self.shots[self.points - 1]);
        let baseline = self.baseline();
        // The Mystery 360 calls every point weak.
        let weak = if self.kind == 0x23 { 0x4000 } else { 0 };
        for shot in self.shots.drain(..) {
            let mm = (shot.mm * shot.mm - baseline * baseline).max(0.0).sqrt();
            frame.extend((grid::word(mm) | weak).to_le_bytes());
            frame.push(shot.intensity);
            if self.kind == 7 {
                frame.push(0);
            }
        }
        frame.extend(last);
        frame.extend(fold(&frame).to_le_bytes());
        line.extend(frame);
    }
}
