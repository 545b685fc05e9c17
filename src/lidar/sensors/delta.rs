//! 3irobotix Delta-1A, 2A, 2B, 2D, 2G: big-endian frames of a sixteenth or a fifteenth of a revolution.
//!
//! Source: the makers' protocol documents and their example frames. The host drives the motor.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xAA` | sync |
//! | 1 | length L without the sum | `u16` BE |
//! | 3 | version; `0x10` has the angle of the sector's end | |
//! | 4 | `0x61` | |
//! | 5 | `0xAD` measurements, `0xAE` speed out of range | |
//! | 6 | length of the data, L - 8 | `u16` BE |
//! | 8 | speed | 0.05 revolutions/s |
//! | 9 | zero offset; informative | 0.01°, `i16` BE |
//! | 11 | angle of the sector's start; of its end | 0.01° clockwise, `u16` BE |
//! | … | n points: signal; distance, 0 for none | `u8`; mm/4, `u16` BE |
//! | L | sum of all before | `u16` BE |

use crate::lidar::model::{Family, Model, Motor, Proof, Sector, Start};
use crate::lidar::wire::angle::{Revolutions, divided, from_cdeg};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::Pace;
use crate::scan::NoReturn;

impl Model {
    /// 3irobotix Delta-1A, 2A, 2B.
    pub const DELTA_2A: Self = Self {
        name: "delta-2a",
        family: Family::Delta(Sector::Sixteenth),
        baud: 230_400,
        points_per_s: 4500,
        revolutions_per_10s: 60,
        beams_per_revolution: 960,
        zero_cdeg: 0,
        counter_clockwise: false,
        min_range_mm: 130,
        max_range_mm: 8000,
        motor: Motor::Pwm,
        start: Start::Listen,
        proof: Proof::Document,
    };
    /// 3irobotix Delta-2G.
    pub const DELTA_2G: Self = Self {
        name: "delta-2g",
        family: Family::Delta(Sector::Fifteenth),
        baud: 115_200,
        points_per_s: 1890,
        revolutions_per_10s: 52,
        beams_per_revolution: 900,
        ..Self::DELTA_2A
    };
}

/// Bytes of the longest frame.
pub const FRAME: usize = 1026;
/// Most points that a frame is believed to have; further ones are left out.
pub const MAX_POINTS: usize = 120;

impl Sector {
    const fn cdeg(self) -> u32 {
        match self {
            Self::Sixteenth => 2250,
            Self::Fifteenth => 2400,
        }
    }
}

/// Push parser. About 1150 bytes; a packet has 400.
pub type Parser = parser::Parser<Format, FRAME>;

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let format = Format {
            base: View::of(model, 0),
            sector: match model.family {
                Family::Delta(sector) => sector,
                _ => Sector::Sixteenth,
            },
            previous_cdeg: None,
            revolutions: Revolutions::new(),
        };
        Self::with_format(format, model.baud)
    }
}

/// State of the parser.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Format {
    base: View,
    sector: Sector,
    previous_cdeg: Option<u16>,
    revolutions: Revolutions,
}

impl Format {
    /// How much of a revolution a frame covers, as configured or as two frames in a row told.
    pub fn sector(&self) -> Sector {
        self.sector
    }

    /// Angle that this frame covers: by its own fields, or by its distance from the one before.
    fn span_cdeg(&mut self, start: u16, end: Option<u16>) -> u32 {
        let from = |from: u16, to: u16| {
            let wrap = if to < from { 36_000 } else { 0 };
            (u32::from(to) + wrap).saturating_sub(from.into())
        };
        if let Some(end) = end {
            return from(start, end);
        }
        // Units were sold under one name with both sectors: two frames in a row tell.
        match self
            .previous_cdeg
            .replace(start)
            .map(|previous| from(previous, start))
        {
            Some(2240..=2260) => self.sector = Sector::Sixteenth,
            Some(2390..=2410) => self.sector = Sector::Fifteenth,
            _ => {}
        }
        self.sector.cdeg()
    }
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Packet> {
        let (body, _) = frame.split_last_chunk::<2>()?;
        let (start_cdeg, end_cdeg, points) = match *body {
            [
                _,
                _,
                _,
                0x10,
                _,
                0xad,
                _,
                _,
                _,
                _,
                _,
                a0,
                a1,
                b0,
                b1,
                ref points @ ..,
            ] => (
                u16::from_be_bytes([a0, a1]),
                Some(u16::from_be_bytes([b0, b1])),
                points,
            ),
            [_, _, _, _, _, 0xad, _, _, _, _, _, a0, a1, ref points @ ..] => {
                (u16::from_be_bytes([a0, a1]), None, points)
            }
            _ => (0, None, &[][..]),
        };
        let &[_, _, _, _, _, command, _, _, speed_q05, ..] = body else {
            return None;
        };
        let points = points.get(..3 * MAX_POINTS).unwrap_or(points);
        let count = (points.len() / 3) as u32;
        let (mut first, mut step) = (0, 0);
        if command == 0xad {
            first = from_cdeg(start_cdeg.into());
            step = divided(from_cdeg(self.span_cdeg(start_cdeg, end_cdeg)), count);
        }
        let fan = Fan::new(first, step, 3, points)?;
        // A revolution at so many 0.05 revolutions a second takes 20e6 µs divided by them; `step` is a share of 2³² of it.
        let revolution_us = divided(20_000_000, speed_q05.into());
        let period_q8 = if revolution_us == 0 || step == 0 {
            self.base.period_q8
        } else {
            ((u64::from(revolution_us) * u64::from(step)) >> 24) as u32
        };
        let context = Context {
            base: self.base,
            revolutions: &mut self.revolutions,
            pace,
            bytes: frame.len() as u16,
        };
        Some(Packet {
            command,
            speed_q05,
            view: context.view(&fan, period_q8),
            fan,
        })
    }
}

/// Delta frames among other bytes.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xaa] | [0xaa, _] => Verdict::Need(3),
        [0xaa, l0, l1, ref rest @ ..] => {
            let length = usize::from(u16::from_be_bytes([l0, l1]));
            if !(8..=FRAME - 2).contains(&length) {
                return Verdict::No;
            }
            match *rest {
                [_, 0x61, _, d0, d1, ..]
                    if usize::from(u16::from_be_bytes([d0, d1])) + 8 != length =>
                {
                    Verdict::No
                }
                [_, 0x61, _, _, _, ..] => Verdict::on(bytes, length + 2, |frame| {
                    let parts = frame.split_last_chunk::<2>();
                    parts.is_some_and(|(body, code)| {
                        let add = |sum: u16, byte: &u8| sum.wrapping_add(u16::from(*byte));
                        body.iter().fold(0, add) == u16::from_be_bytes(*code)
                    })
                }),
                [_, 0x61, ..] => Verdict::Need(8),
                [_, _, ..] => Verdict::No,
                _ => Verdict::Need(5),
            }
        }
        _ => Verdict::No,
    }
}

/// Up to 120 points, or the report of a wrong speed.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// `0xAD` measurements, `0xAE` speed out of range.
    pub command: u8,
    /// Speed of the motor (0.05 revolutions/s).
    pub speed_q05: u8,
    view: View,
    fan: Fan<{ 3 * MAX_POINTS }>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_q05) * 3.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|point| match *point {
            [quality, d0, d1] => {
                let quarters = u16::from_be_bytes([d0, d1]);
                (Reading::range_q2(quarters.into()), quality.into())
            }
            _ => (Err(NoReturn::Nothing), 0),
        })
    }
}
