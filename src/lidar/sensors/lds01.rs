//! LDS-01 (HLS-LFCD2): 42-byte frames of 6 points, 60 a revolution.
//!
//! Source: two independent open drivers that agree. The command `b` starts motor and stream, `e` stops both.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xFA` | sync |
//! | 1 | `0xA0` + index 0…59 | 6° |
//! | 2 | speed | 0.1 rpm, `u16` LE |
//! | 4 + 6k | intensity; distance, 0 for none; reserved | `u16` LE; mm, `u16` LE; `u16` |
//! | 40 | inverted sum of all before, twice | `u8`; `u8` |

use crate::lidar::model::{Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::{divided, from_cdeg};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::scan::NoReturn;

impl Model {
    /// LDS-01 (HLS-LFCD2).
    pub const HLS_LDS01: Self = Self {
        name: "lds01",
        family: Family::Lds01,
        baud: 230_400,
        points_per_s: 1800,
        revolutions_per_10s: 50,
        beams_per_revolution: 360,
        zero_cdeg: 0,
        counter_clockwise: false,
        min_range_mm: 120,
        max_range_mm: 3500,
        motor: Motor::Commands,
        start: Start::Send(&[START]),
        proof: Proof::Document,
    };
}

/// Bytes of a frame.
pub const FRAME: usize = 42;
/// Starts motor and stream.
pub const START: u8 = b'b';
/// Stops motor and stream.
pub const STOP: u8 = b'e';

/// Push parser. About 150 bytes.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// LDS-01 frames.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Frames;

impl Layout for Frames {
    type Packet = Packet;
    const QUALITY_SHIFT: u8 = 4;

    fn judge(bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(frame: &[u8], context: Context<'_>) -> Option<Packet> {
        let &[_, index, v0, v1, ref points @ .., _, _] = frame else {
            return None;
        };
        let index = index.saturating_sub(0xa0);
        let speed_drpm = u16::from_le_bytes([v0, v1]);
        let fan = Fan::new(from_cdeg(600 * u32::from(index)), from_cdeg(100), 6, points)?;
        // A degree at so many 0.1 rpm takes 10e6 / 6 µs divided by them.
        let period_q8 = match u32::from(speed_drpm) {
            speed @ 1000..10_000 => divided(426_666_667, speed),
            _ => context.base.period_q8,
        };
        Some(Packet {
            index,
            speed_drpm,
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xfa] => Verdict::Need(2),
        [0xfa, 0xa0..=0xdb, ..] => Verdict::on(bytes, FRAME, |frame| {
            let parts = frame.split_last_chunk::<2>();
            parts.is_some_and(|(body, code)| *code == [check_code(body); 2])
        }),
        _ => Verdict::No,
    }
}

/// Inverted sum of the bytes.
fn check_code(body: &[u8]) -> u8 {
    !body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte))
}

/// Six points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Which six degrees, 0…59.
    pub index: u8,
    /// Speed of the motor (0.1 rpm).
    pub speed_drpm: u16,
    view: View,
    fan: Fan<36>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_drpm) / 10.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|point| match *point {
            [q0, q1, d0, d1, _, _] => {
                let mm = u16::from_le_bytes([d0, d1]);
                let range = Reading::range_q2(u32::from(mm) << 2);
                (range, u16::from_le_bytes([q0, q1]))
            }
            _ => (Err(NoReturn::Nothing), 0),
        })
    }
}
