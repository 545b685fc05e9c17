//! RPLIDAR ultra capsules (132 bytes, 96 points, "boost") and ultra-dense capsules (170 bytes, 64 points).
//!
//! Source: as [`super`]; integer arithmetic as in the maker's SDK.
//!
//! | offset | ultra | ultra-dense |
//! | --- | --- | --- |
//! | 0 | check code and sync as in [`super::capsule`] | the same |
//! | 2 | angle of the first point, `u16` LE | device time, `u32` LE |
//! | 4 + 4k | a distance in 12 bits and two differences in 10 | |
//! | 6 | | status, `u16` LE |
//! | 8 | | angle of the first point, `u16` LE |
//! | 10 + 5k | | two words of 20 bits: scale, distance and quality |

use super::capsule::{QUALITY, Sweep, judge_capsule};
use crate::lidar::model::Model;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::Pace;

/// Bytes of an ultra capsule.
pub const ULTRA: usize = 132;
/// Bytes of an ultra-dense capsule.
pub const ULTRA_DENSE: usize = 170;

const ULTRA_POINTS: u16 = 96;
const DENSE_POINTS: u16 = 64;

/// Push parser of ultra capsules. About 400 bytes.
pub type UltraParser = parser::Parser<Format<ULTRA>, ULTRA>;
/// Push parser of ultra-dense capsules. About 500 bytes.
pub type UltraDenseParser = parser::Parser<Format<ULTRA_DENSE>, ULTRA_DENSE>;

impl UltraParser {
    /// Ultra capsules.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        Self::with_format(Format::new(model), model.baud)
    }
}

impl UltraDenseParser {
    /// Ultra-dense capsules.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        Self::with_format(Format::new(model), model.baud)
    }
}

/// State of the parser: the capsule that waits for the next, and its time (µs).
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Format<const L: usize> {
    base: View,
    /// Last distance of the capsule before (mm/4): ultra-dense capsules smooth over their border.
    last_q2: u32,
    waiting: Option<(u32, [u8; L])>,
}

impl<const L: usize> Format<L> {
    const fn new(model: &Model) -> Self {
        Self {
            base: View::of(model, 0),
            last_q2: 0,
            waiting: None,
        }
    }
}

impl parser::Format for Format<ULTRA> {
    type Packet = UltraPacket;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge_ultra(bytes)
    }

    fn packet(&mut self, frame: &[u8], follows: bool, pace: &mut Pace) -> Option<UltraPacket> {
        let frame: [u8; ULTRA] = frame.try_into().ok()?;
        let word = |frame: &[u8; ULTRA]| {
            let &[_, _, a0, a1, ..] = frame;
            u16::from_le_bytes([a0, a1])
        };
        let next = word(&frame);
        let time_us = pace.first_us(ULTRA_POINTS, self.base.period_q8, ULTRA as u16);
        let waiting = self.waiting.replace((time_us, frame));
        let (first_us, bytes) = waiting.filter(|_| follows && next & 0x8000 == 0)?;
        let sweep = Sweep::between(word(&bytes) & 0x7fff, next & 0x7fff, ULTRA_POINTS)?;
        Some(UltraPacket {
            view: View {
                first_us,
                revolution_start: sweep.revolution_start(ULTRA_POINTS),
                ..self.base
            },
            sweep,
            next_major: major(cabin(&frame, 0)),
            bytes,
        })
    }
}

impl parser::Format for Format<ULTRA_DENSE> {
    type Packet = UltraDensePacket;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge_ultra_dense(bytes)
    }

    fn packet(&mut self, frame: &[u8], follows: bool, pace: &mut Pace) -> Option<UltraDensePacket> {
        let frame: [u8; ULTRA_DENSE] = frame.try_into().ok()?;
        let word = |frame: &[u8; ULTRA_DENSE]| {
            let &[_, _, _, _, _, _, _, _, a0, a1, ..] = frame;
            u16::from_le_bytes([a0, a1])
        };
        let next = word(&frame);
        let time_us = pace.first_us(DENSE_POINTS, self.base.period_q8, ULTRA_DENSE as u16);
        let waiting = self.waiting.replace((time_us, frame));
        let (first_us, bytes) = waiting.filter(|_| follows && next & 0x8000 == 0)?;
        let sweep = Sweep::between(word(&bytes) & 0x7fff, next & 0x7fff, DENSE_POINTS)?;
        let &[_, _, t0, t1, t2, t3, s0, s1, ..] = &bytes;
        let packet = UltraDensePacket {
            device_time: u32::from_le_bytes([t0, t1, t2, t3]),
            status: u16::from_le_bytes([s0, s1]),
            view: View {
                first_us,
                revolution_start: sweep.revolution_start(DENSE_POINTS),
                ..self.base
            },
            sweep,
            last_q2: self.last_q2,
            bytes,
        };
        self.last_q2 = packet.words().last().map_or(0, |(quarters, _)| quarters);
        Some(packet)
    }
}

/// Ultra capsules among other bytes.
fn judge_ultra(bytes: &[u8]) -> Verdict {
    judge_capsule(bytes, ULTRA)
}

/// Ultra-dense capsules among other bytes.
fn judge_ultra_dense(bytes: &[u8]) -> Verdict {
    judge_capsule(bytes, ULTRA_DENSE)
}

/// The points of one ultra capsule.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UltraPacket {
    view: View,
    sweep: Sweep,
    /// First distance of the next capsule, which the last differences refer to.
    next_major: Major,
    bytes: [u8; ULTRA],
}

/// A distance (mm) and the scale of the differences to it (bits).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Major {
    mm: u32,
    scale: u8,
}

fn cabin(bytes: &[u8; ULTRA], k: usize) -> u32 {
    let cabin = bytes.get(4 + 4 * k..).and_then(<[u8]>::first_chunk::<4>);
    cabin.map_or(0, |cabin| u32::from_le_bytes(*cabin))
}

/// Decodes 12 bits whose resolution falls with the distance.
fn major(cabin: u32) -> Major {
    let (mm, scale) = match cabin & 0xfff {
        v @ 3328.. => (16_384 + ((v - 3328) << 4), 4),
        v @ 1792.. => (4096 + ((v - 1792) << 3), 3),
        v @ 1280.. => (2048 + ((v - 1280) << 2), 2),
        v @ 512.. => (512 + ((v - 512) << 1), 1),
        v => (v, 0),
    };
    Major { mm, scale }
}

/// Distance (mm/4) that lies `difference` from `base`; 0 for the two values that mean none.
fn predicted(base: Major, difference: i32) -> u32 {
    if difference == -512 || difference == 511 {
        return 0;
    }
    let mm = base.mm as i32 + (difference << base.scale);
    if mm > 0 { (mm as u32) << 2 } else { 0 }
}

/// How far the beam at this distance (mm/4) was seen from where it left (1/65536°): the SDK's polynomial.
fn offset_q16(quarters: u32) -> i32 {
    /// 7.5° and 8° in radians, Q16.
    const MEAN: i64 = 8578;
    const FAR: i64 = 9150;
    /// Degrees in a radian, Q32, with the SDK's nine digits of π.
    const DEGREES: i64 = 246_083_499_489;
    let radians_q16 = if quarters >= 200 {
        let k = i64::from(98_361 / quarters);
        FAR - (k << 6) - k * k * k / 98_304
    } else {
        MEAN
    };
    ((radians_q16 * DEGREES) / (1 << 32)) as i32
}

impl packet::Packet for UltraPacket {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        (0..32).flat_map(move |k| {
            let cabin_k = cabin(&self.bytes, k);
            let this = major(cabin_k);
            let next = if k == 31 {
                self.next_major
            } else {
                major(cabin(&self.bytes, k + 1))
            };
            // A missing distance leaves its first difference to the next one.
            let base = if this.mm == 0 && next.mm != 0 {
                next
            } else {
                this
            };
            let differences = [(cabin_k << 10) as i32 >> 22, cabin_k as i32 >> 22];
            let [first, second] = differences;
            let quarters = [
                this.mm << 2,
                predicted(base, first),
                predicted(next, second),
            ];
            let mut point = 3 * k as u32;
            quarters.map(|quarters| {
                let reading = Reading {
                    angle: self.sweep.angle(point, offset_q16(quarters)),
                    range: Reading::range_q2(quarters),
                    quality: if quarters == 0 { 0 } else { QUALITY },
                };
                point += 1;
                reading
            })
        })
    }
}

/// The points of one ultra-dense capsule.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UltraDensePacket {
    /// The sensor's clock, in its own unit.
    pub device_time: u32,
    /// The sensor's status word.
    pub status: u16,
    view: View,
    sweep: Sweep,
    last_q2: u32,
    bytes: [u8; ULTRA_DENSE],
}

impl UltraDensePacket {
    fn word(&self, k: usize) -> u32 {
        let cabin = self.bytes.get(10 + (k >> 1) * 5..);
        let Some(&[a0, a1, b0, b1, high]) = cabin.and_then(<[u8]>::first_chunk::<5>) else {
            return 0;
        };
        if k & 1 == 0 {
            u32::from_le_bytes([a0, a1, high & 15, 0])
        } else {
            u32::from_le_bytes([b0, b1, high >> 4, 0])
        }
    }

    /// Distance (mm/4) and quality of each point.
    fn words(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let mut previous = self.last_q2;
        (0..usize::from(DENSE_POINTS)).map(move |k| {
            let word = self.word(k);
            let (quality, quarters) = match word & 3 {
                0 => {
                    let quarters = (word & 0xffc) * 2;
                    let near = quarters.abs_diff(previous) <= 8;
                    let smooth = if near {
                        (quarters + previous) >> 1
                    } else {
                        quarters
                    };
                    (word >> 12, smooth)
                }
                1 => ((word >> 13) << 1, (word & 0x1ffc) * 3 + (2046 << 2)),
                2 => ((word >> 14) << 2, (word & 0x3ffc) * 4 + (8187 << 2)),
                _ => ((word >> 15) << 3, (word & 0x7ffc) * 5 + (24_567 << 2)),
            };
            previous = quarters;
            (quarters, quality)
        })
    }
}

impl packet::Packet for UltraDensePacket {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.words()
            .zip(0..)
            .map(|((quarters, quality), k)| Reading {
                angle: self.sweep.angle(k, 0),
                range: Reading::range_q2(quarters),
                quality: quality as u16,
            })
    }
}
