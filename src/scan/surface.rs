//! Which neighbouring beams hit the same surface, and the line through them.
//!
//! A surface's beams end near each other. How near depends on the angle between the beams and on how flatly they graze the
//! surface: two beams that are `across` apart where they end, measured across the beams, differ in range by `across · tan β`
//! at an angle of incidence β. So a fixed gap, for noise, and a multiple of `across` are allowed.

use super::ScanPoint;
use crate::{geometry::Point, math};

/// How far apart two neighbours on one surface may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Gap {
    /// Always allowed (mm).
    pub mm: u32,
    /// And so many times the distance across the beams.
    pub slope: u32,
    /// Widest angle between two neighbours (1/65536 turn).
    pub widest: u16,
}

impl Gap {
    /// For laying lines through walls: 10 cm, walls down to 7° of grazing, beams at most 5.5° apart.
    pub const WALL: Self = Self {
        mm: 100,
        slope: 8,
        widest: 1000,
    };

    /// Whether two beams `turn` (1/65536 turn) apart whose ends are `step` mm apart, the nearer at `range` mm, lie on one
    /// surface.
    #[inline(always)]
    pub const fn joins(self, turn: u16, range: u16, step: u32) -> bool {
        // Most neighbours pass the first of the two.
        turn <= self.widest
            && (step <= self.mm || step <= self.mm + self.slope * across_mm(range, turn))
    }

    /// Whether two points measured one after the other lie on one surface, by the distance between them.
    pub fn joins_points(self, a: &ScanPoint, b: &ScanPoint) -> bool {
        let (dx, dy) = (
            i32::from(a.x) - i32::from(b.x),
            i32::from(a.y) - i32::from(b.y),
        );
        let (dx, dy) = (u64::from(dx.unsigned_abs()), u64::from(dy.unsigned_abs()));
        let turn = turn_between(a, b);
        // First, for wider angles overflow what follows.
        if turn > self.widest {
            return false;
        }
        let allowed = u64::from(self.mm + self.slope * across_mm(nearer(a, b), turn));
        dx * dx + dy * dy <= allowed * allowed
    }

    /// Number of points from the first on of which each lies on one surface with the next, by the distance between them.
    pub fn run_length(self, points: &[ScanPoint]) -> usize {
        let breaks = points.windows(2).position(|pair| {
            let [a, b] = pair else { return true };
            !self.joins_points(a, b)
        });
        breaks.map_or(points.len(), |at| at + 1)
    }
}

/// Angle between two beams (1/65536 turn).
#[inline(always)]
pub(crate) const fn turn_between(a: &ScanPoint, b: &ScanPoint) -> u16 {
    (b.bearing.0.wrapping_sub(a.bearing.0) as i16).unsigned_abs()
}

const fn nearer(a: &ScanPoint, b: &ScanPoint) -> u16 {
    if a.range < b.range { a.range } else { b.range }
}

/// Distance across two beams that are `turn` (1/65536 turn, at most 2600) apart, at `range` mm: to 0.5 %.
#[inline(always)]
pub(crate) const fn across_mm(range: u16, turn: u16) -> u32 {
    // 2π/65536 is 25.13/2¹⁸.
    (range as u32 * turn as u32 * 25) >> 18
}

/// The line that fits points best: total least squares, in millimetres relative to a point of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fit {
    /// Mean of the points, from `here` on (mm).
    pub middle: Point,
    /// Unit vector along the line.
    pub along: Point,
    /// Mean square distance of the points from the line (mm²).
    pub mean_square: f32,
}

impl Fit {
    /// The line through `points`; `None` for fewer than two, or where no direction stands out.
    ///
    /// Its direction is half that of `(S_xx − S_yy, 2 S_xy)`, the sums over the points' distances from their mean.
    pub fn through(points: &[ScanPoint], here: &ScanPoint) -> Option<Self> {
        if points.len() < 2 {
            return None;
        }
        let n = points.len() as f32;
        let (sx, sy) = points.iter().fold((0.0, 0.0), |(x, y), p| {
            let d = offset(p, here);
            (x + d.x, y + d.y)
        });
        let middle = Point::new(sx / n, sy / n);
        let (xx, xy, yy) = points.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), p| {
            let d = offset(p, here);
            let (dx, dy) = (d.x - middle.x, d.y - middle.y);
            (xx + dx * dx, xy + dx * dy, yy + dy * dy)
        });
        let (a, b) = (xx - yy, 2.0 * xy);
        let r = math::sqrt(a * a + b * b);
        // Square millimetres: points at least a few apart.
        if !(r > 0.01) {
            return None;
        }
        // Half the angle of (a, b), by the half-angle formula that does not cancel.
        let along = if a > 0.0 {
            let c = math::sqrt(0.5 * (1.0 + a / r));
            Point::new(c, 0.5 * b / (r * c))
        } else {
            let s = math::sqrt(0.5 * (1.0 - a / r));
            Point::new(0.5 * b / (r * s), s)
        };
        Some(Self {
            middle,
            along,
            mean_square: math::max(0.5 * (xx + yy - r), 0.0) / n,
        })
    }

    /// How far a point lies along the line from the middle, and across it (mm).
    pub fn place(&self, point: &ScanPoint, here: &ScanPoint) -> Point {
        let d = offset(point, here);
        let (x, y) = (d.x - self.middle.x, d.y - self.middle.y);
        Point::new(
            self.along.x * x + self.along.y * y,
            self.along.x * y - self.along.y * x,
        )
    }
}

/// From one point to another (mm): relative, so that nothing large cancels.
fn offset(point: &ScanPoint, here: &ScanPoint) -> Point {
    Point::new(
        f32::from(point.x) - f32::from(here.x),
        f32::from(point.y) - f32::from(here.y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Bearing;

    fn at(turn: u16, mm: u16) -> ScanPoint {
        ScanPoint::at(Bearing(turn), mm)
    }

    #[test]
    fn points_whose_fields_contradict_each_other_are_no_surface_and_do_not_overflow() {
        let far = |turn: u16, x: i16| ScanPoint {
            x,
            y: i16::MIN,
            bearing: Bearing(turn),
            range: u16::MAX,
        };
        for turn in [0u16, 1000, 1001, 20_000, 32_768, 65_000] {
            let (a, b) = (far(0, i16::MIN), far(turn, i16::MAX));
            assert!(!Gap::WALL.joins_points(&a, &b), "{turn}");
        }
    }

    #[test]
    fn noise_and_grazed_walls_are_joined_and_edges_are_not() {
        //   bearings apart (1/65536 turn), ranges (mm), on one surface
        for (turn, ranges, joined) in [
            (182, (2000, 2090), true),
            // 35 mm across: 100 + 8 · 35 mm are allowed.
            (182, (2000, 2360), true),
            (182, (2000, 2400), false),
            (1001, (2000, 2000), false),
        ] {
            let (a, b) = (at(0, ranges.0), at(turn, ranges.1));
            let step = u32::from(a.range.abs_diff(b.range));
            let gap = Gap::WALL;
            assert_eq!(gap.joins(turn, a.range, step), joined, "{turn} {ranges:?}");
            assert_eq!(gap.joins_points(&a, &b), joined, "{turn} {ranges:?}");
            assert_eq!(gap.joins_points(&b, &a), joined, "{turn} {ranges:?}");
        }
        let run = [at(0, 2000), at(182, 2010), at(364, 5000)];
        assert_eq!(Gap::WALL.run_length(&run), 2);
    }

    #[test]
    fn a_line_lies_along_its_points() {
        for degrees in [0.0f32, 30.0, 90.0, 135.0, -60.0] {
            let (s, c) = math::sin_cos(degrees.to_radians());
            let points = [-40.0f32, -10.0, 10.0, 50.0].map(|along| ScanPoint {
                x: (1000.0 + along * c) as i16,
                y: (200.0 + along * s) as i16,
                ..ScanPoint::default()
            });
            let fit = Fit::through(&points, &points[0]).expect("a line");
            // Whole millimetres over 90: a hundredth.
            let cross = fit.along.x * s - fit.along.y * c;
            assert!(cross.abs() < 0.02, "{degrees}: {fit:?}");
            assert!(fit.mean_square < 1.0, "{degrees}: {fit:?}");
            let place = fit.place(&points[3], &points[0]);
            assert!(place.y.abs() < 1.0, "{degrees}: {place:?}");
        }
        let alone = at(0, 1000);
        assert_eq!(Fit::through(&[alone; 3], &alone), None);
    }
}
