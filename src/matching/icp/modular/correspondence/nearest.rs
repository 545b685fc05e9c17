//! The nearest point of an ordered scan: by looking at all, and by walking away from a good start.
//!
//! Walking up and down in bearing, a direction ends where even the nearest place on the rays beyond is farther than
//! the best so far: `ρ sin Δφ` from a point at distance `ρ` (Censi, ICRA 2008). The bounds leave room for all rounding,
//! for scans that turn either way, start anywhere, see more or less than a turn, and whose order deskewing has shaken.

use crate::{geometry::Point, math, scan::ScanPoint};

/// A place in whole millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Forward of the reference's lidar (mm).
    pub x: i32,
    /// Left of it (mm).
    pub y: i32,
}

impl Place {
    /// Nearest whole millimetre, held within 65 m.
    #[must_use]
    pub fn of(place: Point) -> Self {
        let whole = |v: f32| math::round_to_i32(v * 1000.0).clamp(-65_535, 65_535);
        Self {
            x: whole(place.x),
            y: whole(place.y),
        }
    }

    fn square(self, point: &ScanPoint) -> u64 {
        let (dx, dy) = (
            i64::from(self.x) - i64::from(point.x),
            i64::from(self.y) - i64::from(point.y),
        );
        (dx * dx + dy * dy) as u64
    }
}

/// A point found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found {
    /// Its index; of points equally near, the first.
    pub index: usize,
    /// Squared distance (mm²).
    pub square: u64,
}

impl Found {
    fn nearer(self, other: Option<Self>) -> bool {
        other.is_none_or(|o| (self.square, self.index) < (o.square, o.index))
    }
}

/// The nearest of all points that `accept` takes.
pub fn brute_force(
    points: &[ScanPoint],
    place: Place,
    accept: impl Fn(usize) -> bool,
) -> Option<Found> {
    let mut best: Option<Found> = None;
    for (index, point) in points.iter().enumerate() {
        let found = Found {
            index,
            square: place.square(point),
        };
        if found.nearer(best) && accept(index) {
            best = Some(found);
        }
    }
    best
}

/// How the bearings of a scan run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sweep {
    /// Clockwise.
    falling: bool,
    /// Turn from the last point on to the first (1/65536 turn): what is missing to one turn.
    seam: i32,
    /// Most that a later bearing lies before an earlier one, and room for the rounding of bearings (1/65536 turn).
    slack: i32,
}

/// Points are stored in whole millimetres along rounded bearings: a point at 32 m may lie that far off its ray (mm),
/// both roundings and that of the sine together.
const OFF_RAY: i64 = 8;
/// Error of two computed bearings (1/65536 turn).
const ROUNDING: i32 = 4;
const QUARTER: i32 = 1 << 14;

impl Sweep {
    /// Looks at the bearings of `points` once. A scan whose order is lost still works, at the price of brute force.
    #[must_use]
    pub fn of(points: &[ScanPoint]) -> Self {
        let steps = points.windows(2).map(|pair| turn_between(pair, false));
        let total = steps.fold(0i32, |sum, step| sum.saturating_add(step));
        let falling = total < 0;
        let seam = (1i32 << 16).saturating_sub(total.saturating_abs());
        // Twice around, so that the seam is looked at, too.
        let (mut at, mut highest, mut slack) = (0i32, 0i32, 0i32);
        for lap in 0..2 {
            if lap == 1 {
                at = at.saturating_add(seam);
                slack = slack.max(highest.saturating_sub(at));
            }
            for pair in points.windows(2) {
                at = at.saturating_add(turn_between(pair, falling));
                highest = highest.max(at);
                slack = slack.max(highest.saturating_sub(at));
            }
        }
        Self {
            falling,
            seam,
            slack: slack.saturating_add(ROUNDING),
        }
    }

    /// The nearest of the points that `accept` takes, the same as by [`brute_force`]; the walk starts at `hint`.
    ///
    /// `points` are those that the sweep was made of.
    pub fn nearest(
        &self,
        points: &[ScanPoint],
        place: Place,
        hint: usize,
        accept: impl Fn(usize) -> bool,
    ) -> Option<Found> {
        let start = if hint < points.len() { hint } else { 0 };
        let bearing = math::atan2_turn(place.y, place.x);
        let (x, y) = (place.x as f32, place.y as f32);
        let range = math::sqrt(x * x + y * y) as i64;
        let ahead = points.get(start)?.bearing.0.wrapping_sub(bearing) as i16;
        let ahead = if self.falling {
            -i32::from(ahead)
        } else {
            i32::from(ahead)
        };
        let mut up = Walk {
            index: start,
            angle: ahead,
            open: true,
        };
        let mut down = Walk {
            index: start,
            angle: -ahead,
            open: true,
        };
        let mut best: Option<Found> = None;
        let look = |index: usize, best: &mut Option<Found>| {
            let Some(point) = points.get(index) else {
                return;
            };
            let found = Found {
                index,
                square: place.square(point),
            };
            if found.nearer(*best) && accept(index) {
                *best = Some(found);
            }
        };
        look(start, &mut best);
        let mut left = points.len().saturating_sub(1);
        while left > 0 && (up.open || down.open) {
            for (walk, backward) in [(&mut up, false), (&mut down, true)] {
                if left > 0 && walk.open {
                    if self.hopeless(walk.angle, range, best) {
                        walk.open = false;
                        continue;
                    }
                    self.advance(points, walk, backward);
                    look(walk.index, &mut best);
                    left -= 1;
                }
            }
        }
        best
    }

    /// Whether all points beyond `angle` are farther than the best.
    fn hopeless(&self, angle: i32, range: i64, best: Option<Found>) -> bool {
        let Some(best) = best else { return false };
        let angle = angle.saturating_sub(self.slack);
        if angle <= 0 {
            return false;
        }
        let sine = if angle < QUARTER {
            i64::from(math::sin_cos_q15(angle as u16).0)
        } else {
            1 << 15
        };
        let bound = ((range * sine) >> 15) - OFF_RAY;
        bound > 0 && (bound * bound) as u64 > best.square
    }

    fn advance(&self, points: &[ScanPoint], walk: &mut Walk, backward: bool) {
        let last = points.len().saturating_sub(1);
        let (from, to, over_seam) = if backward {
            let before = walk.index.checked_sub(1).unwrap_or(last);
            (before, walk.index, walk.index == 0)
        } else {
            let after = if walk.index == last {
                0
            } else {
                walk.index + 1
            };
            (walk.index, after, walk.index == last)
        };
        let turn = if over_seam {
            self.seam
        } else {
            match (points.get(from), points.get(to)) {
                (Some(a), Some(b)) => turn_between(&[*a, *b], self.falling),
                _ => 0,
            }
        };
        walk.angle = walk.angle.saturating_add(turn);
        walk.index = if backward { from } else { to };
    }
}

/// One direction of the walk: where it is, how far past the place's bearing, and whether it goes on.
struct Walk {
    index: usize,
    angle: i32,
    open: bool,
}

/// Turn from one point to the next in the sweep's direction, the short way (1/65536 turn).
fn turn_between(pair: &[ScanPoint], falling: bool) -> i32 {
    let [a, b] = pair else { return 0 };
    let turn = i32::from(b.bearing.0.wrapping_sub(a.bearing.0) as i16);
    if falling { -turn } else { turn }
}
