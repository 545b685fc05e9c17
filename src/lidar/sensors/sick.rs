//! SICK LMS200, LMS211, LMS291: telegrams with half a revolution of measurements.
//!
//! Source: SICK telegram listing; open drivers' check code. A rotating mirror with 75 revolutions a second.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x02` | start |
//! | 1 | address: `0x80` from the sensor, `0x00` to it | |
//! | 2 | length n | `u16` LE |
//! | 4 | command or answer and its data, n bytes | |
//! | 4 + n | CRC-16 of all before | `u16` LE |
//!
//! Answer `0xB0`: `u16` (count in bits 9:0, partial scan in 12:11, unit in 15:14: 0 cm, 1 mm), as many `u16` with 13
//! bits of distance, a status byte. Counter-clockwise from the right-hand side.

use crate::lidar::model::{Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::from_cdeg;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan, Layout, Plain};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::request::{MAX_BYTES, Request};
use crate::scan::{Beam, NoReturn};

impl Model {
    /// SICK LMS200, LMS291: 9600 baud after power-on; only 500 000 carries every scan.
    pub const SICK_LMS200: Self = Self {
        name: "lms200",
        family: Family::Sick,
        baud: 500_000,
        points_per_s: 27_000,
        revolutions_per_10s: 750,
        beams_per_revolution: 401,
        zero_cdeg: 9000,
        counter_clockwise: true,
        min_range_mm: 50,
        max_range_mm: 8182,
        motor: Motor::Own,
        start: Start::Sick,
        proof: Proof::Document,
    };
}

/// Bytes of the longest telegram.
pub const FRAME: usize = 4 + 812 + 2;
/// Most measurements of a telegram.
pub const MAX_VALUES: usize = 401;

/// Payload that starts the stream.
pub const START: [u8; 2] = [0x20, 0x24];
/// Payload that stops it.
pub const STOP: [u8; 2] = [0x20, 0x25];
/// Answer to the payloads that begin with `0x20`.
pub const MODE_ANSWER: u8 = 0xa0;
/// Payload that asks for the status.
pub const STATUS: [u8; 1] = [0x31];
/// Payload that sets 38 400 baud.
pub const BAUD_38400: [u8; 2] = [0x20, 0x40];
/// Payload that sets 9600 baud.
pub const BAUD_9600: [u8; 2] = [0x20, 0x42];
/// Payload that sets 500 000 baud.
pub const BAUD_500K: [u8; 2] = [0x20, 0x48];
/// Payload that chooses 180° in steps of 0.5°.
pub const HALF_DEGREES: [u8; 5] = [0x3b, 0xb4, 0x00, 0x32, 0x00];
/// Payload that chooses 180° in steps of 1°.
pub const WHOLE_DEGREES: [u8; 5] = [0x3b, 0xb4, 0x00, 0x64, 0x00];

/// Time in which the mirror turns by a degree (µs/256): 13.3 ms a revolution.
const DEGREE_Q8: u32 = 3_413_333 / 360;

/// Push parser. About 950 bytes; a packet has 850.
pub type Parser = parser::Parser<Plain<Telegrams>, FRAME>;

/// Telegrams of the sensor's.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Telegrams;

impl Layout for Telegrams {
    type Packet = Packet;

    fn judge(bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(frame: &[u8], context: Context<'_>) -> Option<Packet> {
        let (body, _) = frame.split_last_chunk::<2>()?;
        let &[_, _, _, _, answer, ref data @ ..] = body else {
            return None;
        };
        let (0xb0, &[h0, h1, ref values @ ..]) = (answer, data) else {
            return Some(Packet {
                answer,
                unit_q2: 0,
                revolutions: 1,
                view: context.base,
                fan: Fan::new(0, 0, 2, &[])?,
            });
        };
        let header = u16::from_le_bytes([h0, h1]);
        let count = usize::from(header & 0x3ff).min(MAX_VALUES);
        let values = values.get(..2 * count).unwrap_or(values);
        // The count says which of the sensor's fields of view and steps this is.
        let (start_cdeg, step_cdeg) = match count {
            361 => (0, 50),
            401 => (4000, 25),
            201 => (4000, 50),
            101 => (4000, 100),
            _ => (0, 100),
        };
        let partial = if header & 0x2000 != 0 {
            (header >> 11) & 3
        } else {
            0
        };
        let first = from_cdeg(start_cdeg + 25 * u32::from(partial));
        let fan = Fan::new(first, from_cdeg(step_cdeg), 2, values)?;
        let revolutions = 100 / step_cdeg as u16;
        let first_us = context
            .pace
            .first_us(360 * revolutions, DEGREE_Q8, context.bytes);
        Some(Packet {
            answer,
            unit_q2: if header >> 14 == 1 { 4 } else { 40 },
            revolutions,
            view: View {
                first_us,
                period_q8: DEGREE_Q8 / u32::from(revolutions),
                revolution_start: (fan.count() > 0).then_some(0),
                ..context.base
            },
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
pub(crate) fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0x02] => Verdict::Need(2),
        [0x02, 0x80 | 0x00] | [0x02, 0x80 | 0x00, _] => Verdict::Need(4),
        [0x02, 0x80 | 0x00, l0, l1, ..] => {
            let length = usize::from(u16::from_le_bytes([l0, l1]));
            if !(1..=FRAME - 6).contains(&length) {
                return Verdict::No;
            }
            Verdict::on(bytes, length + 6, |frame| {
                let parts = frame.split_last_chunk::<2>();
                parts.is_some_and(|(body, code)| check_code(body) == u16::from_le_bytes(*code))
            })
        }
        _ => Verdict::No,
    }
}

/// The sensor's CRC-16, which takes each byte together with the one before.
#[must_use]
pub fn check_code(bytes: &[u8]) -> u16 {
    let mut previous = 0u8;
    bytes.iter().fold(0u16, |crc, &byte| {
        let poly = if crc & 0x8000 != 0 { 0x8005 } else { 0 };
        let pair = u16::from_le_bytes([byte, previous]);
        previous = byte;
        (crc << 1) ^ poly ^ pair
    })
}

/// The telegram to the sensor with this payload, of which at most 18 bytes are sent.
#[must_use]
pub fn request(payload: &[u8]) -> Request {
    let payload = payload.get(..MAX_BYTES - 6).unwrap_or(payload);
    let mut request = Request::of(&[&[0x02, 0x00, payload.len() as u8, 0x00], payload]);
    for byte in check_code(&request).to_le_bytes() {
        request.push(byte);
    }
    request
}

/// One telegram of the sensor's.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// What it is: `0xB0` measurements.
    pub answer: u8,
    unit_q2: u8,
    /// Turns of the mirror that the measurements took.
    revolutions: u16,
    view: View,
    fan: Fan<{ 2 * MAX_VALUES }>,
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    /// A revolution of the mirror takes a measurement a degree: of half degrees the odd ones are those of a second revolution,
    /// 13.3 ms after the even ones, of quarter degrees every fourth is one revolution's.
    fn beams(&self) -> impl Iterator<Item = Beam> + '_ {
        let (passes, first_us) = (u32::from(self.revolutions.max(1)), self.view.first_us);
        let beams = packet::beams(self.view, self.readings());
        (0u32..).zip(beams).map(move |(k, beam)| {
            let (pass, degree) = (k % passes, k / passes);
            let age_q8 = pass * 360 * DEGREE_Q8 + degree * DEGREE_Q8;
            Beam {
                time_us: first_us.wrapping_add(age_q8 >> 8),
                ..beam
            }
        })
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|value| {
            let value = match *value {
                [low, high] => u16::from_le_bytes([low, high]) & 0x1fff,
                _ => 0,
            };
            let range = match value {
                // The last nine values are the sensor's error codes; the first of them is "too far".
                0x1ff7 => Err(NoReturn::TooFar),
                0x1ff8.. => Err(NoReturn::Sensor(value as u8)),
                _ => Reading::range_q2(u32::from(value) * u32::from(self.unit_q2)),
            };
            (range, 0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::Protocol as _;
    use crate::lidar::wire::packet::Packet as _;

    #[test]
    fn interleaved_measurements_have_the_times_of_their_revolutions() {
        // count, in steps of (0.01°), revolutions of the mirror
        for (count, revolutions) in [(181u16, 1u32), (361, 2), (401, 4)] {
            let mut frame = heapless::Vec::<u8, FRAME>::new();
            let length = 4 + 2 * count;
            let head = [0x02, 0x80, length as u8, (length >> 8) as u8, 0xb0];
            frame.extend_from_slice(&head).expect("room");
            let header = (0x4000 | count).to_le_bytes();
            frame.extend_from_slice(&header).expect("room");
            for _ in 0..count {
                frame.extend_from_slice(&[0xe8, 0x03]).expect("room");
            }
            frame.push(0x10).expect("room");
            let code = check_code(&frame).to_le_bytes();
            frame.extend_from_slice(&code).expect("room");
            let mut parser = Parser::for_model(&Model::SICK_LMS200);
            let packet = frame.iter().find_map(|&byte| parser.push(byte));
            let packet = packet.expect("a whole telegram");
            let first_us = packet.view().first_us;
            for (k, beam) in (0u32..).zip(packet.beams()) {
                let (pass, degree) = (k % revolutions, k / revolutions);
                let wanted = f64::from(pass) * 13_333.3 + f64::from(degree) * 37.037;
                let age = f64::from(beam.time_us.wrapping_sub(first_us));
                // The degree's time is cut to 1/256 µs.
                assert!((age - wanted).abs() < 4.0, "{count}: {k}: {age} {wanted}");
            }
            assert_eq!(packet.beams().count(), usize::from(count));
        }
    }
}
