//! Neato XV-11, early firmware: a whole turn in 1446 bytes.
//!
//! Source: xv11hacking wiki; checked against recordings. No check code: the four bytes of the header are all there is.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x5A 0xA5 0x00 0xC0` | sync |
//! | 4 | speed | the sensor's own, `u16` LE |
//! | 6 + 4k | distance and strength as in [`super`] | |

use super::super::timing::Pace;
use super::super::{Model, Reading, Verdict, View};
use super::readings;

/// Bytes of a turn.
pub const FRAME: usize = 1446;
const POINTS: usize = 360;

/// Push parser. About 1600 bytes, and as many again in each packet.
pub type Parser = super::super::Parser<Format, FRAME>;

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let format = Format {
            base: View::of(model, 4),
            turns: 0,
        };
        Self::with_format(format, model.baud)
    }
}

/// State of the parser.
#[derive(Debug, Clone)]
pub struct Format {
    base: View,
    turns: u8,
}

impl super::super::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Packet> {
        let frame: &[u8; FRAME] = frame.try_into().ok()?;
        let &[_, _, _, _, v0, v1, ref points @ ..] = frame;
        let turn_start = (self.turns != 0).then_some(0);
        self.turns = 1;
        Some(Packet {
            speed: u16::from_le_bytes([v0, v1]),
            view: View {
                first_us: pace.first_us(POINTS as u16, self.base.period_q8, FRAME as u16),
                turn_start,
                ..self.base
            },
            points: *points,
        })
    }
}

/// Turns among other bytes.
pub(in crate::lidar) fn judge(bytes: &[u8]) -> Verdict {
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
    points: [u8; 4 * POINTS],
}

impl super::super::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        readings(0, &self.points)
    }
}
