//! YDLIDAR and COIN-D4: frames of up to 80 samples of two, three or four bytes.
//!
//! Source: development manuals of the X2, X4, G2, G4, T-mini; checked against recordings and the maker's SDK. COIN-D4: two
//! open drivers; checked against recorded bytes.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xAA 0x55` | sync |
//! | 2 | bit 0: first of a revolution; bits 7:1 speed, valid there | 0.1 Hz |
//! | 3 | number of samples n | |
//! | 4 | angle of the first sample; bit 0: 1 | 1/128° clockwise, `u16` LE |
//! | 6 | angle of the last sample; bit 0: 1 | 1/128° clockwise, `u16` LE |
//! | 8 | XOR of the other 16-bit words; of three-byte samples the first byte is a word | `u16` LE |
//! | 10 | n samples | |
//!
//! The size of a sample cannot be read from a frame; it belongs to the model. A revolution starts with the frame that says so;
//! where that one is lost, [`Assembler`](crate::scan::Assembler) notices.

pub mod command;
mod models;

use crate::lidar::model::{Correction, Family, Flags, Model, Samples};
#[cfg(feature = "internals")]
use crate::lidar::wire::angle::from_cdeg;
use crate::lidar::wire::angle::{divided, from_deg_q6};
use crate::lidar::wire::answer;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::Pace;
use crate::math::atan2_turn;
use crate::scan::NoReturn;

/// Most samples of a frame.
pub const MAX_SAMPLES: usize = 80;
/// Bytes of the longest frame.
pub const FRAME: usize = 10 + 4 * MAX_SAMPLES;

/// Push parser. About 440 bytes.
pub type Parser = parser::Parser<Format, FRAME>;

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let samples = match model.family {
            Family::Ydlidar(samples) => samples,
            _ => Samples::TRIANGLE,
        };
        let shift = match samples.flags {
            Flags::Intensity => 2,
            Flags::None | Flags::Doubt | Flags::Exposure => 0,
        };
        let format = Format {
            samples,
            base: View::of(model, shift),
        };
        Self::with_format(format, model.baud)
    }
}

/// What the parser knows of its model.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Format {
    samples: Samples,
    base: View,
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes, self.samples.bytes)
    }

    /// The answer that tells it is not taken from the line: one to a question for the speed looks the same.
    #[cfg(feature = "internals")]
    fn set_zero(&mut self, zero_cdeg: u16) {
        self.base.zero = from_cdeg(zero_cdeg.into());
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Packet> {
        let &[_, _, kind, count, a0, a1, b0, b1, _, _, ref body @ ..] = frame else {
            return None;
        };
        let first_q6 = u32::from(u16::from_le_bytes([a0, a1]) >> 1);
        let last_q6 = u32::from(u16::from_le_bytes([b0, b1]) >> 1);
        let span = from_deg_q6(last_q6).wrapping_sub(from_deg_q6(first_q6));
        let begins = kind & 1 == 1;
        let mut samples = [0; 4 * MAX_SAMPLES];
        let target = samples.get_mut(..body.len())?;
        target.copy_from_slice(body);
        Some(Packet {
            speed_dhz: begins.then_some(match kind >> 1 {
                0 => 0,
                told => told.saturating_add(self.samples.speed_offset_dhz),
            }),
            view: View {
                first_us: pace.first_us(count.into(), self.base.period_q8, frame.len() as u16),
                revolution_start: begins.then_some(0),
                ..self.base
            },
            format: self.samples,
            first: from_deg_q6(first_q6),
            step: divided(span, u32::from(count).saturating_sub(1)),
            bytes: body.len() as u16,
            samples,
        })
    }
}

/// YDLIDAR frames with samples of so many bytes among other bytes.
fn judge(bytes: &[u8], sample_bytes: u8) -> Verdict {
    match *bytes {
        [0xaa] | [0xa5] => Verdict::Need(2),
        [0xa5, 0x5a, ..] => answer::judge(bytes),
        [0xaa, 0x66, ..] => match bytes.get(..8) {
            None => Verdict::Need(8),
            // Time frame: XOR of all bytes, the code among them, is 0.
            Some(frame) if frame.iter().fold(0, |a, b| a ^ b) == 0 => Verdict::Answer(8),
            Some(_) => Verdict::No,
        },
        [0xaa, 0x55] | [0xaa, 0x55, _] => Verdict::Need(4),
        [0xaa, 0x55, _, count, ..] if (1..=MAX_SAMPLES as u8).contains(&count) => {
            let length = 10 + usize::from(count) * usize::from(sample_bytes);
            Verdict::on(bytes, length, |frame| check_code(frame, sample_bytes) == 0)
        }
        _ => Verdict::No,
    }
}

/// XOR of all words of a frame, its check code among them: 0 for a good one.
fn check_code(frame: &[u8], sample_bytes: u8) -> u16 {
    let (header, samples) = frame.split_at(frame.len().min(10));
    let words = |bytes: &[u8]| {
        bytes.chunks(2).fold(0, |code, word| match *word {
            [low, high] => code ^ u16::from_le_bytes([low, high]),
            [low] => code ^ u16::from(low),
            _ => code,
        })
    };
    if sample_bytes != 3 {
        return words(header) ^ words(samples);
    }
    samples
        .chunks_exact(3)
        .fold(words(header), |code, sample| match *sample {
            [first, low, high] => code ^ u16::from(first) ^ u16::from_le_bytes([low, high]),
            _ => code,
        })
}

/// Up to 80 samples.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed (0.1 revolutions/s), in the frame that starts a revolution; 0 on sensors that do not tell.
    pub speed_dhz: Option<u8>,
    view: View,
    format: Samples,
    first: u32,
    step: u32,
    bytes: u16,
    samples: [u8; 4 * MAX_SAMPLES],
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        self.speed_dhz
            .filter(|speed| *speed != 0)
            .map(|speed| f32::from(speed) * 6.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        let bytes = self.samples.get(..usize::from(self.bytes)).unwrap_or(&[]);
        let mut angle = self.first;
        bytes
            .chunks_exact(usize::from(self.format.bytes).max(2))
            .map(move |sample| {
                let (word, quality, flags) = self.format.split(sample);
                let quarters = u32::from(word) * u32::from(self.format.unit_q2);
                let reading = Reading {
                    angle: angle.wrapping_add(self.format.correction.angle(quarters)),
                    range: match (quarters, flags) {
                        (0, 2 | 3) if self.format.flags == Flags::Doubt => Err(NoReturn::Doubtful),
                        _ => Reading::range_q2(quarters),
                    },
                    quality,
                };
                angle = angle.wrapping_add(self.step);
                reading
            })
    }
}

impl Samples {
    /// Distance in its own unit, intensity, flags.
    fn split(self, sample: &[u8]) -> (u16, u16, u8) {
        match *sample {
            [low, high] => (u16::from_le_bytes([low, high]), 0, 0),
            [first, low, high] => {
                let word = u16::from_le_bytes([low, high]);
                let flags = (word & 3) as u8;
                match self.flags {
                    Flags::None => (word, first.into(), 0),
                    Flags::Intensity => (word & !3, u16::from_le_bytes([first, flags]), 0),
                    Flags::Doubt => (word & !3, first.into(), flags),
                    Flags::Exposure => (word & !3, u16::from(flags << 6 | first >> 2), 0),
                }
            }
            [i0, i1, low, high] => (
                u16::from_le_bytes([low, high]),
                u16::from_le_bytes([i0, i1]),
                0,
            ),
            _ => (0, 0, 0),
        }
    }
}

impl Correction {
    /// To be added to the angle of a point at this distance (mm/4); 2³² is a turn.
    fn angle(self, quarters: u32) -> u32 {
        // Beyond 32 m the angle no longer changes.
        let d = quarters.min(0x1_ffff) as i32;
        let turn = match self {
            _ if d == 0 => 0,
            Self::None => 0,
            // 21.8 (155.3 - d/4) over 155.3 d/4, both sides times 200 and so below 2³⁰.
            Self::Triangle => atan2_turn(109 * (6212 - 10 * d), 7765 * d),
            Self::Scl => atan2_turn(712, 10 * d),
        };
        u32::from(turn) << 16
    }
}
