//! Neato XV-11 and Xiaomi LDS02RR: 22-byte packets of 4 points, 90 a revolution.
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

use super::layout::{Context, Fan, Plain};
use super::packet::{divided, from_cdeg};
use super::{Layout, Reading, Verdict, View};
use crate::scan::NoReturn;

/// Bytes of a packet.
pub const FRAME: usize = 22;

/// Push parser. About 130 bytes.
pub type Parser = super::Parser<Plain<Frames>, FRAME>;

/// XV-11 packets.
#[derive(Debug, Clone)]
pub struct Frames;

impl Layout for Frames {
    type Packet = Packet;
    const QUALITY_SHIFT: u8 = 4;

    fn judge(bytes: &[u8]) -> Verdict {
        match *bytes {
            [0xfa] => Verdict::Need(2),
            [0xfa, 0xa0..=0xf9, ..] => Verdict::on(bytes, FRAME, ends_in_code),
            _ => Verdict::No,
        }
    }

    fn packet(frame: &[u8], context: Context<'_>) -> Option<Packet> {
        let &[_, index, v0, v1, ref points @ .., _, _] = frame else {
            return None;
        };
        let index = index.saturating_sub(0xa0);
        let speed_rpm_q6 = u16::from_le_bytes([v0, v1]);
        let fan = Fan::new(from_cdeg(400 * u32::from(index)), from_cdeg(100), 4, points)?;
        // A degree at so many rpm/64 takes 64e6 / 6 µs divided by them.
        let period_q8 = match u32::from(speed_rpm_q6) {
            speed @ 6400..40_000 => divided(2_730_666_667, speed),
            _ => context.base.period_q8,
        };
        Some(Packet {
            index,
            speed_rpm_q6,
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Whether a frame's last two bytes are the check code of all before.
pub(super) fn ends_in_code(frame: &[u8]) -> bool {
    let parts = frame.split_last_chunk::<2>();
    parts.is_some_and(|(body, code)| check_code(body) == u16::from_le_bytes(*code))
}

/// Fold of 16-bit words: each is added to twice the sum, and what runs over 15 bits is added again.
fn check_code(body: &[u8]) -> u16 {
    let sum = body.chunks_exact(2).fold(0u32, |sum, word| match *word {
        [low, high] => (sum << 1).wrapping_add(u16::from_le_bytes([low, high]).into()),
        _ => sum,
    });
    ((sum & 0x7fff).wrapping_add(sum >> 15) & 0x7fff) as u16
}

/// Range of a point by its distance word, in mm/4.
pub(super) fn range(word: [u8; 2]) -> Result<u32, NoReturn> {
    let word = u16::from_le_bytes(word);
    if word & 0x8000 != 0 {
        Err(NoReturn::Sensor(word as u8))
    } else {
        Reading::range_q2(u32::from(word & 0x3fff) << 2)
    }
}

/// Range and strength of a point of four bytes.
fn point(bytes: &[u8]) -> (Result<u32, NoReturn>, u16) {
    match *bytes {
        [w0, w1, q0, q1] => (range([w0, w1]), u16::from_le_bytes([q0, q1])),
        _ => (Err(NoReturn::Nothing), 0),
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
    fan: Fan<16>,
}

impl super::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_rpm_q6) / 64.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(point)
    }
}
