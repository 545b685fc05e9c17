//! Sensors with a point for each degree: XV-11 and LDS02RR, the XV-11's early firmware, LDS-006, LDS-01.

use beamfix::lidar::Model;

use super::{Shot, Sweep, Wire, fold};

/// Which sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Xv11,
    Xv11Early,
    Lds006,
    Lds01,
}

/// Frames of 4, 6 or 360 degrees.
#[derive(Debug)]
pub struct Frames {
    kind: Kind,
    shots: Vec<Shot>,
}

impl Frames {
    /// 22 bytes for 4 degrees.
    #[must_use]
    pub fn xv11() -> Self {
        Self {
            kind: Kind::Xv11,
            shots: Vec::new(),
        }
    }

    /// 1446 bytes for a turn.
    #[must_use]
    pub fn xv11_early() -> Self {
        Self {
            kind: Kind::Xv11Early,
            ..Self::xv11()
        }
    }

    /// 22 bytes for 4 degrees, summed.
    #[must_use]
    pub fn lds006() -> Self {
        Self {
            kind: Kind::Lds006,
            ..Self::xv11()
        }
    }

    /// 42 bytes for 6 degrees.
    #[must_use]
    pub fn lds01() -> Self {
        Self {
            kind: Kind::Lds01,
            ..Self::xv11()
        }
    }
}

/// Distance word of the XV-11: bit 15 and an error code where there is none.
pub(super) fn word(mm: f64) -> u16 {
    if mm > 0.0 {
        (mm.round() as u16).min(0x3fff)
    } else {
        0x8035
    }
}

impl Wire for Frames {
    fn sweep(&self, model: &Model) -> Sweep {
        Sweep {
            first: 0.0,
            step: 1.0 / 360.0,
            ..Sweep::turning(model)
        }
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        let points = match self.kind {
            Kind::Xv11 | Kind::Lds006 => 4,
            Kind::Lds01 => 6,
            Kind::Xv11Early => 360,
        };
        if self.shots.len() < points {
            return;
        }
        let index = (self.shots[0].angle * 360.0).round() as usize / points;
        // All turn 300 times a minute.
        let mut frame = match self.kind {
            Kind::Xv11 => [
                &[0xfa, 0xa0 + index as u8],
                &(300u16 * 64).to_le_bytes()[..],
            ]
            .concat(),
            Kind::Lds006 => [&[0xfa, 0xa0 + index as u8], &30_000u16.to_le_bytes()[..]].concat(),
            Kind::Lds01 => [&[0xfa, 0xa0 + index as u8], &3000u16.to_le_bytes()[..]].concat(),
            Kind::Xv11Early => vec![0x5a, 0xa5, 0x00, 0xc0, 0x98, 0xd1],
        };
        for shot in self.shots.drain(..) {
            let strength = (u16::from(shot.intensity) << 4).to_le_bytes();
            if self.kind == Kind::Lds01 {
                frame.extend(strength);
                frame.extend((shot.mm.round() as u16).to_le_bytes());
                frame.extend([0, 0]);
            } else {
                frame.extend(word(shot.mm).to_le_bytes());
                frame.extend(strength);
            }
        }
        match self.kind {
            Kind::Xv11 => frame.extend(fold(&frame).to_le_bytes()),
            Kind::Lds006 => {
                let sum = frame.iter().map(|byte| u16::from(*byte)).sum::<u16>();
                frame.extend(sum.to_le_bytes());
            }
            Kind::Lds01 => {
                let sum = frame.iter().map(|byte| u32::from(*byte)).sum::<u32>();
                frame.extend([255 - (sum & 255) as u8; 2]);
            }
            Kind::Xv11Early => {}
        }
        line.extend(frame);
    }
}
