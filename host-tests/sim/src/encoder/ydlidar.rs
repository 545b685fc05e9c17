//! YDLIDAR frames.

use std::f64::consts::TAU;

use beamfix::lidar::Model;
use beamfix::lidar::model::{Correction, Flags, Samples};

use super::{Shot, Wire, q6};

/// Frames of up to 40 samples; the first of a turn stands alone.
#[derive(Debug)]
pub struct Frames {
    samples: Samples,
    speed_dhz: u8,
    shots: Vec<Shot>,
    last: f64,
}

impl Frames {
    /// Frames of samples of this kind.
    #[must_use]
    pub fn new(samples: Samples, model: &Model) -> Self {
        Self {
            samples,
            speed_dhz: (model.revolutions_per_10s - u16::from(samples.speed_offset_dhz)).min(127)
                as u8,
            shots: Vec::new(),
            last: 1.0,
        }
    }

    fn sample(&self, shot: &Shot) -> Vec<u8> {
        let units = shot.mm * 4.0 / f64::from(self.samples.unit_q2);
        let word = units.round().clamp(0.0, 65_535.0) as u16;
        let [low, high] = word.to_le_bytes();
        match (self.samples.bytes, self.samples.flags) {
            (2, _) => vec![low, high],
            (3, Flags::None) => vec![shot.intensity, low, high],
            (3, Flags::Doubt) => vec![shot.intensity, low & !3, high],
            (3, Flags::Intensity) => {
                let [first, flags] = (u16::from(shot.intensity) * 4).to_le_bytes();
                vec![first, low & !3 | flags, high]
            }
            _ => vec![shot.intensity, 0, low, high],
        }
    }

    fn send(&mut self, starts: bool, line: &mut Vec<u8>) {
        let shots = std::mem::take(&mut self.shots);
        let (Some(first), Some(last)) = (shots.first(), shots.last()) else {
            return;
        };
        let kind = if starts { self.speed_dhz << 1 | 1 } else { 0 };
        let mut words = vec![0x55aa, u16::from_le_bytes([kind, shots.len() as u8])];
        words.push(q6(first.angle) << 1 | 1);
        words.push(q6(last.angle) << 1 | 1);
        let mut code = words.iter().fold(0, |a, b| a ^ b);
        let samples: Vec<u8> = shots.iter().flat_map(|shot| self.sample(shot)).collect();
        for sample in samples.chunks(self.samples.bytes.into()) {
            let (first, word) = sample.split_at(sample.len() - 2);
            code ^= match *first {
                [] => 0,
                [byte] => u16::from(byte),
                [a, b, ..] => u16::from(a) | u16::from(b) << 8,
            };
            code ^= u16::from(word[0]) | u16::from(word[1]) << 8;
        }
        words.push(code);
        line.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        line.extend(samples);
    }
}

impl Wire for Frames {
    fn shift(&self, mm: f64) -> f64 {
        match self.samples.correction {
            Correction::None => 0.0,
            Correction::Triangle => (21.8 * (155.3 - mm) / (155.3 * mm)).atan() / TAU,
            Correction::Scl => (17.8 / mm).atan() / TAU,
        }
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        let starts = shot.angle < self.last;
        self.last = shot.angle;
        if starts {
            self.send(false, line);
        }
        self.shots.push(shot);
        if starts || self.shots.len() == 40 {
            self.send(starts, line);
        }
    }
}
