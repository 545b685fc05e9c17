//! Camsense X1 and LDS08RR: frames of 8 or 12 points.
//!
//! Source: open drivers; checked against recordings. The motor runs freely.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x55 0xAA` | sync |
//! | 2 | kind: 2, 3, 7 | bytes of a point: 2, 3, 4 |
//! | 3 | number of points n | |
//! | 4 | speed | rpm/64, `u16` LE |
//! | 6 | angle of the first point + `0xA000` | 1/64° clockwise, `u16` LE |
//! | 8 | n points: distance as on the XV-11; quality of 0, 1 or 2 bytes | mm, `u16` LE |
//! | … | angle of the last point + `0xA000` | 1/64° clockwise, `u16` LE |
//! | … | check code, as on the XV-11 | `u16` LE |

use crate::lidar::model::{Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::{divided, from_deg_q6};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::neato::{ends_in_fold, range};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::scan::NoReturn;

impl Model {
    /// Camsense X1.
    pub const CAMSENSE_X1: Self = Self {
        name: "camsense-x1",
        family: Family::Camsense,
        baud: 115_200,
        points_per_s: 2080,
        revolutions_per_10s: 52,
        beams_per_revolution: 440,
        zero_cdeg: 0,
        counter_clockwise: false,
        nearest_mm: 80,
        farthest_mm: 8000,
        motor: Motor::Own,
        start: Start::Listen,
        proof: Proof::RealBytes,
    };
    /// LDS08RR: the Camsense frame with 16-bit quality.
    pub const CAMSENSE_LDS08RR: Self = Self {
        name: "lds08rr",
        ..Self::CAMSENSE_X1
    };
}

/// Most points of a frame.
pub const MOST_POINTS: usize = 40;
/// Bytes of the longest frame.
pub const FRAME: usize = 12 + 4 * MOST_POINTS;

/// Push parser. About 280 bytes.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// Camsense frames.
#[derive(Debug, Clone)]
pub struct Frames;

impl Layout for Frames {
    type Packet = Packet;

    fn judge(bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(frame: &[u8], context: Context<'_>) -> Option<Packet> {
        let &[
            _,
            _,
            kind,
            count,
            v0,
            v1,
            a0,
            a1,
            ref points @ ..,
            b0,
            b1,
            _,
            _,
        ] = frame
        else {
            return None;
        };
        let first = angle(a0, a1)?;
        let span = angle(b0, b1)?.wrapping_sub(first);
        let step = divided(span, u32::from(count).saturating_sub(1));
        let fan = Fan::new(first, step, point_bytes(kind), points)?;
        let period_q8 = context.base.period_q8;
        Some(Packet {
            speed_rpm_q6: u16::from_le_bytes([v0, v1]),
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0x55] => Verdict::Need(2),
        [0x55, 0xaa] | [0x55, 0xaa, _] => Verdict::Need(4),
        [0x55, 0xaa, kind @ (2 | 3 | 7), count, ..] if (1..=MOST_POINTS as u8).contains(&count) => {
            let length = 12 + usize::from(count) * usize::from(point_bytes(kind));
            if length % 2 == 1 {
                return Verdict::No;
            }
            Verdict::on(bytes, length, |frame| {
                let angles_hold = matches!(
                    *frame,
                    [_, _, _, _, _, _, a0, a1, .., b0, b1, _, _]
                        if angle(a0, a1).is_some() && angle(b0, b1).is_some()
                );
                angles_hold && ends_in_fold(frame)
            })
        }
        _ => Verdict::No,
    }
}

/// Angle of a point; 2³² is a turn.
fn angle(low: u8, high: u8) -> Option<u32> {
    let q6 = u16::from_le_bytes([low, high]).checked_sub(0xa000)?;
    Some(from_deg_q6(u32::from(q6)))
}

const fn point_bytes(kind: u8) -> u8 {
    match kind {
        2 => 2,
        3 => 3,
        7 => 4,
        _ => 0,
    }
}

/// Up to 40 points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed of the motor (rpm/64).
    pub speed_rpm_q6: u16,
    view: View,
    fan: Fan<{ 4 * MOST_POINTS }>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_rpm_q6) / 64.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|point| match *point {
            [w0, w1] => (range([w0, w1]), 0),
            [w0, w1, quality] => (range([w0, w1]), quality.into()),
            [w0, w1, q0, q1] => (range([w0, w1]), u16::from_le_bytes([q0, q1])),
            _ => (Err(NoReturn::Nothing), 0),
        })
    }
}
