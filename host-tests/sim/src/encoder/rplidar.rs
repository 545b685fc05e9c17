//! RPLIDAR standard scan, legacy express and dense capsules, HQ packets.

use super::{Shot, Wire, q6, xor};

/// Distance in quarter millimetres.
fn quarters(mm: f64) -> u32 {
    (mm * 4.0).round().max(0.0) as u32
}

/// Five bytes a point.
#[derive(Debug, Default)]
pub struct Scan {
    last: f64,
    begun: bool,
}

impl Scan {
    /// Not begun.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Wire for Scan {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        if !self.begun {
            line.extend([0xa5, 0x5a, 0x05, 0x00, 0x00, 0x40, 0x81]);
        }
        let starts = u8::from(self.begun && shot.angle < self.last);
        (self.last, self.begun) = (shot.angle, true);
        let [a0, a1] = (q6(shot.angle) << 1 | 1).to_le_bytes();
        let [d0, d1] = (quarters(shot.mm).min(0xffff) as u16).to_le_bytes();
        line.extend([
            (shot.intensity & 0xfc) | (starts ^ 1) << 1 | starts,
            a0,
            a1,
            d0,
            d1,
        ]);
    }
}

/// Express and dense capsules.
#[derive(Debug)]
pub struct Capsules {
    express: bool,
    shots: Vec<Shot>,
    begun: bool,
}

/// The offset (turns) by which express points lie before their angle: 4°.
const OFFSET: f64 = 4.0 / 360.0;

impl Capsules {
    /// 32 points each with an offset.
    #[must_use]
    pub fn express() -> Self {
        Self {
            express: true,
            shots: Vec::new(),
            begun: false,
        }
    }

    /// 40 points.
    #[must_use]
    pub fn dense() -> Self {
        Self {
            express: false,
            ..Self::express()
        }
    }
}

/// Puts sync and check code before a capsule's body.
pub(super) fn capsule(body: &[u8], line: &mut Vec<u8>) {
    let code = xor(body);
    line.extend([0xa0 | code & 15, 0x50 | code >> 4]);
    line.extend(body);
}

/// The word that says where a capsule starts.
pub(super) fn start(angle: f64, begun: bool) -> [u8; 2] {
    (q6(angle) | if begun { 0 } else { 0x8000 }).to_le_bytes()
}

impl Wire for Capsules {
    fn shift(&self, _: f64) -> f64 {
        if self.express { -OFFSET } else { 0.0 }
    }

    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        self.shots.push(shot);
        if self.shots.len() < if self.express { 32 } else { 40 } {
            return;
        }
        if !self.begun {
            let kind = if self.express { 0x82 } else { 0x85 };
            line.extend([0xa5, 0x5a, 0x54, 0x00, 0x00, 0x40, kind]);
        }
        let mut body = start(self.shots[0].angle, self.begun).to_vec();
        self.begun = true;
        if self.express {
            // 4° are 32 eighths: bits 5:4 of the offset are 2, bits 3:0 are 0.
            for pair in self.shots.chunks(2) {
                for shot in pair {
                    let word = (quarters(shot.mm.round()).min(0xfffc) as u16 & 0xfffc) | 2;
                    body.extend(word.to_le_bytes());
                }
                body.push(0);
            }
        } else {
            for shot in &self.shots {
                body.extend((shot.mm.round() as u16).to_le_bytes());
            }
        }
        self.shots.clear();
        capsule(&body, line);
    }
}

/// 96 points with a CRC-32.
#[derive(Debug, Default)]
pub struct Hq {
    points: Vec<u8>,
    time_us: u64,
    last: f64,
}

impl Hq {
    /// Nothing measured.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

/// CRC-32 of IEEE 802.3, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ if crc & 1 != 0 { 0xedb8_8320 } else { 0 }
        })
    })
}

impl Wire for Hq {
    fn add(&mut self, shot: Shot, line: &mut Vec<u8>) {
        if self.points.is_empty() {
            self.time_us = shot.time_us as u64;
        }
        let starts = u8::from(shot.angle < self.last);
        self.last = shot.angle;
        let angle = (shot.angle * 65_536.0).round() as u32 as u16;
        self.points.extend(angle.to_le_bytes());
        self.points.extend(quarters(shot.mm).to_le_bytes());
        self.points
            .extend([shot.intensity, starts | (starts ^ 1) << 1]);
        if self.points.len() < 8 * 96 {
            return;
        }
        let mut frame = vec![0xa5];
        frame.extend(self.time_us.to_le_bytes());
        frame.append(&mut self.points);
        let code = crc32(&[&frame[..], &[0; 3]].concat());
        line.extend(frame);
        line.extend(code.to_le_bytes());
    }
}
