//! A protocol for the tests of this folder, which must not know a sensor: frames of 47 bytes, the last of them the sum
//! of the others.

use super::framing::Verdict;
use super::packet::{Packet, Reading, View};
use super::parser::{Format, Parser};
use super::timing::Pace;
use crate::scan::NoReturn;

/// A good frame. Its first two bytes occur nowhere else in it.
pub(super) const FRAME: [u8; 47] = {
    let mut frame = [0; 47];
    (frame[0], frame[1]) = (0x54, 0x2c);
    let mut k = 2;
    while k < 46 {
        frame[k] = 100 + k as u8;
        k += 1;
    }
    let mut sum = 0u8;
    let mut k = 0;
    while k < 46 {
        sum = sum.wrapping_add(frame[k]);
        k += 1;
    }
    frame[46] = sum;
    frame
};

/// A parser of such frames.
pub(super) fn parser() -> Parser<Frames, 47> {
    Parser::with_format(Frames, 115_200)
}

#[derive(Debug)]
pub(super) struct Frames;

impl Format for Frames {
    type Packet = Nothing;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        match *bytes {
            [0x54] => Verdict::Need(2),
            [0x54, 0x2c, ..] => Verdict::on(bytes, 47, |frame| {
                let sum = frame
                    .iter()
                    .take(46)
                    .fold(0u8, |sum, b| sum.wrapping_add(*b));
                frame.last() == Some(&sum)
            }),
            _ => Verdict::No,
        }
    }

    fn packet(&mut self, _: &[u8], _: bool, _: &mut Pace) -> Option<Nothing> {
        Some(Nothing(View::default()))
    }
}

/// One beam without a range.
#[derive(Debug, PartialEq)]
pub(super) struct Nothing(View);

impl Packet for Nothing {
    fn view(&self) -> &View {
        &self.0
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        core::iter::once(Reading {
            angle: 0,
            range: Err(NoReturn::Nothing),
            quality: 0,
        })
    }
}
