//! COIN-D4: frames of up to 80 samples of three bytes.
//!
//! Source: one open description; no recording was to be had.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xAA 0x55` | sync |
//! | 2 | bit 0: speed valid; bits 7:1 speed | 0.1 Hz |
//! | 3 | number of samples n | |
//! | 4 | angle of the first sample | 1/128° clockwise, `u16` LE |
//! | 6 | angle of the last sample | 1/128° clockwise, `u16` LE |
//! | 8 | XOR of the bytes at even offsets; at odd ones | without these two |
//! | 10 + 3k | intensity; 2 flags and 14 bits of distance, 0 for none | `u8`; mm, `u16` LE |

use crate::lidar::model::{Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::{divided, from_deg_q7};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::scan::NoReturn;

impl Model {
    /// COIN-D4.
    pub const COIN_D4: Self = Self {
        name: "coin-d4",
        family: Family::CoinD4,
        baud: 230_400,
        points_per_s: 4000,
        revolutions_per_10s: 60,
        beams_per_revolution: 750,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 50,
        farthest_mm: 8000,
        motor: Motor::Commands,
        start: Start::Send(&START),
        proof: Proof::RealBytes,
    };
}

/// Most samples of a frame.
pub const MOST_SAMPLES: usize = 80;
/// Bytes of the longest frame.
pub const FRAME: usize = 10 + 3 * MOST_SAMPLES;
/// Starts motor and stream.
pub const START: [u8; 4] = [0xaa, 0x55, 0xf0, 0x0f];
/// Stops motor and stream.
pub const STOP: [u8; 4] = [0xaa, 0x55, 0xf5, 0x0a];

/// Push parser. About 360 bytes.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// COIN-D4 frames.
#[derive(Debug, Clone)]
pub struct Frames;

impl Layout for Frames {
    type Packet = Packet;

    fn judge(bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(frame: &[u8], context: Context<'_>) -> Option<Packet> {
        let &[_, _, speed, count, a0, a1, b0, b1, _, _, ref points @ ..] = frame else {
            return None;
        };
        let first = from_deg_q7(u16::from_le_bytes([a0, a1]).into());
        let last = from_deg_q7(u16::from_le_bytes([b0, b1]).into());
        let step = divided(last.wrapping_sub(first), u32::from(count).saturating_sub(1));
        let fan = Fan::new(first, step, 3, points)?;
        let period_q8 = context.base.period_q8;
        Some(Packet {
            speed_dhz: (speed & 1 == 1).then_some(speed >> 1),
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xaa] => Verdict::Need(2),
        [0xaa, 0x55] | [0xaa, 0x55, _] => Verdict::Need(4),
        [0xaa, 0x55, _, count, ..] if (1..=MOST_SAMPLES as u8).contains(&count) => {
            let length = 10 + 3 * usize::from(count);
            Verdict::on(bytes, length, |frame| {
                let code = frame
                    .chunks(2)
                    .fold((0, 0), |(even, odd), pair| match *pair {
                        [a, b] => (even ^ a, odd ^ b),
                        [a] => (even ^ a, odd),
                        _ => (even, odd),
                    });
                code == (0, 0)
            })
        }
        _ => Verdict::No,
    }
}

/// Up to 80 samples.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed (0.1 revolutions/s), where the frame tells.
    pub speed_dhz: Option<u8>,
    view: View,
    fan: Fan<{ 3 * MOST_SAMPLES }>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        self.speed_dhz.map(|speed| f32::from(speed) * 6.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|sample| match *sample {
            [quality, low, high] => {
                let mm = u16::from_le_bytes([low, high]) >> 2;
                (Reading::range_q2(u32::from(mm) << 2), quality.into())
            }
            _ => (Err(NoReturn::Nothing), 0),
        })
    }
}
