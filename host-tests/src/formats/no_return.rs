//! Which readings of a recording are no returns: one rule for every format.
//!
//! "Nothing came back" is written as 0, not a number, infinity, the sensor's longest range, a value just below it, or a
//! fixed large value that the file does not name. "Too near" is written as minus infinity (REP 117) or as a reading
//! below the shortest range.

use beamfix::scan::{NoReturn, Range};

/// Shortest and longest range (m) as a file states them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    nearest: f32,
    farthest: f32,
}

impl Limits {
    /// No limits are stated.
    pub const NONE: Self = Self {
        nearest: 0.0,
        farthest: f32::INFINITY,
    };

    /// The limits that a file states; one that cannot be (not a number, negative, a longest range that is not above
    /// the shortest) counts as not stated.
    #[must_use]
    pub fn stated(nearest: f32, farthest: f32) -> Self {
        let nearest = if nearest.is_finite() && nearest > 0.0 {
            nearest
        } else {
            0.0
        };
        Self {
            nearest,
            farthest: if farthest > nearest {
                farthest
            } else {
                f32::INFINITY
            },
        }
    }

    /// Whether `farthest` (m), as a file states it, cannot be a longest range beside `nearest`.
    #[must_use]
    pub fn is_impossible(nearest: f32, farthest: f32) -> bool {
        !(farthest > 0.0 && (farthest > nearest || nearest.is_nan()))
    }
}

/// How far below a limit (m) a reading still means the limit: drivers round it, convert its unit, or subtract a little.
fn margin(limit: f32) -> f32 {
    0.01 + 0.001 * limit
}

/// No lidar that such files come from measures farther (m): larger readings are a way to say "no return". SICK's LMS
/// says it by 51.2 to 81.91 m.
const FARTHEST_MEASURED: f32 = 49.0;

/// What a recording's readings say about its sensor's way to write "no return".
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// Readings from here on (m) are no returns, whatever limit the file states.
    plateau: f32,
}

impl Rule {
    /// The rule for one scan whose recording is not known: the stated limits alone.
    pub const LIMITS: Self = Self {
        plateau: f32::INFINITY,
    };

    /// Finds the plateau: one largest value that many beams of many scans share, and that stands above all others.
    #[must_use]
    pub fn of<'a>(scans: impl Iterator<Item = (&'a [f32], Limits)> + Clone) -> Self {
        let below_limit = |limits: Limits| {
            let end = Self::LIMITS.no_return_from(limits);
            move |reading: &f32| reading.is_finite() && *reading > limits.nearest && *reading < end
        };
        let largest = scans
            .clone()
            .flat_map(|(readings, limits)| readings.iter().copied().filter(below_limit(limits)))
            .fold(0.0f32, |a, b| if b > a { b } else { a });
        if largest >= FARTHEST_MEASURED {
            return Self {
                plateau: largest - margin(largest),
            };
        }
        let from = largest - margin(largest);
        // A wall that the farthest beams end on is seen at all distances: as many readings lie just below as at it.
        let near = largest - 6.0 * margin(largest);
        let [mut scans_at, mut all_scans] = [0usize; 2];
        let [mut at, mut below, mut all] = [0usize; 3];
        for (readings, limits) in scans {
            let at_before = at;
            for reading in readings.iter().filter(|r| below_limit(limits)(r)) {
                at += usize::from(*reading >= from);
                below += usize::from(*reading >= near && *reading < from);
            }
            all += readings.len();
            // A farthest corner is met by a beam or two, and by a few more where the robot stands before it.
            scans_at += usize::from(at - at_before >= 3);
            all_scans += 1;
        }
        let is_plateau =
            at * 50 >= all && scans_at * 10 >= all_scans && scans_at >= 2 && at > 3 * below;
        Self {
            plateau: if is_plateau { from } else { f32::INFINITY },
        }
    }

    /// The plateau's value (m), if there is one.
    #[must_use]
    pub fn plateau(&self) -> Option<f32> {
        self.plateau.is_finite().then_some(self.plateau)
    }

    fn no_return_from(self, limits: Limits) -> f32 {
        let end = limits.farthest - margin(limits.farthest);
        if end < self.plateau {
            end
        } else {
            self.plateau
        }
    }

    /// The range that `reading` (m) stands for.
    #[must_use]
    pub fn range(self, reading: f32, limits: Limits) -> Range {
        if reading == f32::NEG_INFINITY || (reading > 0.0 && reading < limits.nearest) {
            Range::none(NoReturn::TooNear)
        } else if reading >= self.no_return_from(limits) {
            Range::none(NoReturn::TooFar)
        } else {
            Range::from_metres(reading)
        }
    }
}

/// Readings of a scan that are neither ranges nor a known way to say why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Odd {
    /// Not a number, or negative.
    pub bad: usize,
    /// Minus infinity: too near (REP 117).
    pub too_near: usize,
}

impl Odd {
    /// Counts those of one scan.
    pub fn count(&mut self, readings: &[f32]) {
        for reading in readings {
            let is_too_near = *reading == f32::NEG_INFINITY;
            self.too_near += usize::from(is_too_near);
            self.bad += usize::from(!is_too_near && (reading.is_nan() || *reading < 0.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seven beams of a wall 3 to 6 m away, seen a little differently each time, and seven of `far`.
    fn hall(far: impl Fn(usize) -> f32) -> Vec<Vec<f32>> {
        let scan = |k: usize| {
            let wall = (0..7).map(move |n| 3.0 + 0.43 * n as f32 + 0.013 * k as f32);
            wall.chain((0..7).map(|n| far(7 * k + n))).collect()
        };
        (0..20).map(scan).collect()
    }

    fn rule(scans: &[Vec<f32>], limits: Limits) -> Rule {
        Rule::of(scans.iter().map(|scan| (&scan[..], limits)))
    }

    #[test]
    fn every_way_to_write_no_return_is_found() {
        //   what is written                       limits that the file states
        for (name, far, nearest, farthest) in [
            ("the limit", 8.0, 0.1, 8.0),
            ("just below it", 7.999, 0.1, 8.0),
            ("8.19 m of an LMS, no limit", 8.19, f32::NAN, f32::NAN),
            ("5.6 m, a limit of 0", 5.6 + 1.0, 0.1, 0.0),
            ("a limit that is larger", 8.0, 0.1, 30.0),
            ("81.91 m", 81.91, 0.0, f32::INFINITY),
            ("infinity", f32::INFINITY, 0.1, 8.0),
            ("0", 0.0, 0.1, 8.0),
            ("not a number", f32::NAN, 0.1, 8.0),
        ] {
            let limits = Limits::stated(nearest, farthest);
            let scans = hall(|_| far);
            let rule = rule(&scans, limits);
            for (k, reading) in scans.iter().flatten().enumerate() {
                let is_range = rule.range(*reading, limits).is_some();
                assert_eq!(is_range, k % 14 < 7, "{name}: {reading}");
            }
        }
        let near = Rule::LIMITS.range(f32::NEG_INFINITY, Limits::NONE);
        assert_eq!(near.mm(), Err(NoReturn::TooNear));
    }

    #[test]
    fn far_walls_and_corners_stay() {
        //   what is seen at the far end                                        its largest value
        let scenes: [(&str, &dyn Fn(usize) -> f32); 3] = [
            ("a slanted wall", &|k| 7.0 + 0.01 * (k % 97) as f32),
            // Beams of a degree on a wall across, from the middle outwards, over noise of a centimetre.
            ("a wall across", &|k| {
                let bearing = ((k % 7) as f32 - 3.0).to_radians();
                7.0 / libm::cosf(bearing) + 0.01 * libm::roundf(libm::sinf(k as f32 * 1.7) * 2.0)
            }),
            ("one corner", &|k| {
                if k % 7 == 3 {
                    8.0
                } else {
                    6.5 - 0.1 * (k % 7) as f32
                }
            }),
        ];
        for (name, far) in scenes {
            let scans = hall(far);
            assert_eq!(rule(&scans, Limits::NONE).plateau(), None, "{name}");
        }
    }

    #[test]
    fn limits_that_cannot_be_are_not_believed() {
        for (nearest, farthest) in [
            (0.1, 0.0),
            (0.1, 0.05),
            (0.1, f32::NAN),
            (0.1, -1.0),
            (f32::NAN, 0.0),
        ] {
            assert!(Limits::is_impossible(nearest, farthest));
            let limits = Limits::stated(nearest, farthest);
            assert_eq!(limits.farthest, f32::INFINITY, "{nearest} {farthest}");
            assert!(Rule::LIMITS.range(1.0, limits).is_some());
        }
        assert!(!Limits::is_impossible(0.1, 8.0) && !Limits::is_impossible(f32::NAN, 8.0));
        assert_eq!(Limits::stated(f32::NAN, 8.0).nearest, 0.0);
    }
}
