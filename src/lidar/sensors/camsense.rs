//! Camsense X1 and its relatives: frames of 8, 12 or 16 points.
//!
//! Source: the maker's SDK, open drivers; checked against recordings of X1 and LDS08RR, and of one frame of the "Mystery
//! 360", a nameless sensor with this format. The motor runs freely.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x55 0xAA` | sync |
//! | 2 | kind: 2; 3 and `0x23`; 7 | bytes of a point: 2; 3; 4 |
//! | 3 | number of points n | |
//! | 4 | speed | rpm/64, `u16` LE |
//! | 6 | angle of the first point: `0xA000` + 1/64°; on T2 and T200 0.01° | clockwise, `u16` LE |
//! | 8 | n points: distance as on the XV-11; quality of 0, 1 or 2 bytes | mm, `u16` LE |
//! | … | angle of the last point, as above | `u16` LE |
//! | … | check code, as on the XV-11 | `u16` LE |
//!
//! Receiver and laser of X1 and X2 lie beside each other, so that the angle of a near point is off: by 5.7° at 0.2 m, 1.1°
//! at 1 m. Beams are corrected for it, as the maker's driver does; [`samples`](packet::Packet::samples) are as sent.

use crate::lidar::model::{Camsense, Family, Model, Motor, Proof, Start};
use crate::lidar::wire::angle::{Revolutions, divided, from_cdeg, from_deg_q6};
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Fan};
use crate::lidar::wire::neato::{ends_in_fold, range};
use crate::lidar::wire::packet::{self, Reading, Sample, View};
use crate::lidar::wire::parser;
use crate::lidar::wire::timing::Pace;
use crate::math::{atan2_turn, isqrt};
use crate::scan::NoReturn;

impl Model {
    /// Camsense X1.
    pub const CAMSENSE_X1: Self = Self {
        name: "camsense-x1",
        family: Family::Camsense(Camsense::X1),
        baud: 115_200,
        points_per_s: 2080,
        revolutions_per_10s: 52,
        beams_per_revolution: 440,
        zero_cdeg: 0,
        counter_clockwise: false,
        min_range_mm: 80,
        max_range_mm: 8000,
        motor: Motor::Own,
        start: Start::Listen,
        proof: Proof::RealBytes,
    };
    /// Camsense X2. No source tells its pace: it is taken as the X1's.
    pub const CAMSENSE_X2: Self = Self {
        name: "camsense-x2",
        family: Family::Camsense(Camsense::X2),
        proof: Proof::OneSource,
        ..Self::CAMSENSE_X1
    };
    /// LDS08RR: the Camsense frame with 16-bit quality. No source says that its angles are to be corrected.
    pub const CAMSENSE_LDS08RR: Self = Self {
        name: "lds08rr",
        family: Family::Camsense(Camsense::Uncorrected),
        ..Self::CAMSENSE_X1
    };
    /// Camsense T2, T200: time of flight. No source tells a pace that its line carries: it is taken as the X1's.
    pub const CAMSENSE_T2: Self = Self {
        name: "camsense-t2",
        family: Family::Camsense(Camsense::T2),
        max_range_mm: 12_000,
        proof: Proof::OneSource,
        ..Self::CAMSENSE_X1
    };
    /// "Mystery 360": a nameless time-of-flight sensor of 2024 with 16 points in a frame.
    pub const MYSTERY_360: Self = Self {
        name: "mystery-360",
        family: Family::Camsense(Camsense::Uncorrected),
        baud: 230_400,
        points_per_s: 3456,
        revolutions_per_10s: 60,
        beams_per_revolution: 640,
        max_range_mm: 12_000,
        ..Self::CAMSENSE_X1
    };
}

/// Most points of a frame.
pub const MAX_POINTS: usize = 40;
/// Bytes of the longest frame.
pub const FRAME: usize = 12 + 4 * MAX_POINTS;

/// Push parser. About 280 bytes.
pub type Parser = parser::Parser<Format, FRAME>;

impl Parser {
    /// Any of the family.
    #[must_use]
    pub const fn for_model(model: &Model) -> Self {
        let sensor = match model.family {
            Family::Camsense(sensor) => sensor,
            _ => Camsense::Uncorrected,
        };
        let format = Format {
            base: View::of(model, 0),
            sensor,
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
    sensor: Camsense,
    revolutions: Revolutions,
}

impl parser::Format for Format {
    type Packet = Packet;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        judge(bytes, self.sensor)
    }

    fn packet(&mut self, frame: &[u8], _: bool, pace: &mut Pace) -> Option<Packet> {
        let (&[_, _, kind, count, v0, v1, a0, a1], rest) = frame.split_first_chunk::<8>()?;
        let (points, &[b0, b1, _, _]) = rest.split_last_chunk::<4>()?;
        let first = angle([a0, a1], self.sensor)?;
        let span = angle([b0, b1], self.sensor)?.wrapping_sub(first);
        let step = divided(span, u32::from(count).saturating_sub(1));
        let fan = Fan::new(first, step, point_bytes(kind, self.sensor)?, points)?;
        let context = Context {
            base: self.base,
            revolutions: &mut self.revolutions,
            pace,
            bytes: frame.len() as u16,
        };
        Some(Packet {
            speed_rpm_q6: u16::from_le_bytes([v0, v1]),
            sensor: self.sensor,
            view: context.view(&fan, self.base.period_q8),
            fan,
        })
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8], sensor: Camsense) -> Verdict {
    match *bytes {
        [0x55] => Verdict::Need(2),
        [0x55, 0xaa] | [0x55, 0xaa, _] => Verdict::Need(4),
        [0x55, 0xaa, kind, count, ..] if (1..=MAX_POINTS as u8).contains(&count) => {
            let Some(point_bytes) = point_bytes(kind, sensor) else {
                return Verdict::No;
            };
            let length = 12 + usize::from(count) * usize::from(point_bytes);
            if length % 2 == 1 {
                return Verdict::No;
            }
            Verdict::on(bytes, length, |frame| {
                let angles_hold = matches!(
                    *frame,
                    [_, _, _, _, _, _, a0, a1, .., b0, b1, _, _]
                        if angle([a0, a1], sensor).is_some() && angle([b0, b1], sensor).is_some()
                );
                angles_hold && ends_in_fold(frame)
            })
        }
        _ => Verdict::No,
    }
}

/// Angle of a point; 2³² is a turn.
fn angle(word: [u8; 2], sensor: Camsense) -> Option<u32> {
    let word = u16::from_le_bytes(word);
    match sensor {
        Camsense::T2 => (word <= 36_000).then(|| from_cdeg(word.into())),
        _ => Some(from_deg_q6(word.checked_sub(0xa000)?.into())),
    }
}

/// Bytes of a point in frames of this kind; `None` for messages of the sensor.
const fn point_bytes(kind: u8, sensor: Camsense) -> Option<u8> {
    match (kind, sensor) {
        (2, _) => Some(2),
        (3 | 0x23, _) => Some(3),
        (7, _) => Some(4),
        (0..=0x7f, Camsense::T2) => Some(3),
        _ => None,
    }
}

/// Up to 40 points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed of the motor (rpm/64).
    pub speed_rpm_q6: u16,
    sensor: Camsense,
    view: View,
    fan: Fan<{ 4 * MAX_POINTS }>,
}

impl Packet {
    /// As sent.
    fn points(&self) -> impl Iterator<Item = Reading> + '_ {
        self.fan.readings(|point| match *point {
            [w0, w1] => (range([w0, w1]), 0),
            [w0, w1, quality] => (range([w0, w1]), quality.into()),
            [w0, w1, q0, q1] => (range([w0, w1]), u16::from_le_bytes([q0, q1])),
            _ => (Err(NoReturn::Nothing), 0),
        })
    }
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn speed_rpm(&self) -> Option<f32> {
        Some(f32::from(self.speed_rpm_q6) / 64.0)
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        let baseline = baseline_um(self.sensor);
        self.points().map(move |point| match point.range {
            Ok(quarters) if baseline != 0 => corrected(point, quarters, baseline),
            _ => point,
        })
    }

    fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        self.points().map(Sample::of)
    }
}

/// Distance between laser and receiver (µm), 0 where nothing is to be corrected.
const fn baseline_um(sensor: Camsense) -> i32 {
    match sensor {
        Camsense::X1 => 20_000,
        Camsense::X2 => 17_920,
        Camsense::Uncorrected | Camsense::T2 => 0,
    }
}

/// The point at `quarters` (mm/4) as seen from the middle of the sensor: its angle grows by `atan(baseline / distance)`.
fn corrected(point: Reading, quarters: u32, baseline_um: i32) -> Reading {
    // Both in µm, at most 17 m.
    let distance_um = quarters.min(68_000) as i32 * 250;
    let shift = u32::from(atan2_turn(baseline_um, distance_um)) << 16;
    let baseline_q2 = baseline_um.unsigned_abs() / 250;
    let square = quarters.saturating_mul(quarters) + baseline_q2 * baseline_q2;
    Reading {
        angle: point.angle.wrapping_add(shift),
        range: Ok(isqrt(square)),
        ..point
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::wire::packet::Packet as _;
    use crate::lidar::wire::protocol::Protocol as _;

    /// A frame of the "Mystery 360", as the revspace wiki's page MysteryLidar prints it.
    const MYSTERY: [u8; 60] = [
        0x55, 0xaa, 0x23, 0x10, 0xec, 0x59, 0xac, 0xf7, 0x7f, 0x40, 0xcd, 0x7f, 0x40, 0xcc, 0x7f,
        0x40, 0xcf, 0x7f, 0x40, 0xc6, 0x7f, 0x40, 0xbf, 0x7f, 0x40, 0xb4, 0x80, 0x40, 0xb9, 0x80,
        0x40, 0xba, 0x80, 0x40, 0xbc, 0x80, 0x40, 0xba, 0x80, 0x40, 0xb5, 0x80, 0x40, 0xd0, 0x81,
        0x40, 0xca, 0x81, 0x40, 0xc2, 0x82, 0x40, 0xc2, 0x82, 0x40, 0xc8, 0x0e, 0xa0, 0xcd, 0x2e,
    ];

    #[test]
    fn a_real_frame_of_the_mystery_360() {
        let mut parser = Parser::for_model(&Model::MYSTERY_360);
        let packet = MYSTERY.iter().find_map(|&byte| parser.push(byte));
        let packet = packet.expect("packet");
        // 6 Hz, 350.7° to 0.2°, 127 to 130 mm.
        assert_eq!(packet.speed_rpm().map(|rpm| rpm as u32), Some(359));
        assert_eq!(packet.samples().count(), 16);
        let mut samples = packet.samples();
        let (first, last) = (samples.next(), samples.last());
        let first = first.expect("first");
        assert!((first.angle_deg - 350.6875).abs() < 1e-3, "{first:?}");
        assert_eq!((first.range_mm, first.quality), (Some(127.0), 0xcd));
        assert!((last.expect("last").angle_deg - 0.21875).abs() < 1e-3);
        assert_eq!(packet.revolution_start(), Some(15));
    }

    #[test]
    fn the_correction_is_as_large_as_the_makers() {
        //   sensor        range mm   angle 0.01°  range mm/4
        for (sensor, mm, cdeg, quarters) in [
            (Camsense::X1, 200, 571, 803),
            (Camsense::X1, 1000, 115, 4000),
            (Camsense::X2, 500, 205, 2001),
        ] {
            let point = Reading {
                angle: 0,
                range: Ok(4 * mm),
                quality: 0,
            };
            let Reading { angle, range, .. } = corrected(point, 4 * mm, baseline_um(sensor));
            let found = (u64::from(angle) * 36_000) >> 32;
            assert!(found.abs_diff(cdeg) <= 1, "{sensor:?} {mm}: {found}");
            assert_eq!(range, Ok(quarters), "{sensor:?} {mm}");
        }
    }
}
