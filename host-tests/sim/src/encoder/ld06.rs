//! The LDROBOT 47-byte frame.

use std::f64::consts::TAU;

use beamfix::lidar::model::Parallax;
use beamfix::lidar::{Family, Model};

use super::{Echo, Encoder};

/// Points of a frame.
pub const POINTS: usize = 12;

/// What a frame says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Speed of the motor (deg/s).
    pub speed_deg_per_s: u16,
    /// Clockwise angle of the first point (0.01°).
    pub start_cdeg: u16,
    /// Clockwise angle of the last point (0.01°).
    pub end_cdeg: u16,
    /// Time stamp, 0…29 999 (ms).
    pub stamp_ms: u16,
    /// Range (mm, 0 for none) and intensity.
    pub points: [(u16, u8); POINTS],
}

impl Frame {
    /// The bytes on the wire.
    #[must_use]
    pub fn bytes(&self) -> [u8; 47] {
        let mut bytes = vec![0x54, 0x2c];
        bytes.extend(self.speed_deg_per_s.to_le_bytes());
        bytes.extend(self.start_cdeg.to_le_bytes());
        for (mm, intensity) in self.points {
            bytes.extend(mm.to_le_bytes());
            bytes.push(intensity);
        }
        bytes.extend(self.end_cdeg.to_le_bytes());
        bytes.extend(self.stamp_ms.to_le_bytes());
        bytes.push(crc8(&bytes));
        bytes.try_into().expect("47 bytes")
    }
}

/// CRC-8 with polynomial 0x4D, bit by bit.
#[must_use]
pub fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc: u8, _| {
            (crc << 1) ^ if crc & 0x80 != 0 { 0x4d } else { 0 }
        })
    })
}

/// A motor's speed comes back so often (s).
const SWAY_S: f64 = 2.7;

/// A sensor that turns steadily and measures steadily; its frames are not aligned to its turns.
#[derive(Debug, Clone)]
pub struct Sensor {
    points_per_s: f64,
    turns_per_s: f64,
    /// Where the first beam points, clockwise (turns).
    phase: f64,
    /// The motor is faster and slower by this share of its speed, and back every [`SWAY_S`].
    sway: f64,
    parallax: Parallax,
    /// Beams measured.
    count: u64,
    /// Distance of the last beam that had one, as sent (mm).
    last_mm: f64,
    points: Vec<(u16, u8)>,
}

impl Sensor {
    /// LD06: 4500 points and 10 turns a second.
    #[must_use]
    pub fn ld06() -> Self {
        Self::for_model(&Model::LDROBOT_LD06)
    }

    /// Any of the family.
    #[must_use]
    pub fn for_model(model: &Model) -> Self {
        Self {
            points_per_s: model.points_per_s.into(),
            turns_per_s: f64::from(model.revolutions_per_10s) / 10.0,
            phase: 0.123,
            sway: 0.0,
            parallax: match model.family {
                Family::Ldrobot(parallax) => parallax,
                _ => Parallax::None,
            },
            count: 0,
            last_mm: 1500.0,
            points: Vec::new(),
        }
    }

    /// By how much (turns, clockwise) a beam looks beside the angle that is sent for it.
    fn shift(&self) -> f64 {
        let d = self.last_mm;
        let angle = match self.parallax {
            Parallax::None => 0.0,
            Parallax::Ld14 => ((0.11923 * d - 18.975571) / (d + 5.9)).atan(),
            Parallax::Lds02 => ((0.11923 * d - 20.14) / (d + 5.9)).atan(),
        };
        -angle / TAU
    }

    /// Distance as sent (mm) for one from the sensor's middle.
    fn sent_mm(&self, range_mm: f64) -> f64 {
        if self.parallax != Parallax::Lds02 {
            return range_mm;
        }
        (0..20).fold(range_mm, |d, _| {
            let y = 0.11923 * d - 20.14;
            (range_mm * range_mm - y * y).max(0.0).sqrt() - 5.9
        })
    }

    fn time_s(&self, beam: u64) -> f64 {
        beam as f64 / self.points_per_s
    }

    /// Clockwise angle, in turns, within [0, 1).
    fn angle(&self, beam: u64) -> f64 {
        let time = self.time_s(beam);
        let ahead = match self.sway {
            0.0 => 0.0,
            sway => sway * SWAY_S / TAU * (1.0 - libm::cos(TAU * time / SWAY_S)),
        };
        (self.phase + self.turns_per_s * (time + ahead)).rem_euclid(1.0)
    }

    /// Turns a second when a beam is measured.
    fn speed(&self, beam: u64) -> f64 {
        let sway = self.sway * libm::sin(TAU * self.time_s(beam) / SWAY_S);
        self.turns_per_s * (1.0 + sway)
    }

    fn cdeg(&self, beam: u64) -> u16 {
        (self.angle(beam) * 36_000.0).round() as u16 % 36_000
    }
}

impl Encoder for Sensor {
    fn sway(&mut self, share: f64) -> bool {
        self.sway = share;
        true
    }

    fn next_time_us(&self) -> f64 {
        self.time_s(self.count) * 1e6
    }

    fn fire(&mut self, look: &mut dyn FnMut(f64, f64) -> Option<Echo>, line: &mut Vec<u8>) {
        let angle = self.angle(self.count) + self.shift();
        let echo = look(self.next_time_us(), -angle * TAU);
        let point = echo.map_or((0, 0), |echo| {
            let mm = self.sent_mm(echo.range_mm).round().clamp(0.0, 65_535.0);
            self.last_mm = mm;
            (mm as u16, echo.intensity)
        });
        self.points.push(point);
        self.count += 1;
        let Ok(points) = <[(u16, u8); POINTS]>::try_from(&self.points[..]) else {
            return;
        };
        self.points.clear();
        let first = self.count - POINTS as u64;
        let frame = Frame {
            speed_deg_per_s: (self.speed(first) * 360.0).round() as u16,
            start_cdeg: self.cdeg(first),
            end_cdeg: self.cdeg(self.count - 1),
            stamp_ms: ((self.time_s(first) * 1e3) as u64 % 30_000) as u16,
            points,
        };
        line.extend(frame.bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_whose_speed_sways_says_so_and_where_each_beam_looks() {
        let mut sensor = Sensor::ld06();
        assert!(sensor.sway(0.05));
        let (mut looked, mut speeds) = (Vec::new(), Vec::new());
        let mut line = Vec::new();
        while sensor.next_time_us() < 6e6 {
            let mut look = |time_us: f64, bearing: f64| {
                looked.push((time_us, -bearing / TAU));
                None
            };
            sensor.fire(&mut look, &mut line);
        }
        for (frame, beams) in line.chunks(47).zip(looked.chunks(POINTS)) {
            let word = |at: usize| u16::from_le_bytes([frame[at], frame[at + 1]]);
            speeds.push(word(2));
            for (at, beam) in [(4, beams[0]), (42, beams[POINTS - 1])] {
                let off = f64::from(word(at)) / 36_000.0 - beam.1;
                assert!((off - off.round()).abs() < 2e-5, "{off}");
            }
        }
        // 3600 deg/s, 5 % up and down; as far as the beams have turned in between.
        let (least, most) = (speeds.iter().min(), speeds.iter().max());
        assert_eq!((least, most), (Some(&3420), Some(&3780)));
        for pair in looked.windows(2) {
            let step = (pair[1].1 - pair[0].1).rem_euclid(1.0);
            let speed = step / ((pair[1].0 - pair[0].0) * 1e-6);
            assert!((9.49..10.51).contains(&speed), "{speed}");
        }
    }
}
