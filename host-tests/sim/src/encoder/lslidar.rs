//! LSLIDAR N10 and N10P frames.

use beamfix::lidar::model::Returns;

use super::{Shot, Wire};

/// Frames of 16 points.
#[derive(Debug)]
pub struct Frames {
    returns: Returns,
    shots: Vec<Shot>,
}

impl Frames {
    /// Frames of points with so many returns.
    #[must_use]
    pub fn new(returns: Returns) -> Self {
        Self {
            returns,
            shots: Vec::new(),
        }
    }
}

impl Wire for Frames {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if self.shots.len() < 16 {
            return;
        }
        let angle = |shot: &Shot| ((shot.angle * 36_000.0).round() as u32 % 36_000) as u16;
        // What the three bytes behind the head say is not known to be the same everywhere.
        let mut frame = vec![0xa5, 0x5a, 0, 0, 0];
        frame.extend(angle(&self.shots[0]).to_be_bytes());
        let last = angle(&self.shots[15]);
        for shot in self.shots.drain(..) {
            frame.extend((shot.mm.round() as u16).to_be_bytes());
            frame.push(shot.intensity);
            if self.returns == Returns::Two {
                // Behind glass: a weaker return half a metre farther.
                frame.extend((shot.mm.round() as u16 + 500).to_be_bytes());
                frame.push(shot.intensity / 2);
            }
        }
        frame.extend(last.to_be_bytes());
        let sum = frame.iter().map(|byte| u32::from(*byte)).sum::<u32>();
        frame.push(sum as u8);
        line.extend(frame);
    }
}
