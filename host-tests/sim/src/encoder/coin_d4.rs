//! COIN-D4 frames, written from the fields that its open drivers take apart, not from YDLIDAR's.

use beamfix::lidar::Model;

use super::{Shot, Wire};

/// Frames of 25 samples; a new revolution begins a new frame.
#[derive(Debug)]
pub struct Frames {
    speed_dhz: u8,
    shots: Vec<Shot>,
    begins: bool,
}

impl Frames {
    /// Frames of a sensor at the model's speed.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self {
            speed_dhz: model.revolutions_per_10s.min(127) as u8,
            shots: Vec::new(),
            begins: false,
        }
    }

    fn send(&mut self, line: &mut Vec<u8>) {
        let shots = std::mem::take(&mut self.shots);
        let (Some(first), Some(last)) = (shots.first(), shots.last()) else {
            return;
        };
        // 1/64 degrees above a bit that is always set.
        let angle = |shot: &Shot| ((shot.angle * 23_040.0).round() as u16 % 23_040) * 2 + 1;
        let kind = match std::mem::take(&mut self.begins) {
            true => self.speed_dhz * 2 + 1,
            false => 0,
        };
        let (start, end) = (angle(first), angle(last));
        let mut code = 0x55aa ^ start ^ end ^ (u16::from(kind) + shots.len() as u16 * 256);
        let mut samples = Vec::new();
        for shot in &shots {
            let mm = (shot.mm.round() as u16).min(0x3fff);
            // 14 bits of distance, 8 of intensity, one of exposure, one that nobody knows.
            let bits = u32::from(mm) << 10
                | u32::from(shot.intensity >> 6) << 8
                | u32::from(shot.intensity & 0x3f) << 2;
            let [b0, b1, b2, _] = bits.to_le_bytes();
            code ^= u16::from(b0) ^ (u16::from(b1) | u16::from(b2) << 8);
            samples.extend([b0, b1, b2]);
        }
        line.extend([0xaa, 0x55, kind, shots.len() as u8]);
        for word in [start, end, code] {
            line.extend(word.to_le_bytes());
        }
        line.extend(samples);
    }
}

impl Wire for Frames {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        if self
            .shots
            .last()
            .is_some_and(|last| shot.angle < last.angle)
        {
            self.send(line);
            self.begins = true;
        }
        self.shots.push(shot);
        if self.shots.len() == 25 {
            self.send(line);
        }
    }
}
