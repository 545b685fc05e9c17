//! RPLIDAR ultra and ultra-dense capsules.

use super::rplidar::{capsule, start};
use super::{Shot, Wire};

/// 96 points: 32 distances, and two differences after each.
#[derive(Debug, Default)]
pub struct Ultra {
    shots: Vec<Shot>,
    begun: bool,
}

impl Ultra {
    /// Nothing measured.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// 12 bits of a distance (mm), the bits that it loses, and the distance that is left of it.
fn major(mm: f64) -> (u32, u32, i64) {
    let mm = mm.round() as i64;
    for (base, code, bits) in [
        (16_384, 3328, 4),
        (4096, 1792, 3),
        (2048, 1280, 2),
        (512, 512, 1),
    ] {
        if mm >= base {
            let steps = ((mm - base) >> bits).min(4095 - code);
            return ((code + steps) as u32, bits, base + (steps << bits));
        }
    }
    (mm as u32, 0, mm)
}

/// 10 bits of a difference to a base with so many bits less; the code for none where it does not fit.
fn difference(mm: f64, base: i64, bits: u32) -> u32 {
    const NONE: i64 = -512;
    let steps = (mm.round() as i64 - base) >> bits;
    let fits = mm > 0.0 && (-511..=510).contains(&steps) && base + (steps << bits) > 0;
    (if fits { steps } else { NONE } & 0x3ff) as u32
}

impl Wire for Ultra {
    fn shift(&self, mm: f64) -> f64 {
        let quarters = (mm * 4.0) as i64;
        let radians_q16 = if quarters >= 200 {
            let k = 98_361 / quarters;
            9150 - (k << 6) - k * k * k / 98_304
        } else {
            8578
        };
        -(radians_q16 as f64) / 65_536.0 / std::f64::consts::TAU
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        // The last differences refer to the next capsule's first distance.
        if self.shots.len() < 97 {
            return;
        }
        if !self.begun {
            line.extend([0xa5, 0x5a, 0x84, 0x00, 0x00, 0x40, 0x84]);
        }
        let mut body = start(self.shots[0].angle, self.begun).to_vec();
        self.begun = true;
        for k in (0..96).step_by(3) {
            let (code, bits, mm) = major(self.shots[k].mm);
            let (_, next_bits, next_mm) = major(self.shots[k + 3].mm);
            let missing = mm == 0 && next_mm != 0;
            let (base, base_bits) = if missing {
                (next_mm, next_bits)
            } else {
                (mm, bits)
            };
            let first = difference(self.shots[k + 1].mm, base, base_bits);
            let second = difference(self.shots[k + 2].mm, next_mm, next_bits);
            body.extend((code | first << 12 | second << 22).to_le_bytes());
        }
        self.shots.drain(..96);
        capsule(&body, line);
    }
}

/// 64 points of 20 bits.
#[derive(Debug, Default)]
pub struct UltraDense {
    shots: Vec<Shot>,
    begun: bool,
}

impl UltraDense {
    /// Nothing measured.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// 20 bits of distance and quality: the farther, the coarser.
fn word(shot: &Shot) -> u32 {
    let quarters = (shot.mm * 4.0).round() as u32;
    let quality = u32::from(shot.intensity);
    for (scale, factor, base, bits) in [(0, 2, 0, 12), (1, 3, 2046 * 4, 13), (2, 4, 8187 * 4, 14)] {
        let steps = (quarters.saturating_sub(base) / factor) & !3;
        if steps < 1 << bits {
            return scale | steps | (quality >> scale) << bits;
        }
    }
    let steps = ((quarters - 24_567 * 4) / 5).min(0x7ffc) & !3;
    3 | steps | (quality >> 3) << 15
}

impl Wire for UltraDense {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if self.shots.len() < 64 {
            return;
        }
        if !self.begun {
            line.extend([0xa5, 0x5a, 0xaa, 0x00, 0x00, 0x40, 0x86]);
        }
        let mut body = (self.shots[0].time_us as u32).to_le_bytes().to_vec();
        body.extend([0, 0]);
        body.extend(start(self.shots[0].angle, self.begun));
        self.begun = true;
        for pair in self.shots.chunks(2) {
            let (a, b) = (word(&pair[0]), word(&pair[1]));
            body.extend((a as u16).to_le_bytes());
            body.extend((b as u16).to_le_bytes());
            body.push((a >> 16 | b >> 16 << 4) as u8);
        }
        self.shots.clear();
        capsule(&body, line);
    }
}
