//! The places hit by a scan's beams, in the frame of one moment.

use crate::{
    config::{self, ConfigError},
    geometry::Twist,
    math,
    scan::{Bearing, Mount, Scan, ScanPoint, Stored, surface::across_mm},
};

/// What [`Points::assign`] takes and leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointsConfig {
    /// How the lidar sits on the robot. Default [`Mount::DEFAULT`]: at its centre, upright, looking forward.
    pub mount: Mount,
    /// Shorter ranges are left out (m). Default 0.05: a cover, the robot's own body.
    pub min_range: f32,
    /// Longer ranges are left out (m), at most 32.0. Default 32.0.
    pub max_range: f32,
    /// Scans of more beams are thinned to about so many points by averaging neighbours on one surface: nothing of what
    /// they know is lost, and everything after costs as much less. Default `u16::MAX`: every beam is a point.
    pub max_points: u16,
}

impl PointsConfig {
    /// Everything that a point can hold, seen by an upright lidar at the robot's centre.
    pub const DEFAULT: Self = Self {
        mount: Mount::DEFAULT,
        min_range: 0.05,
        max_range: 32.0,
        max_points: u16::MAX,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("min_range", self.min_range, 0.0, 32.0),
            config::within("max_range", self.max_range, self.min_range, 32.0),
            config::within("max_points", self.max_points as f32, 1.0, 65535.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for PointsConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The valid beams of a scan as places in the lidar's frame at the scan's end, in the order of measurement.
///
/// 8·N + 8 bytes. Millimetres in 16 bits reach ±32.767 m; farther returns are left out.
#[derive(Debug, Clone)]
pub struct Points<const N: usize> {
    points: heapless::Vec<ScanPoint, N>,
}

impl<const N: usize> Points<N> {
    /// Longest range that is taken (mm).
    pub(crate) const MAX_RANGE_MM: u16 = MAX_RANGE_MM;

    /// No points.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            points: heapless::Vec::new(),
        }
    }

    /// The points in the order of measurement.
    #[must_use]
    pub fn as_slice(&self) -> &[ScanPoint] {
        &self.points
    }

    /// The points, to be moved.
    pub(crate) fn as_mut_slice(&mut self) -> &mut [ScanPoint] {
        &mut self.points
    }

    /// Keeps the points for which `keep` is true.
    pub(crate) fn retain(&mut self, keep: impl FnMut(&ScanPoint) -> bool) {
        self.points.retain(keep);
    }

    /// Places hit by `scan`, as seen by the lidar at the scan's last beam if the robot moves with `twist`.
    ///
    /// Beams without a return or outside the configured ranges are left out. A scan taken in motion costs more: each beam
    /// is turned and moved.
    pub fn assign(&mut self, scan: &Scan<N>, twist: Twist, config: &PointsConfig) {
        self.points.clear();
        let least = millimetres(config.min_range).max(1);
        let mut sweep = Sweep {
            least,
            span: millimetres(config.max_range).saturating_sub(least),
            flip: if config.mount.upside_down { 0xffff } else { 0 },
            last: scan.last_age(),
            deskew: Deskew::new(config.mount.lidar_twist(twist), scan.duration()),
        };
        let most = scan.len().div_ceil(usize::from(config.max_points.max(1)));
        for beams in scan.stored().chunks(most.clamp(1, MERGE_MOST)) {
            if let Some(mean) = sweep.mean(beams) {
                sweep.place(mean, &mut self.points);
                continue;
            }
            for beam in beams {
                if let Some(range) = beam.range.within(sweep.least, sweep.span) {
                    sweep.place((beam.bearing.0, range, beam.age), &mut self.points);
                }
            }
        }
    }
}

/// Neighbours are averaged if their ranges differ by less than this (mm) and twice their distance across the beams:
/// not over an edge, and not where a wall is grazed and the mean of two ranges would lie off it.
const MERGE_MM: u32 = 20;
/// Most beams in a point.
const MERGE_MOST: usize = 4;

/// What turns the beams of one scan into points.
struct Sweep {
    /// Shortest range, and how much longer the longest is (mm).
    least: u16,
    span: u16,
    /// All bits set where bearings run the other way round.
    flip: u16,
    /// Age of the scan's last beam (16 µs).
    last: u16,
    deskew: Option<Deskew>,
}

impl Sweep {
    /// Bearing, range and age of the mean of neighbouring beams; `None` unless there are several that all have a range
    /// and lie on one surface.
    #[inline]
    fn mean(&self, beams: &[Stored]) -> Option<(u16, u16, u16)> {
        /// 1/n in Q14.
        const SHARE: [u32; MERGE_MOST + 1] = [0, 16384, 8192, 5461, 4096];
        let [first, .., last] = beams else {
            return None;
        };
        let mut before = first.range.within(self.least, self.span)?;
        let mut sum = 0;
        let mut most = 0;
        for beam in beams {
            let range = beam.range.within(self.least, self.span)?;
            most = most.max(before.abs_diff(range));
            sum += u32::from(range);
            before = range;
        }
        let turn = last.bearing.0.wrapping_sub(first.bearing.0) as i16;
        let (steep, wide) = (u32::from(most) > MERGE_MM, u32::from(turn.unsigned_abs()));
        if steep || wide > 2000 {
            // The beams are that much apart in all. (Not `Gap`: it is the mean step that counts here, of up to four.)
            let across = across_mm(before, wide.min(2000) as u16);
            let steps = beams.len() as u32 - 1;
            if wide > 2000 || (u32::from(most) - MERGE_MM.min(u32::from(most))) * steps > 2 * across
            {
                return None;
            }
        }
        let share = SHARE.get(beams.len()).copied().unwrap_or(0);
        Some((
            first.bearing.0.wrapping_add((turn >> 1) as u16),
            ((sum * share + (1 << 13)) >> 14) as u16,
            first.age.midpoint(last.age),
        ))
    }

    #[inline]
    fn place<const N: usize>(
        &mut self,
        (bearing, range, age): (u16, u16, u16),
        points: &mut heapless::Vec<ScanPoint, N>,
    ) {
        // In two's complement the negative is all bits flipped, and one more.
        let bearing = (bearing ^ self.flip).wrapping_add(self.flip & 1);
        let moved = match &mut self.deskew {
            Some(deskew) => deskew.apply(bearing, range, self.last.saturating_sub(age)),
            None => Some(ScanPoint::at(Bearing(bearing), range)),
        };
        if let Some(point) = moved {
            // As many points as beams at most: it fits.
            let _ = points.push(point);
        }
    }
}

impl<const N: usize> Default for Points<N> {
    fn default() -> Self {
        Self::new()
    }
}

const MAX_RANGE_MM: u16 = 32_000;

/// A limit in whole millimetres, within what a point can hold.
fn millimetres(metres: f32) -> u16 {
    let mm = math::to_mm(metres);
    if mm > MAX_RANGE_MM { MAX_RANGE_MM } else { mm }
}

/// Motion of the lidar during the sweep, undone beam by beam.
struct Deskew {
    /// Turn per 2¹⁶ µs (2⁻³² turn).
    turn: i32,
    /// Translation per 2¹⁶ µs, in the frame at the scan's end (1/1024 mm).
    x: i32,
    y: i32,
    /// The one that the last beam was in: beams mostly come in the order of their times.
    stretch: Stretch,
}

/// Log2 of the length of a [`Stretch`] (16 µs): 8 ms, in which the fastest robot turns by 19°.
const STRETCH_BITS: u32 = 9;

/// A part of the sweep over which the lidar is taken to have moved straight and evenly.
#[derive(Clone, Copy)]
struct Stretch {
    /// How many lie between it and the scan's end.
    number: u32,
    /// Where it ends, and how much there is from there to where it begins.
    end: Place,
    more: Place,
}

/// Where the lidar was, seen from the scan's end.
#[derive(Clone, Copy)]
struct Place {
    /// 2⁻³² turn.
    turn: i32,
    /// 1/1024 mm.
    x: i32,
    y: i32,
}

impl Deskew {
    /// `None` where the motion over the sweep is too small to matter (0.1 mm, 0.001°), or faster than any robot (40 rad/s, 100 m/s).
    fn new(twist: Twist, duration: f32) -> Option<Self> {
        const TICK: f32 = 0.065_536;
        let motion = twist.displacement(duration);
        let still = motion.distance() < 1e-4 && math::abs(motion.theta) < 2e-5;
        let speed = math::abs(twist.vx) + math::abs(twist.vy);
        // The negated form refuses NaN too.
        if still || !(math::abs(twist.omega) < 40.0 && speed < 100.0) {
            return None;
        }
        let none = Place {
            turn: 0,
            x: 0,
            y: 0,
        };
        Some(Self {
            turn: math::round_to_i32(
                twist.omega * TICK * (4_294_967_296.0 / core::f32::consts::TAU),
            ),
            x: math::round_to_i32(twist.vx * TICK * 1_024_000.0),
            y: math::round_to_i32(twist.vy * TICK * 1_024_000.0),
            stretch: Stretch {
                number: u32::MAX,
                end: none,
                more: none,
            },
        })
    }

    /// Where the lidar was `age` (16 µs) before the scan's end. To second order the translation of an arc is that of the
    /// chord at half its turn.
    fn place(&self, age: u32) -> Place {
        let times = |per_tick: i32| -((i64::from(per_tick) * i64::from(age)) >> 12);
        let turn = times(self.turn);
        let (s, c) = math::sin_cos_q15((turn >> 17) as u16);
        let (s, c) = (i64::from(s), i64::from(c));
        let (x, y) = (times(self.x), times(self.y));
        Place {
            turn: turn as i32,
            x: ((x * c - y * s) >> 15) as i32,
            y: ((x * s + y * c) >> 15) as i32,
        }
    }

    /// Apart, so that the loop over the beams keeps its registers.
    #[cold]
    #[inline(never)]
    fn enter(&mut self, number: u32) {
        let end = self.place(number << STRETCH_BITS);
        let start = self.place((number + 1) << STRETCH_BITS);
        self.stretch = Stretch {
            number,
            end,
            more: Place {
                turn: start.turn.wrapping_sub(end.turn),
                x: start.x.wrapping_sub(end.x),
                y: start.y.wrapping_sub(end.y),
            },
        };
    }

    /// The place that a beam hit `age` (16 µs) before the scan's end, as seen from there; `None` where it leaves the
    /// numbers' range.
    fn apply(&mut self, bearing: u16, range: u16, age: u16) -> Option<ScanPoint> {
        let number = u32::from(age) >> STRETCH_BITS;
        if number != self.stretch.number {
            self.enter(number);
        }
        let Stretch { end, more, .. } = self.stretch;
        let part = i32::from(age) & ((1 << STRETCH_BITS) - 1);
        // In 8 ms a robot moves less than a metre and turns less than a sixth: these stay in 32 bits.
        let turn = end.turn.wrapping_add((more.turn >> STRETCH_BITS) * part);
        let x = end.x + ((more.x * part) >> STRETCH_BITS);
        let y = end.y + ((more.y * part) >> STRETCH_BITS);
        let bearing = bearing.wrapping_add((turn.wrapping_add(1 << 15) >> 16) as u16);
        let (s, c) = math::sin_cos_q15(bearing);
        let r = i32::from(range);
        let (px, py) = (((r * c) >> 5) + x, ((r * s) >> 5) + y);
        let (px, py) = ((px + 512) >> 10, (py + 512) >> 10);
        // The translation along the beam and across it (1/64 mm).
        let (tx, ty) = (x >> 4, y >> 4);
        let (far_x, far_y) = (tx + (1 << 15), ty + (1 << 15));
        if (far_x | far_y) as u32 >> 16 != 0 {
            return seen(px, py);
        }
        let along = (tx * c + ty * s) >> 15;
        let across = (ty * c - tx * s) >> 15;
        let distance = (r << 6) + along;
        if distance < 1 << 13 || across.abs() > distance >> 4 {
            return seen(px, py);
        }
        // A small angle is its own tangent (2⁻¹⁸ rad here); the distance grows by half of its square.
        let angle = (across * math::reciprocal(distance as u32 >> 6) as i32) >> 12;
        let range = (distance + ((across * angle) >> 19) + 32) >> 6;
        if range > i32::from(MAX_RANGE_MM) {
            return None;
        }
        Some(ScanPoint {
            x: px as i16,
            y: py as i16,
            // 2¹⁶/2π units in a radian, 1/64 mm, and the reciprocal's 2²⁴.
            bearing: Bearing(bearing.wrapping_add(((angle * 163 + (1 << 11)) >> 12) as u16)),
            range: range as u16,
        })
    }
}

/// The point at a place (mm); `None` where it is too far away.
// Seldom needed: beside the lidar, or where it moves half a metre in a revolution.
#[cold]
#[inline(never)]
fn seen(x: i32, y: i32) -> Option<ScanPoint> {
    let limit = i32::from(MAX_RANGE_MM);
    if !(-limit..=limit).contains(&x) || !(-limit..=limit).contains(&y) {
        return None;
    }
    let range = math::isqrt((x * x + y * y) as u32);
    (range <= u32::from(MAX_RANGE_MM)).then_some(ScanPoint {
        x: x as i16,
        y: y as i16,
        bearing: Bearing(math::atan2_turn(y, x)),
        range: range as u16,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Beam, Range};

    fn scan(beams: &[(f32, f32, u32)]) -> Scan<8> {
        let mut scan = Scan::new();
        for &(degrees, metres, time_us) in beams {
            let beam = Beam {
                bearing: Bearing::from_radians(degrees.to_radians()),
                range: Range::from_metres(metres),
                time_us,
                quality: 0,
            };
            scan.push(beam).expect("room");
        }
        scan
    }

    #[test]
    fn valid_beams_become_points() {
        let mut points = Points::<8>::new();
        let scan = scan(&[
            (0.0, 1.0, 0),
            (90.0, 2.0, 0),
            (10.0, 0.0, 0),
            (20.0, 0.01, 0),
            (180.0, 40.0, 0),
            (-90.0, 32.0, 0),
        ]);
        points.assign(&scan, Twist::ZERO, &PointsConfig::DEFAULT);
        let places: heapless::Vec<(i16, i16), 8> =
            points.as_slice().iter().map(|p| (p.x, p.y)).collect();
        assert_eq!(places.as_slice(), [(1000, 0), (0, 2000), (0, -31_999)]);
        points.assign(
            &scan,
            Twist::ZERO,
            &PointsConfig {
                mount: Mount {
                    upside_down: true,
                    ..Mount::DEFAULT
                },
                ..PointsConfig::DEFAULT
            },
        );
        assert_eq!((points.as_slice()[1].x, points.as_slice()[1].y), (0, -2000));
    }

    #[test]
    fn deskew_undoes_the_motion_during_the_sweep() {
        // A lidar that turns and drives looks at one and the same place at different times.
        let place = crate::geometry::Point::new(3.0, 1.0);
        for twist in [
            Twist {
                vx: 1.0,
                vy: -0.2,
                omega: 2.0,
            },
            Twist {
                vx: 0.0,
                vy: 0.0,
                omega: -3.0,
            },
            Twist {
                vx: -0.5,
                vy: 0.0,
                omega: 0.0,
            },
        ] {
            let mut swept = Scan::<8>::new();
            for k in 0..8u32 {
                let time_us = 25_000 * k;
                let seen = twist.displacement(time_us as f32 * 1e-6).inverse() * place;
                let beam = Beam {
                    bearing: Bearing::from_radians(math::atan2(seen.y, seen.x)),
                    range: Range::from_metres(seen.norm()),
                    time_us: time_us.wrapping_sub(100_000),
                    quality: 0,
                };
                swept.push(beam).expect("room");
            }
            let mut points = Points::<8>::new();
            points.assign(&swept, twist, &PointsConfig::DEFAULT);
            let expected = twist.displacement(0.175).inverse() * place;
            for p in points.as_slice() {
                let (dx, dy) = (
                    f32::from(p.x) - 1e3 * expected.x,
                    f32::from(p.y) - 1e3 * expected.y,
                );
                assert!(
                    dx.abs() < 2.0 && dy.abs() < 2.0,
                    "{twist:?}: off by ({dx}, {dy}) mm"
                );
                // In polar form it is the same place.
                let polar = ScanPoint::at(p.bearing, p.range);
                let (dx, dy) = (p.x.abs_diff(polar.x), p.y.abs_diff(polar.y));
                assert!(dx < 2 && dy < 2, "{twist:?}: {p:?}, {polar:?}");
            }
        }
    }

    #[test]
    fn an_impossible_twist_is_ignored() {
        let mut points = Points::<8>::new();
        let scan = scan(&[(0.0, 1.0, 0), (90.0, 2.0, 100_000)]);
        for omega in [f32::NAN, f32::INFINITY, 1e9] {
            points.assign(
                &scan,
                Twist {
                    vx: 0.0,
                    vy: 0.0,
                    omega,
                },
                &PointsConfig::DEFAULT,
            );
            assert_eq!(
                (points.as_slice()[0].x, points.as_slice()[0].y),
                (1000, 0),
                "{omega}"
            );
        }
    }
}
