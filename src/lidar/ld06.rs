//! LDROBOT LD06 and its relatives: 47-byte frames of 12 beams at 230 400 baud.
//!
//! Source: LD06 development manual. The LD19, STL-06P, STL-19P, STL-26, STL-27L, LD14, LD14P and LDS-02 (LD08) speak
//! the same. The sensor sends as soon as it spins.
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0x54 0x2C` | sync; type and number of points |
//! | 2 | speed | deg/s, `u16` LE |
//! | 4 | angle of the first point | 0.01° clockwise, `u16` LE |
//! | 6 + 3k | range, intensity | mm, `u16` LE; `u8` |
//! | 42 | angle of the last point | 0.01° clockwise, `u16` LE |
//! | 44 | time stamp | ms, `u16` LE, wraps at 30 000 |
//! | 46 | CRC-8 of all before | polynomial 0x4D |

use crc::{Algorithm, Crc};

use super::{Counters, Framer, Protocol, Sample, Verdict};
use crate::scan::{Beam, Bearing, Range};

/// Bytes of a frame.
pub const FRAME: usize = 47;
/// Points of a frame.
pub const POINTS: usize = 12;

const STAMP_WRAP_MS: u16 = 30_000;
const CRC: Crc<u8> = Crc::<u8>::new(&Algorithm {
    width: 8,
    poly: 0x4d,
    init: 0,
    refin: false,
    refout: false,
    xorout: 0,
    check: 0x7f,
    residue: 0,
});

/// Check code of a frame's or a command's bytes.
#[must_use]
pub fn check_code(bytes: &[u8]) -> u8 {
    CRC.checksum(bytes)
}

/// Push parser of the 47-byte frame. About 130 bytes.
#[derive(Debug, Clone)]
pub struct Parser {
    framer: Framer<FRAME>,
    clock: Clock,
    /// Angle of the last point seen (0.01°).
    previous_cdeg: u16,
}

impl Parser {
    /// LD06, LD19, STL-06P: 4500 points per second.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_sample_rate(4500)
    }

    /// A relative with another number of points per second; 0 is taken as 1.
    ///
    /// STL-19P, STL-26: 5000. STL-27L: 21 600. LD14, LDS-02: 2300. LD14P: 4000.
    #[must_use]
    pub const fn with_sample_rate(points_per_s: u32) -> Self {
        Self {
            framer: Framer::new(),
            clock: Clock::new(points_per_s),
            previous_cdeg: 0,
        }
    }

    fn packet(frame: &[u8], clock: &mut Clock, previous_cdeg: &mut u16) -> Option<Packet> {
        let frame: &[u8; FRAME] = frame.try_into().ok()?;
        let &[_, _, v0, v1, a0, a1, ref points @ .., b0, b1, t0, t1, _] = frame;
        let start_cdeg = u16::from_le_bytes([a0, a1]) % 36_000;
        let end_cdeg = u16::from_le_bytes([b0, b1]) % 36_000;
        let stamp_ms = u16::from_le_bytes([t0, t1]);
        let mut packet = Packet {
            speed_deg_per_s: u16::from_le_bytes([v0, v1]),
            start_cdeg,
            end_cdeg,
            stamp_ms,
            time_us: clock.time_us(stamp_ms),
            period_q8: clock.period_q8,
            turn_start: None,
            points: *points,
        };
        packet.turn_start = packet.find_turn_start(*previous_cdeg);
        *previous_cdeg = end_cdeg;
        Some(packet)
    }
}

impl Default for Parser {
    fn default() -> Self {
        Self::new()
    }
}

impl Protocol for Parser {
    type Packet = Packet;

    fn push(&mut self, byte: u8) -> Option<Packet> {
        let frame = self.framer.push(byte, judge)?;
        let packet = Self::packet(frame, &mut self.clock, &mut self.previous_cdeg)?;
        self.framer.count_turns(packet.turn_start.is_some());
        Some(packet)
    }

    fn pull(&mut self) -> Option<Packet> {
        let frame = self.framer.pull(judge)?;
        let packet = Self::packet(frame, &mut self.clock, &mut self.previous_cdeg)?;
        self.framer.count_turns(packet.turn_start.is_some());
        Some(packet)
    }

    fn pending_bytes(&self) -> usize {
        self.framer.pending_bytes()
    }

    fn counters(&self) -> Counters {
        self.framer.counters()
    }
}

fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0x54] => Verdict::Need(2),
        [0x54, 0x2c, ..] => match bytes.get(..FRAME) {
            None => Verdict::Need(FRAME),
            // The code over a frame and its own code is 0.
            Some(frame) if check_code(frame) == 0 && is_plausible(frame) => Verdict::Frame(FRAME),
            Some(_) => Verdict::CheckFailed,
        },
        _ => Verdict::No,
    }
}

/// Whether the fields can be a sensor's: angles within a turn, the last at most 30° from the first, a stamp in range.
///
/// One of 256 damaged frames passes the CRC; this leaves one of some 10 000. The slowest relative, 2300 points a second,
/// would have to turn 16 times a second for 30°; the makers' tighter rule, by the reported speed, refuses the
/// manual's own example.
fn is_plausible(frame: &[u8]) -> bool {
    let &[_, _, _, _, a0, a1, .., b0, b1, t0, t1, _] = frame else {
        return false;
    };
    let start = u16::from_le_bytes([a0, a1]);
    let end = u16::from_le_bytes([b0, b1]);
    let stamp = u16::from_le_bytes([t0, t1]);
    start <= 36_000 && end <= 36_000 && span_cdeg(start, end) <= 3000 && stamp <= STAMP_WRAP_MS
}

/// Angle from the first to the last point, 0…36 000 (0.01°).
fn span_cdeg(start: u16, end: u16) -> u32 {
    let wrap = if end < start { 36_000 } else { 0 };
    (u32::from(end) + wrap).saturating_sub(u32::from(start))
}

/// The sensor's clock without its wraps, and finer than its milliseconds.
///
/// A stamp says which millisecond a frame's first beam was measured in, and the frames come at the steady pace of a
/// crystal: an alpha-beta filter (1/16, about 1/1365: critically damped) learns pace and phase. Times never go back.
#[derive(Debug, Clone)]
struct Clock {
    /// Time from beam to beam (µs/256).
    period_q8: u32,
    /// The same by the data sheet.
    nominal_q8: u32,
    stamp_ms: Option<u16>,
    /// Middle of the stamp's millisecond.
    stamp_us: u32,
    time_us: u32,
    fraction_q8: u32,
}

impl Clock {
    const fn new(points_per_s: u32) -> Self {
        let rate = if points_per_s < 100 {
            100
        } else {
            points_per_s
        };
        Self {
            period_q8: 256_000_000 / rate,
            nominal_q8: 256_000_000 / rate,
            stamp_ms: None,
            stamp_us: 0,
            time_us: 0,
            fraction_q8: 0,
        }
    }

    /// Time of the first beam of the frame that has this stamp.
    ///
    /// Of a gap longer than 30 s only the remainder is seen.
    fn time_us(&mut self, stamp_ms: u16) -> u32 {
        /// Stamp and pace differ by more only where frames are missing (µs).
        const GAP: i32 = 1500;

        let Some(previous) = self.stamp_ms.replace(stamp_ms) else {
            self.stamp_us = u32::from(stamp_ms) * 1000 + 500;
            self.time_us = self.stamp_us;
            return self.time_us;
        };
        let wrap = if stamp_ms < previous {
            STAMP_WRAP_MS
        } else {
            0
        };
        let elapsed_ms = (u32::from(stamp_ms) + u32::from(wrap)).saturating_sub(previous.into());
        self.stamp_us = self.stamp_us.wrapping_add(elapsed_ms * 1000);

        let steady_q8 = self.fraction_q8 + POINTS as u32 * self.period_q8;
        self.fraction_q8 = steady_q8 & 0xff;
        let steady_us = self.time_us.wrapping_add(steady_q8 >> 8);
        let late = self.stamp_us.wrapping_sub(steady_us) as i32;
        if late > GAP {
            self.time_us = self.stamp_us;
            return self.time_us;
        }
        let late = late.max(-GAP);
        let quarter = self.nominal_q8 / 4;
        self.period_q8 = self
            .period_q8
            .saturating_add_signed(late >> 6)
            // Not `clamp`, which panics where its limits are the wrong way round.
            .max(self.nominal_q8 - quarter)
            .min(self.nominal_q8 + quarter);
        // Half a beam at most: the first beam of a frame stays behind the last of the one before.
        let back = -((self.period_q8 >> 9) as i32);
        self.time_us = steady_us.wrapping_add_signed((late >> 4).max(back));
        self.time_us
    }
}

/// Twelve points of an LDROBOT sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// Speed of the motor (deg/s).
    pub speed_deg_per_s: u16,
    /// Angle of the first point, clockwise from the front mark, 0…35 999 (0.01°).
    pub start_cdeg: u16,
    /// Angle of the last point (0.01°).
    pub end_cdeg: u16,
    /// The sensor's clock at the first point, 0…29 999 (ms).
    pub stamp_ms: u16,
    /// The same without its wraps, and finer: time of the first point (µs, wrapping at 2³²).
    pub time_us: u32,
    period_q8: u32,
    turn_start: Option<u8>,
    points: [u8; 3 * POINTS],
}

impl Packet {
    fn span_cdeg(&self) -> u32 {
        span_cdeg(self.start_cdeg, self.end_cdeg)
    }

    /// Number of the point at which the angle falls from nearly a turn to nearly nothing.
    fn find_turn_start(&self, previous_cdeg: u16) -> Option<u8> {
        if previous_cdeg > self.start_cdeg && previous_cdeg - self.start_cdeg > 18_000 {
            return Some(0);
        }
        if self.end_cdeg >= self.start_cdeg {
            return None;
        }
        let to_turn = 11 * (36_000 - u32::from(self.start_cdeg));
        let span = self.span_cdeg();
        (1..POINTS as u8).find(|&k| u32::from(k) * span >= to_turn)
    }

    fn points(&self) -> impl ExactSizeIterator<Item = (u16, u8)> + '_ {
        self.points.chunks_exact(3).map(|point| match *point {
            [low, high, intensity] => (u16::from_le_bytes([low, high]), intensity),
            _ => (0, 0),
        })
    }
}

impl super::Packet for Packet {
    fn beams(&self) -> impl Iterator<Item = Beam> + '_ {
        // A turn is 2³² here, so that an angle is a product, a step a sum, and wrapping comes by itself.
        const TURN_PER_CDEG: u32 = 119_305;
        let mut clockwise = u32::from(self.start_cdeg).wrapping_mul(TURN_PER_CDEG);
        let step = self.span_cdeg() * TURN_PER_CDEG / 11;
        let mut age_q8 = 0u32;
        self.points().map(move |(mm, intensity)| {
            let beam = Beam {
                bearing: Bearing((clockwise.wrapping_neg().wrapping_add(0x8000) >> 16) as u16),
                range: Range::from_mm(u32::from(mm)),
                time_us: self.time_us.wrapping_add(age_q8 >> 8),
                quality: intensity,
            };
            clockwise = clockwise.wrapping_add(step);
            age_q8 = age_q8.wrapping_add(self.period_q8);
            beam
        })
    }

    fn samples(&self) -> impl Iterator<Item = Sample> + '_ {
        let start = 11 * u32::from(self.start_cdeg);
        let span = self.span_cdeg();
        self.points().zip(0..).map(move |((mm, intensity), k)| {
            let angle = (start + k * span) % (11 * 36_000);
            Sample {
                angle_deg: angle as f32 / 1100.0,
                range_mm: (mm != 0).then_some(f32::from(mm)),
                quality: u16::from(intensity),
            }
        })
    }

    fn turn_start(&self) -> Option<usize> {
        self.turn_start.map(usize::from)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::lidar::Packet as _;

    /// The example frame of the LD06 manual.
    pub(in crate::lidar) const MANUAL: [u8; FRAME] = [
        0x54, 0x2c, 0x68, 0x08, 0xab, 0x7e, 0xe0, 0x00, 0xe4, 0xdc, 0x00, 0xe2, 0xd9, 0x00, 0xe5,
        0xd5, 0x00, 0xe3, 0xd3, 0x00, 0xe4, 0xd0, 0x00, 0xe9, 0xcd, 0x00, 0xe4, 0xca, 0x00, 0xe2,
        0xc7, 0x00, 0xe9, 0xc5, 0x00, 0xe5, 0xc2, 0x00, 0xe5, 0xc0, 0x00, 0xe5, 0xbe, 0x82, 0x3a,
        0x1a, 0x50,
    ];

    fn parse(parser: &mut Parser, bytes: &[u8]) -> Option<Packet> {
        bytes.iter().filter_map(|&byte| parser.push(byte)).last()
    }

    #[test]
    fn the_manuals_frame() {
        let packet = parse(&mut Parser::new(), &MANUAL).expect("packet");
        assert_eq!(packet.speed_deg_per_s, 2152);
        assert_eq!((packet.start_cdeg, packet.end_cdeg), (32_427, 33_470));
        assert_eq!(packet.stamp_ms, 6714);
        let first = packet.beams().next().expect("beam");
        let last = packet.beams().last().expect("beam");
        assert_eq!(first.bearing, Bearing::from_clockwise_cdeg(32_427));
        assert_eq!(last.bearing, Bearing::from_clockwise_cdeg(33_470));
        assert_eq!((first.range.mm(), first.quality), (Ok(224), 0xe4));
        assert_eq!(last.time_us - first.time_us, 11 * 1_000_000 / 4500);
        assert_eq!(packet.turn_start(), None);
    }

    #[test]
    fn a_damaged_frame_does_not_cost_the_next() {
        let mut parser = Parser::new();
        assert!(parse(&mut parser, &MANUAL[..30]).is_none());
        assert!(parse(&mut parser, &MANUAL).is_some());
        let counters = parser.counters();
        assert_eq!((counters.packets, counters.check_errors), (1, 1));
        assert_eq!((counters.skipped_bytes, parser.pending_bytes()), (30, 0));
    }

    #[test]
    fn bearings_agree_with_samples_around_the_whole_turn() {
        for start_cdeg in (0..36_000).step_by(7) {
            let end_cdeg = (start_cdeg + 881) % 36_000;
            let packet = Packet {
                speed_deg_per_s: 3600,
                start_cdeg,
                end_cdeg,
                stamp_ms: 0,
                time_us: 0,
                period_q8: 0,
                turn_start: None,
                points: [0; 36],
            };
            for (beam, sample) in packet.beams().zip(packet.samples()) {
                let native = 360.0 - f32::from(beam.bearing.0) * (360.0 / 65536.0);
                let off = (native - sample.angle_deg + 540.0) % 360.0 - 180.0;
                // Half a unit of bearing, 0.0028°, and what a turn of 36 000 · 119 305 is longer than 2³².
                assert!(off.abs() < 0.004, "{start_cdeg}: {beam:?} {sample:?}");
            }
        }
    }

    #[test]
    fn time_goes_on_over_the_stamps_wrap_and_through_gaps() {
        // Sensors that are faster and slower than their data sheet; ten frames are missing in the middle.
        for frame_us in [2666.67, 2600.0, 2410.0, 2800.0] {
            let mut clock = Clock::new(4500);
            let mut last = 0u32;
            for k in (0..2000u32).chain(2010..40_000) {
                let truth_us = 29_000_000 + (f64::from(k) * frame_us) as u32;
                let time = clock.time_us((truth_us / 1000 % 30_000) as u16);
                let off = time.abs_diff(truth_us);
                let allowed = if k < 1500 { 20_000 } else { 800 };
                assert!(off < allowed, "{frame_us} {k}: {time} {truth_us}");
                let beams_us = 11 * clock.period_q8 / 256;
                assert!(k == 0 || time > last + beams_us, "{frame_us} {k}");
                last = time;
            }
            // Without gaps the milliseconds average out.
            assert!(last.abs_diff(29_000_000 + (39_999.0 * frame_us) as u32) < 150);
        }
    }
}
