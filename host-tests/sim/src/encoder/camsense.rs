//! Camsense X1 and LDS08RR frames.

use beamfix::lidar::Model;

use super::{Shot, Wire, fold, grid, q6};

/// Frames of 8 or 12 points.
#[derive(Debug)]
pub struct Frames {
    /// LDS08RR: 12 points, quality of 16 bits.
    is_wide: bool,
    speed_rpm_q6: u16,
    shots: Vec<Shot>,
}

impl Frames {
    /// Frames of the Camsense X1 or the LDS08RR.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self {
            is_wide: model.name == "lds08rr",
            speed_rpm_q6: model.revolutions_per_10s * 6 * 64,
            shots: Vec::new(),
        }
    }
}

impl Wire for Frames {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        let (kind, points) = if self.is_wide { (7, 12) } else { (3, 8) };
        if self.shots.len() < points {
            return;
        }
        let angle = |shot: &Shot| (q6(shot.angle) + 0xa000).to_le_bytes();
        let mut frame = vec![0x55, 0xaa, kind, points as u8];
        frame.extend(self.speed_rpm_q6.to_le_bytes());
        frame.extend(angle(&self.shots[0]));
        let last = angle(&self.shots[points - 1]);
        for shot in self.shots.drain(..) {
            frame.extend(grid::word(shot.mm).to_le_bytes());
            frame.push(shot.intensity);
            if self.is_wide {
                frame.push(0);
            }
        }
        frame.extend(last);
        frame.extend(fold(&frame).to_le_bytes());
        line.extend(frame);
    }
}
