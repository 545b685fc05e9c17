//! 3irobotix Delta frames.

use beamfix::lidar::Model;
use beamfix::lidar::model::Sector;

use super::{Shot, Sweep, Wire};

/// A sixteenth or a fifteenth of a turn in each frame.
#[derive(Debug)]
pub struct Frames {
    per_turn: u64,
    points: u64,
    turns_per_s: f64,
    shots: Vec<Shot>,
}

impl Frames {
    /// Frames of this part of a turn, with the model's speed and about its number of points.
    #[must_use]
    pub fn new(sector: Sector, model: &Model) -> Self {
        let per_turn = match sector {
            Sector::Sixteenth => 16,
            Sector::Fifteenth => 15,
        };
        let turns_per_s = f64::from(model.revolutions_per_10s) / 10.0;
        let points = f64::from(model.points_per_s) / turns_per_s / per_turn as f64;
        Self {
            per_turn,
            points: points as u64,
            // Whole steps of the speed that a frame can say.
            turns_per_s: (turns_per_s / 0.05).round() * 0.05,
            shots: Vec::new(),
        }
    }
}

impl Wire for Frames {
    fn sweep(&self, _: &Model) -> Sweep {
        let per_turn = (self.per_turn * self.points) as f64;
        Sweep {
            first: 0.0,
            step: 1.0 / per_turn,
            period_us: 1e6 / (self.turns_per_s * per_turn),
            beams: u64::MAX,
            sweep_us: 0.0,
        }
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if (self.shots.len() as u64) < self.points {
            return;
        }
        let data = 5 + 3 * self.points as u16;
        let start = ((self.shots[0].angle * 36_000.0).round() as u32 % 36_000) as u16;
        let mut frame = vec![0xaa];
        frame.extend((data + 8).to_be_bytes());
        frame.extend([0x01, 0x61, 0xad]);
        frame.extend(data.to_be_bytes());
        frame.push((self.turns_per_s / 0.05).round() as u8);
        frame.extend((-35i16).to_be_bytes());
        frame.extend(start.to_be_bytes());
        for shot in self.shots.drain(..) {
            frame.push(shot.intensity);
            frame.extend(((shot.mm * 4.0).round().min(65_535.0) as u16).to_be_bytes());
        }
        let sum = frame.iter().map(|byte| u32::from(*byte)).sum::<u32>();
        frame.extend((sum as u16).to_be_bytes());
        line.extend(frame);
    }
}
