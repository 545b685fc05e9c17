//! The places hit by a scan's beams, in the frame of one moment.

use super::{deskew::Deskew, point::MAX_RANGE_MM};
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

    /// None again.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
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
            None => Some(ScanPoint::within(Bearing(bearing), range)),
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

/// A limit in whole millimetres, within what a point can hold.
fn millimetres(metres: f32) -> u16 {
    let mm = math::to_mm(metres);
    if mm > MAX_RANGE_MM { MAX_RANGE_MM } else { mm }
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
        // The last one is a robot's, but for what its turn makes of its speed.
        for (vx, omega) in [
            (0.0, f32::NAN),
            (0.0, f32::INFINITY),
            (0.0, 1e9),
            (64.0, 39.0),
        ] {
            let twist = Twist { vx, vy: 0.0, omega };
            points.assign(&scan, twist, &PointsConfig::DEFAULT);
            assert_eq!(
                (points.as_slice()[0].x, points.as_slice()[0].y),
                (1000, 0),
                "{omega}"
            );
        }
    }
}
