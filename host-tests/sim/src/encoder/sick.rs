//! SICK LMS2xx: 181 measurements from right to left, once a turn of the mirror.

use beamfix::lidar::Model;

use super::{Shot, Sweep, Wire};

/// Scans of 181 values in millimetres.
#[derive(Debug, Default)]
pub struct Scans {
    shots: Vec<Shot>,
}

impl Scans {
    /// Nothing measured.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// The sensor's CRC-16, as its listing has it: the byte and the one before go into the register together.
fn crc(bytes: &[u8]) -> u16 {
    let (mut crc, mut last) = (0u32, 0u32);
    for &byte in bytes {
        let byte = u32::from(byte);
        crc = if crc & 0x8000 != 0 {
            (crc & 0x7fff) << 1 ^ 0x8005
        } else {
            crc << 1
        };
        crc ^= byte | last << 8;
        last = byte;
    }
    crc as u16
}

impl Wire for Scans {
    fn sweep(&self, model: &Model) -> Sweep {
        let sweep_us = 1e7 / f64::from(model.revolutions_per_10s);
        Sweep {
            first: 0.0,
            step: 1.0 / 360.0,
            period_us: sweep_us / 360.0,
            beams: 181,
            sweep_us,
        }
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if self.shots.len() < 181 {
            return;
        }
        let mut frame = vec![0x02, 0x80];
        frame.extend((1 + 2 + 2 * 181 + 1u16).to_le_bytes());
        frame.push(0xb0);
        frame.extend((0x4000 | 181u16).to_le_bytes());
        for shot in self.shots.drain(..) {
            let value = if shot.mm > 0.0 {
                (shot.mm.round() as u16).min(0x1ff7)
            } else {
                0x1ff7
            };
            frame.extend(value.to_le_bytes());
        }
        frame.push(0x10);
        frame.extend(crc(&frame).to_le_bytes());
        line.extend(frame);
    }
}
