//! SLAMTEC RPLIDAR: standard scan, five bytes a point; the capsules have files of their own.
//!
//! Source: RPLIDAR S/A series interface protocol and communication protocol documents; checked against recordings.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | bit 0: first of a revolution; bit 1: its inverse; bits 7:2 quality | |
//! | 1 | bit 0: 1; with the next byte, 15 bits of angle | 1/64° clockwise |
//! | 3 | distance, 0 for none | mm/4, `u16` LE |
//!
//! There is no check code: of random bytes, one pair in four passes for a point's first two. So beams keep their
//! ranges to themselves until five points in a row have followed a lost line.

pub mod capsule;
pub mod command;
pub mod hq;
mod models;
pub mod ultra;

use crate::lidar::model::Model;
use crate::lidar::wire::angle::from_deg_q6;
use crate::lidar::wire::answer;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::survey::{self, Survey};
use crate::lidar::wire::timing::Pace;

/// Good points in a row that prove the line found again.
const SETTLED: u8 = 5;
/// The longest answer that can stand between points: information, with its descriptor.
const MAX_ANSWER_BYTES: usize = 27;

/// Push parser of the standard scan. About 150 bytes.
pub type Parser = parser::Parser<Format, MAX_ANSWER_BYTES>;

impl Parser {
    /// A1 and A2 at 115 200 baud.
    #[must_use]
    pub const fn new() -> Self {
        Self::for_model(&Model::RPLIDAR_SCAN)
    }

    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        Self::with_format(Format::new(model), model.baud)
    }
}

impl Default for Parser {
    fn default() -> Self {
        Self::new()
    }
}

/// State of the standard scan's parser.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Format {
    base: View,
    /// Good points in a row.
    good: u8,
}

impl Format {
    const fn new(model: &Model) -> Self {
        Self {
            base: View::of(model, 0),
            good: SETTLED,
        }
    }
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(&mut self, frame: &[u8], follows: bool, pace: &mut Pace) -> Option<Packet> {
        let &[flags, a0, a1, d0, d1] = frame else {
            return None;
        };
        self.good = if follows {
            self.good.saturating_add(1)
        } else {
            0
        };
        let angle_q6 = u16::from_le_bytes([a0, a1]) >> 1;
        let quarters = u16::from_le_bytes([d0, d1]);
        Some(Packet {
            view: View {
                first_us: pace.first_us(1, self.base.period_q8, 5),
                revolution_start: if flags & 1 == 1 { Some(0) } else { None },
                doubtful: self.good < SETTLED,
                ..self.base
            },
            reading: Reading {
                angle: from_deg_q6(angle_q6.into()),
                range: Reading::range_q2(quarters.into()),
                quality: u16::from(flags >> 2),
            },
        })
    }

    /// Random bytes are full of points, which have no check code: they count only without gaps.
    fn survey(&self, bytes: &[u8]) -> Survey {
        let survey = survey::count(bytes, judge);
        let covered = u64::from(survey.covered_bytes);
        if survey.frames >= 20 && covered * 20 >= bytes.len() as u64 * 19 {
            survey
        } else {
            Survey::default()
        }
    }
}

/// Points of the standard scan among other bytes.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xa5, 0x5a, ..] => answer::judge(bytes),
        [flags, ..] if (flags ^ (flags >> 1)) & 1 == 0 => Verdict::No,
        [_] => Verdict::Need(2),
        [_, angle, ..] if angle & 1 == 0 => Verdict::No,
        [_, _, _, _, _, ..] => Verdict::Frame(5),
        _ => Verdict::Need(5),
    }
}

/// One point.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    view: View,
    reading: Reading,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        core::iter::once(self.reading)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::wire::packet::Packet as _;
    use crate::lidar::wire::protocol::Protocol;
    use crate::scan::NoReturn;

    #[test]
    fn a_point_behind_its_descriptor() {
        let mut parser = Parser::new();
        let bytes = [
            0xa5, 0x5a, 0x05, 0x00, 0x00, 0x40, 0x81, // descriptor
            0x3d, 0x01, 0x2d, 0xa0, 0x0f, // 90°, 1000 mm, first of a revolution
        ];
        let packet = bytes.iter().find_map(|&byte| parser.push(byte));
        let packet = packet.expect("packet");
        assert_eq!(packet.revolution_start(), Some(0));
        let sample = packet.samples().next().expect("sample");
        assert_eq!((sample.range_mm, sample.quality), (Some(1000.0), 15));
        assert!((sample.angle_deg - 90.0).abs() < 1e-3, "{sample:?}");
        let counters = parser.counters();
        assert_eq!((counters.answers, counters.skipped_bytes), (1, 0));
    }

    #[test]
    fn points_behind_a_slip_are_doubtful_at_first() {
        let point = [0x3e, 0x01, 0x2d, 0xa0, 0x0f];
        let line = [point; 8];
        let (first, others) = line.split_at(1);
        let bytes = first
            .iter()
            .flatten()
            .chain(&[0])
            .chain(others.iter().flatten());
        let mut parser = Parser::new();
        let mut ranges = heapless::Vec::<_, 8>::new();
        for packet in bytes.filter_map(|&byte| parser.push(byte)) {
            ranges.extend(packet.beams().map(|beam| beam.range.mm()));
        }
        let doubtful = Err(NoReturn::Doubtful);
        let expected = [
            Ok(1000),
            doubtful,
            doubtful,
            doubtful,
            doubtful,
            doubtful,
            Ok(1000),
            Ok(1000),
        ];
        assert_eq!(ranges, expected);
    }
}
