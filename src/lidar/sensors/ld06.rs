//! LDROBOT LD06 and its relatives: 47-byte frames of 12 beams at 230 400 baud.
//!
//! Source: LD06 development manual. The LD19, STL-06P, STL-19P, STL-26, STL-27L, LD14, LD14P and LDS-02 (LD08) speak
//! the same. The sensor sends as soon as it spins.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x54 0x2C` | sync; type and number of points |
//! | 2 | speed | deg/s, `u16` LE |
//! | 4 | angle of the first point | 0.01° clockwise, `u16` LE |
//! | 6 + 3k | range, intensity | mm, `u16` LE; `u8` |
//! | 42 | angle of the last point | 0.01° clockwise, `u16` LE |
//! | 44 | time stamp | ms, `u16` LE, wraps at 30 000 |
//! | 46 | CRC-8 of all before | polynomial 0x4D |

mod models;
mod parallax;

use crc::{Algorithm, Crc};

use crate::lidar::model::{Family, Model, Parallax};
use crate::lidar::wire::angle::{Revolutions, from_cdeg};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::{Pace, Stamps};
use parallax::{ld14_shift, lds02_parallax};

/// Bytes of a frame.
pub const FRAME: usize = 47;
/// Points of a frame.
pub const POINTS: usize = 12;

/// Starts the LD14P's motor and stream.
pub const START: [u8; 8] = [0x54, 0xa0, 0x04, 0, 0, 0, 0, 0x5e];
/// Stops them.
pub const STOP: [u8; 8] = [0x54, 0xa1, 0x04, 0, 0, 0, 0, 0x4a];

/// Sets the LD14P's speed (deg/s; 720 to 2880).
#[must_use]
pub fn set_speed(deg_per_s: u16) -> [u8; 8] {
    let [low, high] = deg_per_s.to_le_bytes();
    let body = [0x54, 0xa2, 0x04, low, high, 0, 0];
    let [a, b, c, d, e, f, g] = body;
    [a, b, c, d, e, f, g, check_code(&body)]
}

const STAMP_WRAP_MS: u16 = 30_000;
const CRC: Crc<u8> = Crc::<u8>::new(&Algorithm {
    width: 8,
    poly: 0x4d,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0x7f,
    residue: 0,
});

/// Check code of a frame's or a command's bytes.
#[must_use]
pub fn check_code(bytes: &[u8]) -> u8 {
    CRC.checksum(bytes)
}

/// Push parser of the 47-byte frame. 172 bytes, a packet 92.
pub type Parser = parser::Parser<Format, { FRAME + 1 }>;

impl Parser {
    /// LD06, LD19.
    #[must_use]
    pub const fn new() -> Self {
        Self::for_model(&Model::LDROBOT_LD06)
    }

    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        Self::with_format(Format::new(model), model.baud)
    }
}

impl Default for Parser {
    fn default() -> Self {
        Self::new()
    }
}

/// State of the family's parser.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Format {
    parallax: Parallax,
    base: View,
    stamps: Stamps,
    revolutions: Revolutions,
    /// Shift of the last point that had one.
    shift: u32,
}

impl Format {
    const fn new(model: &Model) -> Self {
        Self {
            parallax: match model.family {
                Family::Ldrobot(parallax) => parallax,
                _ => Parallax::None,
            },
            base: View::of(model, 0),
            stamps: Stamps::new(STAMP_WRAP_MS, POINTS as u8, model.period_q8()),
            revolutions: Revolutions::new(),
            shift: 0,
        }
    }
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        let verdict = judge(bytes);
        match (verdict, bytes.first_chunk::<FRAME>()) {
            // A lost or an added byte shifts the stamp: of the few such frames that pass the CRC, one of some 600 keeps
            // one that is due.
            (Verdict::Frame(length), Some(&[.., t0, t1, _]))
                if !self.stamps.is_due(u16::from_le_bytes([t0, t1])) =>
            {
                Verdict::Doubtful(length)
            }
            _ => verdict,
        }
    }

    fn packet(&mut self, frame: &[u8], _: bool, _: &mut Pace) -> Option<Packet> {
        let frame: &[u8; FRAME] = frame.try_into().ok()?;
        let &[_, _, v0, v1, a0, a1, ref body @ .., b0, b1, t0, t1, _] = frame;
        let start_cdeg = u16::from_le_bytes([a0, a1]);
        let end_cdeg = u16::from_le_bytes([b0, b1]);
        let stamp_ms = u16::from_le_bytes([t0, t1]);
        let start = from_cdeg(start_cdeg.into());
        // 2³² / 36 000 / 11 = 10 845.877: spares a Cortex-M0 a division.
        let span = span_cdeg(start_cdeg, end_cdeg);
        let step = span * 10_845 + ((span * 225) >> 8);
        let first_us = self.stamps.first_us(stamp_ms);
        let mut points = [0; POINTS];
        for (word, point) in points.iter_mut().zip(body.chunks_exact(3)) {
            if let [low, high, intensity] = *point {
                *word = u32::from_le_bytes([low, high, intensity, 0]);
            }
        }
        let shift = self.shift;
        if self.parallax == Parallax::Ld14 {
            let ranges = points.iter().map(|word| *word as u16);
            self.shift = ranges.fold(shift, ld14_shift);
        }
        Some(Packet {
            speed_deg_per_s: u16::from_le_bytes([v0, v1]),
            start_cdeg,
            end_cdeg,
            stamp_ms,
            view: View {
                first_us,
                period_q8: self.stamps.period_q8(),
                revolution_start: self.revolutions.find(start, step, POINTS as u16),
                ..self.base
            },
            start,
            step,
            parallax: self.parallax,
            shift,
            points,
        })
    }
}

/// LDROBOT frames among other bytes.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0x54] => Verdict::Need(2),
        // The code over a frame and its own code is 0.
        [0x54, 0x2c, ..] => Verdict::on(bytes, FRAME, |frame| {
            check_code(frame) == 0 && is_plausible(frame)
        }),
        _ => Verdict::No,
    }
}

/// Whether the fields can be a sensor's: angles within a turn, the last at most 30° from the first, a stamp in range.
///
/// One of 256 damaged frames passes the CRC; this leaves one of some 10 000, and the time since the frame before
/// nearly none. The slowest relative, 2300 points a second,
/// would have to spin 16 times a second for 30°; the makers' tighter rule, by the reported speed, refuses the
/// manual's own example.
fn is_plausible(frame: &[u8]) -> bool {
    let &[_, _, _, _, a0, a1, .., b0, b1, t0, t1, _] = frame else {
        return false;
    };
    let start = u16::from_le_bytes([a0, a1]);
    let end = u16::from_le_bytes([b0, b1]);
    let stamp = u16::from_le_bytes([t0, t1]);
    start <= 36_000 && end <= 36_000 && span_cdeg(start, end) <= 3000 && stamp <= STAMP_WRAP_MS
}

/// Angle from the first to the last point, 0…36 000 (0.01°).
fn span_cdeg(start: u16, end: u16) -> u32 {
    let wrap = if end < start { 36_000 } else { 0 };
    (u32::from(end) + wrap).saturating_sub(u32::from(start))
}

/// Twelve points of an LDROBOT sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed of the motor (deg/s).
    pub speed_deg_per_s: u16,
    /// Angle of the first point, clockwise from the front mark (0.01°).
    pub start_cdeg: u16,
    /// Angle of the last point (0.01°).
    pub end_cdeg: u16,
    /// The sensor's clock at the first point, 0…30 000 (ms).
    pub stamp_ms: u16,
    view: View,
    start: u32,
    step: u32,
    parallax: Parallax,
    shift: u32,
    /// Range (mm) and, above it, intensity: words are moved faster than bytes.
    points: [u32; POINTS],
}

impl Packet {
    /// Range (mm) and intensity as sent.
    fn points(&self) -> impl ExactSizeIterator<Item = (u16, u8)> + '_ {
        self.points
            .iter()
            .map(|word| (*word as u16, (word >> 16) as u8))
    }
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_deg_per_s) / 6.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        let mut angle = self.start;
        let mut shift = self.shift;
        self.points().map(move |(mm, intensity)| {
            let (turned, quarters) = match self.parallax {
                Parallax::None => (0, u32::from(mm) << 2),
                Parallax::Ld14 => {
                    shift = ld14_shift(shift, mm);
                    (shift, u32::from(mm) << 2)
                }
                Parallax::Lds02 => lds02_parallax(mm),
            };
            let reading = Reading {
                angle: angle.wrapping_sub(turned),
                range: Reading::range_q2(quarters),
                quality: u16::from(intensity),
            };
            angle = angle.wrapping_add(self.step);
            reading
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::wire::packet::Packet as _;
    use crate::lidar::wire::protocol::Protocol;
    use crate::scan::Bearing;

    /// The example frame of the LD06 manual.
    const MANUAL: [u8; FRAME] = [
        0x54, 0x2c, 0x68, 0x08, 0xab, 0x7e, 0xe0, 0x00, 0xe4, 0xdc, 0x00, 0xe2, 0xd9, 0x00, 0xe5,
        0xd5, 0x00, 0xe3, 0xd3, 0x00, 0xe4, 0xd0, 0x00, 0xe9, 0xcd, 0x00, 0xe4, 0xca, 0x00, 0xe2,
        0xc7, 0x00, 0xe9, 0xc5, 0x00, 0xe5, 0xc2, 0x00, 0xe5, 0xc0, 0x00, 0xe5, 0xbe, 0x82, 0x3a,
        0x1a, 0x50,
    ];

    fn parse(parser: &mut Parser, bytes: &[u8]) -> Option<Packet> {
        bytes.iter().filter_map(|&byte| parser.push(byte)).last()
    }

    #[test]
    fn the_manuals_frame() {
        let packet = parse(&mut Parser::new(), &MANUAL).expect("packet");
        assert_eq!(packet.speed_deg_per_s, 2152);
        assert_eq!((packet.start_cdeg, packet.end_cdeg), (32_427, 33_470));
        assert_eq!(packet.stamp_ms, 6714);
        let first = packet.beams().next().expect("beam");
        let last = packet.beams().last().expect("beam");
        assert_eq!(first.bearing, Bearing::from_clockwise_cdeg(32_427));
        assert_eq!(last.bearing, Bearing::from_clockwise_cdeg(33_470));
        assert_eq!((first.range.mm(), first.quality), (Ok(224), 0xe4));
        assert_eq!(last.time_us - first.time_us, 11 * 1_000_000 / 4500);
        assert_eq!(packet.revolution_start(), None);
    }

    #[test]
    fn commands_as_documented() {
        assert_eq!(set_speed(2160), [0x54, 0xa2, 4, 0x70, 8, 0, 0, 0xa1]);
        for command in [START, STOP] {
            assert_eq!(check_code(&command), 0);
        }
    }

    #[test]
    fn a_damaged_frame_does_not_cost_the_next() {
        let mut parser = Parser::new();
        assert!(parse(&mut parser, &MANUAL[..30]).is_none());
        assert!(parse(&mut parser, &MANUAL).is_some());
        let counters = parser.counters();
        assert_eq!((counters.packets, counters.check_errors), (1, 1));
        assert_eq!((counters.skipped_bytes, parser.pending_bytes()), (30, 0));
    }
}
