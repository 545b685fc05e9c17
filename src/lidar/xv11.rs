//! Neato XV-11 and Xiaomi LDS02RR: 22-byte packets of 4 points, 90 a turn.
//!
//! Source: xv11hacking wiki; checked against recordings. The host drives the motor; the data mean something between
//! 180 and 349 rpm.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xFA` | sync |
//! | 1 | `0xA0` + index 0…89 | 4° |
//! | 2 | speed | rpm/64, `u16` LE |
//! | 4 + 4k | distance in bits 13:0; bit 15 none, then bits 7:0 say why; bit 14 weak | mm, `u16` LE |
//! | 6 + 4k | strength of the return | `u16` LE |
//! | 20 | check code | `u16` LE |

pub mod early;

use super::packet::{Turns, divided, from_cdeg};
use super::timing::Pace;
use super::{Model, Reading, Verdict, View};
use crate::scan::NoReturn;

/// Bytes of a packet.
pub const FRAME: usize = 22;

/// Push parser. About 130 bytes.
pub type Parser = super::Parser<Format, FRAME>;

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let format = Format {
            base: View::of(model, 4),
            turns: Turns::new(),
        };
        Self::with_format(format, model.baud)
    }
}

/// State of the parser.
#[derive(Debug, Clone)]
pub struct Format {
    base: View,
    turns: Turns,
}

impl super::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Packet> {
        let frame: &[u8; FRAME] = frame.try_into().ok()?;
        let &[_, index, v0, v1, ref points @ .., _, _] = frame;
        let index = index.saturating_sub(0xa0);
        let speed_rpm_q6 = u16::from_le_bytes([v0, v1]);
        let first = from_cdeg(400 * u32::from(index));
        // A degree at so many rpm/64 takes 64e6 / 6 µs divided by them.
        let period_q8 = match u32::from(speed_rpm_q6) {
            speed @ 6400..40_000 => divided(2_730_666_667, speed),
            _ => self.base.period_q8,
        };
        Some(Packet {
            index,
            speed_rpm_q6,
            view: View {
                first_us: pace.first_us(4, period_q8, FRAME as u16),
                period_q8,
                turn_start: self.turns.find(first, from_cdeg(100), 4),
                ..self.base
            },
            first,
            points: *points,
        })
    }
}

/// XV-11 packets among other bytes.
pub(super) fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xfa] => Verdict::Need(2),
        [0xfa, 0xa0..=0xf9, ..] => match bytes.get(..FRAME).and_then(<[u8]>::split_last_chunk::<2>)
        {
            None => Verdict::Need(FRAME),
            Some((body, code)) if check_code(body) == u16::from_le_bytes(*code) => {
                Verdict::Frame(FRAME)
            }
            Some(_) => Verdict::CheckFailed,
        },
        _ => Verdict::No,
    }
}

/// Fold of 16-bit words: each is added to twice the sum, and what runs over 15 bits is added again.
pub(super) fn check_code(body: &[u8]) -> u16 {
    let sum = body.chunks_exact(2).fold(0u32, |sum, word| match *word {
        [low, high] => (sum << 1).wrapping_add(u16::from_le_bytes([low, high]).into()),
        _ => sum,
    });
    ((sum & 0x7fff).wrapping_add(sum >> 15) & 0x7fff) as u16
}

/// Distance word and strength of a point of this family.
pub(super) fn range(word: u16) -> Result<u32, NoReturn> {
    if word & 0x8000 != 0 {
        Err(NoReturn::Sensor(word as u8))
    } else {
        Reading::range_q2(u32::from(word & 0x3fff) << 2)
    }
}

/// Four points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Which quarter dozen of degrees, 0…89.
    pub index: u8,
    /// Speed of the motor (rpm/64).
    pub speed_rpm_q6: u16,
    view: View,
    first: u32,
    points: [u8; 16],
}

impl super::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_rpm_q6) / 64.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        readings(self.first, &self.points)
    }
}

/// Points of four bytes, a degree apart.
fn readings(first: u32, points: &[u8]) -> impl Iterator<Item = Reading> + '_ {
    let mut angle = first;
    points.chunks_exact(4).map(move |point| {
        let (word, quality) = match *point {
            [w0, w1, q0, q1] => (u16::from_le_bytes([w0, w1]), u16::from_le_bytes([q0, q1])),
            _ => (0, 0),
        };
        let reading = Reading {
            angle,
            range: range(word),
            quality,
        };
        angle = angle.wrapping_add(from_cdeg(100));
        reading
    })
}
