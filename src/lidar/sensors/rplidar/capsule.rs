//! RPLIDAR capsules with 84 bytes: legacy express (32 points with an angle offset each) and dense (40 points).
//!
//! Source: as [`super`]; integer arithmetic as in the maker's SDK, of which every angle is a whole 1/64°.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xA_`, low nibble of the check code | XOR of all bytes from offset 2 |
//! | 1 | `0x5_`, its high nibble | |
//! | 2 | angle of the first point; bit 15: the stream begins anew | 1/64°, `u16` LE |
//! | 4 + 5k, express | two points: distance and two bits of offset, twice; two nibbles of offset | mm/4; 1/8° |
//! | 4 + 2k, dense | distance | mm |
//!
//! The points of one capsule end where the next begins, so each is given when the next arrives. When one is lost, so
//! is the one before: spread over a gap its angles would be wrong.

use crate::lidar::model::{Family, Model};
use crate::lidar::wire::angle::{divided, from_deg_q6};
use crate::lidar::wire::answer;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::Pace;

/// Bytes of a capsule.
pub const CAPSULE: usize = 84;

/// 360° in 1/64°.
pub(super) const TURN_Q6: u32 = 360 << 6;
/// Quality of points that have none of their own: the maker's SDK gives this to all with a range.
pub(super) const QUALITY: u16 = 47;

/// How the 80 bytes of points are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Packing {
    Express,
    Dense,
}

/// Push parser of express or dense capsules. About 280 bytes.
pub type Parser = parser::Parser<Format, CAPSULE>;

impl Parser {
    /// Dense capsules where the model's family says so, express capsules otherwise.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let packing = match model.family {
            Family::RplidarDense => Packing::Dense,
            _ => Packing::Express,
        };
        Self::with_format(Format::new(model, packing), model.baud)
    }
}

/// State of the capsules' parser: the capsule that waits for the next, and its time (µs).
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Format {
    base: View,
    packing: Packing,
    waiting: Option<(u32, [u8; CAPSULE])>,
}

impl Format {
    const fn new(model: &Model, packing: Packing) -> Self {
        Self {
            base: View::of(model, 0),
            packing,
            waiting: None,
        }
    }
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(&mut self, frame: &[u8], follows: bool, pace: &mut Pace) -> Option<Packet> {
        let frame: [u8; CAPSULE] = frame.try_into().ok()?;
        let (start_q6, begins_anew) = start(&frame);
        let points = match self.packing {
            Packing::Express => 32,
            Packing::Dense => 40,
        };
        let time_us = pace.first_us(points, self.base.period_q8, CAPSULE as u16);
        let waiting = self.waiting.replace((time_us, frame));
        let (first_us, bytes) = waiting.filter(|_| follows && !begins_anew)?;
        let sweep = Sweep::between(start(&bytes).0, start_q6, points)?;
        // Dense sensors turn at most 100 times a second by the SDK; more is a gap that nobody saw.
        if self.packing == Packing::Dense && sweep.is_faster_than_100_hz(self.base.period_q8) {
            return None;
        }
        Some(Packet {
            view: View {
                first_us,
                revolution_start: sweep.revolution_start(points),
                ..self.base
            },
            packing: self.packing,
            sweep,
            bytes,
        })
    }
}

/// Capsules with 84 bytes among other bytes.
fn judge(bytes: &[u8]) -> Verdict {
    judge_capsule(bytes, CAPSULE)
}

/// Capsules of any length.
pub(super) fn judge_capsule(bytes: &[u8], length: usize) -> Verdict {
    match *bytes {
        [0xa5, 0x5a, ..] if !matches!(answer::judge(bytes), Verdict::No) => answer::judge(bytes),
        [0xa0..=0xaf] => Verdict::Need(2),
        [low @ 0xa0..=0xaf, high @ 0x50..=0x5f, ..] => Verdict::on(bytes, length, |frame| {
            let body = frame.get(2..).unwrap_or(&[]);
            body.iter().fold(0, |code, byte| code ^ byte) == (low & 15) | (high << 4)
        }),
        _ => Verdict::No,
    }
}

/// Angle of a capsule's first point (1/64°), and whether the stream begins anew with it.
fn start(capsule: &[u8; CAPSULE]) -> (u16, bool) {
    let &[_, _, a0, a1, ..] = capsule;
    let word = u16::from_le_bytes([a0, a1]);
    (word & 0x7fff, word & 0x8000 != 0)
}

/// Angles from one capsule's start to the next one's, in the SDK's 1/65536°.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Sweep {
    first_q16: u32,
    step_q16: u32,
    span_q8: u32,
}

impl Sweep {
    /// From `start_q6` to `next_q6` (1/64°) in so many points; `None` for angles beyond a turn.
    pub(super) fn between(start_q6: u16, next_q6: u16, points: u16) -> Option<Self> {
        let (start, next) = (u32::from(start_q6), u32::from(next_q6));
        if start >= TURN_Q6 || next >= TURN_Q6 {
            return None;
        }
        let wrap = if start > next { TURN_Q6 } else { 0 };
        let span_q8 = (next + wrap - start) << 2;
        Some(Self {
            first_q16: start << 10,
            step_q16: divided(span_q8 << 8, points.into()),
            span_q8,
        })
    }

    /// Whether the sensor would turn more than 100 times a second, at this period (µs/256).
    pub(super) fn is_faster_than_100_hz(&self, period_q8: u32) -> bool {
        // 36 000°/s · 40 points · period.
        let limit = (u64::from(period_q8) * 40 * 36_000) / 1_000_000;
        u64::from(self.span_q8) > limit
    }

    /// Number of the point at which the angle passes a full turn, by the SDK's rule.
    pub(super) fn revolution_start(&self, points: u16) -> Option<u16> {
        const TURN_Q16: u32 = 360 << 16;
        let mut angle = self.first_q16;
        (0..points).find(|_| {
            angle += self.step_q16;
            let passed = angle >= TURN_Q16;
            angle %= TURN_Q16;
            passed && angle < self.step_q16
        })
    }

    /// Angle of each point less its `offset_q16` (1/65536°), to whole 1/64° as in the SDK; 2³² is a turn.
    pub(super) fn angle(&self, point: u32, offset_q16: i32) -> u32 {
        let raw = self.first_q16 + point * self.step_q16;
        let q6 = (raw as i32 - offset_q16) >> 10;
        from_deg_q6(q6.rem_euclid(TURN_Q6 as i32) as u32)
    }
}

/// The points of one capsule.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    view: View,
    packing: Packing,
    sweep: Sweep,
    bytes: [u8; CAPSULE],
}

impl Packet {
    /// Distance (mm/4) and offset (1/8°) of a point.
    fn point(&self, k: usize) -> Option<(u32, i32)> {
        match self.packing {
            Packing::Express => {
                let cabin = self.bytes.get(4 + (k >> 1) * 5..)?.first_chunk::<5>()?;
                let &[a0, a1, b0, b1, offsets] = cabin;
                let (word, offset) = if k & 1 == 0 {
                    (u16::from_le_bytes([a0, a1]), offsets & 15)
                } else {
                    (u16::from_le_bytes([b0, b1]), offsets >> 4)
                };
                let offset = i32::from(offset) | i32::from(word & 3) << 4;
                Some((u32::from(word & 0xfffc), offset))
            }
            Packing::Dense => {
                let word = self.bytes.get(4 + 2 * k..)?.first_chunk::<2>()?;
                Some((u32::from(u16::from_le_bytes(*word)) << 2, 0))
            }
        }
    }
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        let points = match self.packing {
            Packing::Express => 32,
            Packing::Dense => 40,
        };
        (0..points).map(move |k| {
            let (quarters, offset_q3) = self.point(k).unwrap_or((0, 0));
            Reading {
                angle: self.sweep.angle(k as u32, offset_q3 << 13),
                range: Reading::range_q2(quarters),
                quality: if quarters == 0 { 0 } else { QUALITY },
            }
        })
    }
}
