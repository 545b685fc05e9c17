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

use crate::lidar::model::{Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::{divided, from_cdeg};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::neato::{ends_in_fold, range};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::scan::NoReturn;

impl Model {
    /// Neato XV-11, firmware 2.4 and later.
    pub const NEATO_XV11: Self = Self {
        name: "xv11",
        family: Family::Xv11,
        baud: 115_200,
        points_per_s: 1800,
        revolutions_per_10s: 50,
        beams_per_revolution: 360,
        zero_cdeg: 0,
        counter_clockwise: true,
        min_range_mm: 60,
        max_range_mm: 5000,
        motor: Motor::Pwm,
        start: Start::Listen,
        proof: Proof::RealBytes,
    };
    /// Xiaomi LDS02RR: the XV-11's frames, clockwise by the one source there is.
    pub const XIAOMI_LDS02RR: Self = Self {
        name: "lds02rr",
        counter_clockwise: false,
        min_range_mm: 150,
        max_range_mm: 6000,
        proof: Proof::OneSource,
        ..Self::NEATO_XV11
    };
}

/// Bytes of a packet.
pub const FRAME: usize = 22;

/// Push parser. About 130 bytes.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// XV-11 packets.
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

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xfa] => Verdict::Need(2),
        [0xfa, 0xa0..=0xf9, ..] => Verdict::on(bytes, FRAME, ends_in_fold),
        _ => Verdict::No,
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
    /// Which four degrees, 0…89.
    pub index: u8,
    /// Speed of the motor (rpm/64).
    pub speed_rpm_q6: u16,
    view: View,
    fan: Fan<16>,
}

impl packet::Packet for Packet {
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
