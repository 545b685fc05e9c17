//! COIN-D4 frames.

use beamfix::lidar::Model;

use super::{Shot, Wire, xor};

/// Frames of 24 samples.
#[derive(Debug)]
pub struct Frames {
    speed_dhz: u8,
    shots: Vec<Shot>,
}

impl Frames {
    /// Frames of a sensor at the model's speed.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self {
            speed_dhz: model.revolutions_per_10s.min(127) as u8,
            shots: Vec::new(),
        }
    }
}

impl Wire for Frames {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if self.shots.len() < 24 {
            return;
        }
        let angle = |shot: &Shot| ((shot.angle * 46_080.0).round() as u32 % 46_080) as u16;
        let mut header = vec![0xaa, 0x55, self.speed_dhz << 1 | 1, 24];
        header.extend(angle(&self.shots[0]).to_le_bytes());
        header.extend(angle(&self.shots[23]).to_le_bytes());
        let mut samples = Vec::new();
        for shot in self.shots.drain(..) {
            let word = (shot.mm.round() as u16).min(0x3fff) << 2;
            samples.push(shot.intensity);
            samples.extend(word.to_le_bytes());
        }
        let all = [&header[..], &samples].concat();
        let even: Vec<u8> = all.iter().step_by(2).copied().collect();
        let odd: Vec<u8> = all.iter().skip(1).step_by(2).copied().collect();
        line.extend(header);
        line.extend([xor(&even), xor(&odd)]);
        line.extend(samples);
    }
}
