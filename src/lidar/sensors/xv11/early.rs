//! Neato XV-11, early firmware: a whole revolution in 1446 bytes.
//!
//! Source: xv11hacking wiki; checked against recordings. No check code: the four bytes of the header are all there is.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x5A 0xA5 0x00 0xC0` | sync |
//! | 4 | speed | the sensor's own, `u16` LE |
//! | 6 + 4k | distance and strength as in [`super`] | |

use super::point;
use crate::lidar::model::{Family, Model};
use crate::lidar::wire::angle::from_cdeg;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;

impl Model {
    /// Neato XV-11, early firmware.
    pub const NEATO_XV11_EARLY: Self = Self {
        name: "xv11-early",
        family: Family::Xv11Early,
        ..Self::NEATO_XV11
    };
}

/// Bytes of a revolution.
pub const FRAME: usize = 1446;

/// Push parser. About 1600 bytes, and as many again in each packet.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// Frames of a whole revolution each.
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
        let &[_, _, _, _, v0, v1, ref points @ ..] = frame else {
            return None;
        };
        let fan = Fan::new(0, from_cdeg(100), 4, points)?;
        let period_q8 = context.base.period_q8;
        Some(Packet {
            speed: u16::from_le_bytes([v0, v1]),
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    const SYNC: [u8; 4] = [0x5a, 0xa5, 0x00, 0xc0];
    match bytes.get(..4) {
        Some(start) if start != SYNC => Verdict::No,
        None if !SYNC.starts_with(bytes) => Verdict::No,
        None => Verdict::Need(bytes.len() + 1),
        Some(_) if bytes.len() < FRAME => Verdict::Need(FRAME),
        Some(_) => Verdict::Frame(FRAME),
    }
}

/// 360 points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed of the motor in the sensor's own unit.
    pub speed: u16,
    view: View,
    fan: Fan<{ FRAME - 6 }>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(point)
    }
}
