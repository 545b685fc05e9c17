//! LDS-006, a spare part of vacuum cleaners: the XV-11's packets of 4 points with another check code, 90 a revolution.
//!
//! Source: PROTOCOL.md of urbaninnovation/lds006_ros2 (MIT); checked against recorded bytes. Silent until it is told
//! [`START`]. **Bytes that it does not know can wedge its reader of commands**: who tries sensors out on an unknown line
//! should listen before he sends. The cure is [`STOP`], then [`START`].
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xFA` | sync |
//! | 1 | `0xA0` + index 0…89; above: a status while the motor starts or stops, without measurements | 4° |
//! | 2 | speed | 0.01 rpm, `u16` LE |
//! | 4 + 4k | distance in bits 13:0; bit 15 none, then bits 7:0 say why; bit 14 weak | mm, `u16` LE |
//! | 6 + 4k | strength of the return; 0 in filler, which is no measurement | `u16` LE |
//! | 20 | sum of the bytes before | `u16` LE |

use crate::lidar::model::{Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::{divided, from_cdeg};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::neato;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::scan::NoReturn;

impl Model {
    /// LDS-006.
    pub const LDS006: Self = Self {
        name: "lds006",
        family: Family::Lds006,
        baud: 115_200,
        points_per_s: 1800,
        revolutions_per_10s: 50,
        beams_per_revolution: 360,
        zero_cdeg: 0,
        counter_clockwise: true,
        min_range_mm: 107,
        max_range_mm: 7337,
        motor: Motor::Commands,
        start: Start::Send(START),
        proof: Proof::RealBytes,
    };
}

/// Bytes of a packet.
pub const FRAME: usize = 22;
/// Starts motor and stream. No end of line may follow.
pub const START: &[u8] = b"startlds$";
/// Stops motor and stream.
pub const STOP: &[u8] = b"stoplds$";

/// Push parser. About 130 bytes.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// LDS-006 packets.
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
        let speed_crpm = u16::from_le_bytes([v0, v1]);
        let points = if index < 90 { points } else { &[] };
        let fan = Fan::new(from_cdeg(400 * u32::from(index)), from_cdeg(100), 4, points)?;
        // A degree at so many 0.01 rpm takes 100e6 / 6 µs divided by them.
        let period_q8 = match u32::from(speed_crpm) {
            speed @ 10_000..=65_535 => divided(4_266_666_667, speed),
            _ => context.base.period_q8,
        };
        Some(Packet {
            index,
            speed_crpm,
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xfa] => Verdict::Need(2),
        [0xfa, 0xa0..=0xff, ..] => Verdict::on(bytes, FRAME, |frame| {
            let parts = frame.split_last_chunk::<2>();
            parts.is_some_and(|(body, code)| {
                let sum = body.iter().map(|byte| u16::from(*byte)).sum::<u16>();
                sum == u16::from_le_bytes(*code)
            })
        }),
        _ => Verdict::No,
    }
}

/// Range and strength of a point of four bytes.
fn point(bytes: &[u8]) -> (Result<u32, NoReturn>, u16) {
    match *bytes {
        [w0, w1, q0, q1] => {
            let strength = u16::from_le_bytes([q0, q1]);
            match neato::range([w0, w1]) {
                // Filler would draw a wall.
                Ok(_) if strength == 0 => (Err(NoReturn::Nothing), 0),
                range => (range, strength),
            }
        }
        _ => (Err(NoReturn::Nothing), 0),
    }
}

/// Four points, or none in a status of the motor.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Which four degrees, 0…89; 90…95 are statuses.
    pub index: u8,
    /// Speed of the motor (0.01 rpm).
    pub speed_crpm: u16,
    view: View,
    fan: Fan<16>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        (self.index < 90).then(|| f32::from(self.speed_crpm) / 100.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::wire::packet::Packet as _;
    use crate::lidar::wire::protocol::Protocol as _;

    /// A frame with its check code.
    fn frame(body: [u8; 20]) -> [u8; FRAME] {
        let sum: u16 = body.iter().map(|byte| u16::from(*byte)).sum();
        let [low, high] = sum.to_le_bytes();
        let mut frame = [0; FRAME];
        frame[..20].copy_from_slice(&body);
        (frame[20], frame[21]) = (low, high);
        frame
    }

    #[test]
    fn filler_is_no_measurement_and_a_status_has_none() {
        let mut parser = Parser::for_model(&Model::LDS006);
        let mut decode = |bytes: [u8; FRAME]| bytes.into_iter().find_map(|b| parser.push(b));
        let points = decode(frame([
            0xfa, 0xa1, 0x30, 0x75, 0xe8, 0x03, 200, 0, 0x77, 0x37, 0, 0, 0x99, 0x80, 0, 0, 0x88,
            0x80, 0, 0,
        ]));
        let points = points.expect("packet");
        assert_eq!(points.speed_rpm(), Some(300.0));
        let mut samples = points.samples();
        let first = samples.next().expect("sample");
        assert!((first.angle_deg - 4.0).abs() < 1e-3);
        assert_eq!((first.range_mm, first.quality), (Some(1000.0), 200));
        assert!(samples.all(|sample| sample.range_mm.is_none()));
        let status = decode(frame([
            0xfa, 0xfb, 6, 0, 0x77, 0x77, 0, 0, 0x77, 0x77, 0, 0, 0x77, 0x77, 0, 0, 0x77, 0x77, 0,
            0,
        ]));
        let status = status.expect("packet");
        assert_eq!((status.beams().count(), status.speed_rpm()), (0, None));
    }
}
