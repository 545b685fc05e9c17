//! LSLIDAR N10, L10 and N10P: frames of 16 points with one or two returns, all fields big-endian.
//!
//! Source: the maker's driver, and drivers that follow it; no recording was to be had. It sends as soon as it is powered.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xA5 0x5A` | sync |
//! | 5 | angle of the first point | 0.01° clockwise, `u16` BE |
//! | 7 + 3k, N10 | distance, 0 for none; intensity | mm, `u16` BE; `u8` |
//! | 7 + 6k, N10P | the same for the first return, then for the second | |
//! | 55, N10P 105 | angle of the last point | 0.01° clockwise, `u16` BE |
//! | 57, N10P 107 | sum of all before | `u8` |

use crate::lidar::model::{Family, Model, Motor, Proof, Returns, Start};
use crate::lidar::wire::angle::{Revolutions, divided, from_cdeg};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::Pace;
use crate::scan::NoReturn;

impl Model {
    /// LSLIDAR N10, L10.
    pub const LSLIDAR_N10: Self = Self {
        name: "n10",
        family: Family::Lslidar(Returns::One),
        baud: 230_400,
        points_per_s: 4500,
        revolutions_per_10s: 100,
        beams_per_revolution: 520,
        zero_cdeg: 0,
        counter_clockwise: false,
        min_range_mm: 20,
        max_range_mm: 12_000,
        motor: Motor::Own,
        start: Start::Listen,
        proof: Proof::OneSource,
    };
    /// LSLIDAR N10P.
    pub const LSLIDAR_N10P: Self = Self {
        name: "n10p",
        family: Family::Lslidar(Returns::Two),
        baud: 460_800,
        points_per_s: 5400,
        beams_per_revolution: 620,
        max_range_mm: 25_000,
        ..Self::LSLIDAR_N10
    };
}

/// Bytes of the longest frame.
pub const FRAME: usize = 108;

/// Push parser. About 210 bytes.
pub type Parser = parser::Parser<Format, FRAME>;

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let returns = match model.family {
            Family::Lslidar(returns) => returns,
            _ => Returns::One,
        };
        let format = Format {
            base: View::of(model, 0),
            returns,
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
    returns: Returns,
    revolutions: Revolutions,
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes, self.returns)
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Packet> {
        let &[_, _, _, _, _, a0, a1, ref points @ .., b0, b1, _] = frame else {
            return None;
        };
        let first = from_cdeg(u16::from_be_bytes([a0, a1]).into());
        let last = from_cdeg(u16::from_be_bytes([b0, b1]).into());
        let step = divided(last.wrapping_sub(first), 15);
        let fan = Fan::new(first, step, point_bytes(self.returns), points)?;
        let context = Context {
            base: self.base,
            revolutions: &mut self.revolutions,
            pace,
            bytes: frame.len() as u16,
        };
        Some(Packet {
            view: context.view(&fan, self.base.period_q8),
            fan,
        })
    }
}

const fn point_bytes(returns: Returns) -> u8 {
    match returns {
        Returns::One => 3,
        Returns::Two => 6,
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8], returns: Returns) -> Verdict {
    match *bytes {
        [0xa5] => Verdict::Need(2),
        [0xa5, 0x5a, ..] => {
            let length = 10 + 16 * usize::from(point_bytes(returns));
            Verdict::on(bytes, length, |frame| {
                let angle = |at: usize| match frame.get(at..at + 2) {
                    Some(&[high, low]) => u16::from_be_bytes([high, low]),
                    _ => u16::MAX,
                };
                // A sum of 8 bits lets one damaged frame of 256 pass; its angles help.
                let sum = frame.split_last().is_some_and(|(code, body)| {
                    body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)) == *code
                });
                sum && angle(5) <= 36_000 && angle(length - 3) <= 36_000
            })
        }
        _ => Verdict::No,
    }
}

/// Sixteen points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    view: View,
    fan: Fan<96>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|point| match *point {
            [d0, d1, intensity, ..] => {
                let mm = u16::from_be_bytes([d0, d1]);
                (Reading::range_q2(u32::from(mm) << 2), intensity.into())
            }
            _ => (Err(NoReturn::Nothing), 0),
        })
    }
}
