//! A pose in fixed point: from a point in millimetres to a cell of a grid in a few integer instructions.

use crate::{
    geometry::{Point, Pose},
    grid::{GridError, Shape},
    math,
    scan::ScanPoint,
};

/// A lidar's pose on a grid. Coordinates are cells in `Q shift`, modulo 2³².
///
/// There are [`COARSE`](Self::COARSE) binary places, so that coordinates reach 4096 cells, or [`FINE`](Self::FINE) in
/// grids of small cells, whose coordinates reach eight times as many. The rotation is right to 5e-5 and its entries are
/// rounded to these places: a point 8 m away is off by at most 0.4 mm and 0.006 cells, in grids of small cells 0.05.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Placement {
    /// Where the lidar is.
    pub x: u32,
    /// Where the lidar is.
    pub y: u32,
    /// Cells per millimetre times the heading's cosine.
    pub cos: i32,
    /// Cells per millimetre times the heading's sine.
    pub sin: i32,
    /// Binary places of a coordinate: one of two, so that loops are compiled for each.
    pub shift: u32,
}

impl Placement {
    /// Binary places where cells are 3.5 cm or larger.
    pub const COARSE: u32 = 20;
    /// Binary places where cells are smaller.
    pub const FINE: u32 = 17;

    /// Farthest that a point may be from its lidar (mm): its coordinates have 16 bits.
    const REACH_MM: f32 = 46_400.0;

    /// `None` where the pose is not finite or farther from the grid than coordinates reach.
    #[must_use]
    pub fn new(shape: &Shape, map_from_lidar: Pose) -> Option<Self> {
        let (origin, shift) = (shape.origin(), shift(shape));
        if !map_from_lidar.is_finite() {
            return None;
        }
        let mut from_origin = Point::new(map_from_lidar.x - origin.x, map_from_lidar.y - origin.y);
        if origin.theta != 0.0 {
            from_origin = Pose::new(0.0, 0.0, -origin.theta) * from_origin;
        }
        let per_metre = 1.0 / shape.resolution();
        let reach = Self::REACH_MM * 0.001 * per_metre;
        // Four places fewer than there are, so that it fits in 31 bits: as many as a float has.
        let sixteenths = (1u32 << ((shift - 4) & 31)) as f32;
        let coordinate = |metres: f32, side: u16| {
            let cells = metres * per_metre;
            (cells > -reach && cells < f32::from(side) + reach)
                .then(|| (math::round_to_i32(cells * sixteenths) as u32) << 4)
        };
        let (sin, cos) =
            math::sin_cos_q15_fine(turn(map_from_lidar.theta).wrapping_sub(turn(origin.theta)));
        let per_mm = math::round_to_i32(16.0 * sixteenths * 0.001 * per_metre);
        // Both below 2¹⁵ and a bit.
        let entry = |q15: i32| (per_mm.wrapping_mul(q15).wrapping_add(1 << 14)) >> 15;
        Some(Self {
            x: coordinate(from_origin.x, shape.width())?,
            y: coordinate(from_origin.y, shape.height())?,
            cos: entry(cos),
            sin: entry(sin),
            shift,
        })
    }

    /// Fails where a grid is too wide for coordinates that also reach a point off either side.
    pub fn check(shape: &Shape) -> Result<(), GridError> {
        let around = 2.0 * Self::REACH_MM * 0.001;
        let cells = 4_294_967_296.0 / (1u32 << shift(shape)) as f32;
        let limit = cells * shape.resolution() - around;
        let side = if shape.width() > shape.height() {
            shape.width()
        } else {
            shape.height()
        };
        let metres = f32::from(side) * shape.resolution();
        if metres > limit {
            return Err(GridError::Extent { metres, limit });
        }
        Ok(())
    }

    /// A place as seen from the lidar, given in millimetres, along the grid's axes (cells, `Q shift`, modulo 2³²).
    #[inline]
    #[must_use]
    pub fn turned(&self, x: i32, y: i32) -> (i32, i32) {
        // A point is at most 46 340 mm away; times 2¹⁵: below 2³¹.
        let (cx, sx) = (self.cos.wrapping_mul(x), self.sin.wrapping_mul(x));
        let (cy, sy) = (self.cos.wrapping_mul(y), self.sin.wrapping_mul(y));
        (cx.wrapping_sub(sy), sx.wrapping_add(cy))
    }

    /// Coordinates of a point (cells, `Q shift`).
    #[inline]
    #[must_use]
    pub fn place(&self, point: &ScanPoint) -> (u32, u32) {
        let (x, y) = self.turned(point.x.into(), point.y.into());
        (self.x.wrapping_add(x as u32), self.y.wrapping_add(y as u32))
    }

    /// Cell that a point lies in; beyond every side where it lies off the grid.
    #[inline]
    #[must_use]
    pub fn cell(&self, point: &ScanPoint) -> (u32, u32) {
        let (x, y) = self.place(point);
        (x >> (self.shift & 31), y >> (self.shift & 31))
    }
}

/// An angle (rad) in 2⁻³² turn.
fn turn(angle: f32) -> u32 {
    /// 2³² over 2π: half a turn is as much as an integer holds.
    const PER_RADIAN: f32 = 683_565_275.6;
    math::round_to_i32(math::wrap_angle(angle) * PER_RADIAN) as u32
}

/// Binary places of coordinates on a grid.
fn shift(shape: &Shape) -> u32 {
    if shape.resolution() >= 0.035 {
        Placement::COARSE
    } else {
        Placement::FINE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::Point, scan::Bearing};

    #[test]
    fn points_land_in_the_cells_that_floats_say() {
        for (cells, resolution) in [(400, 0.05), (100, 0.01), (200, 0.2), (64, 1.0)] {
            let origin = Pose::new(-3.0, 2.0, 0.4);
            let shape = Shape::new(cells, cells, resolution, origin).expect("good");
            let pose = Pose::new(1.0, 4.0, -2.0);
            let placement = Placement::new(&shape, pose).expect("near");
            for k in 0..64 {
                let point = ScanPoint::at(Bearing(k * 1000), 300 + 37 * k);
                let place = placement.place(&point);
                let one = (1u32 << placement.shift) as f32;
                let expected = shape.cells_at(
                    pose * Point::new(f32::from(point.x) * 1e-3, f32::from(point.y) * 1e-3),
                );
                let off = |got: u32, want: f32| (got as i32 as f32 / one - want).abs();
                // Half a unit of each entry for each millimetre, 5e-5 of the range, and what single precision leaves.
                let allowed =
                    f32::from(point.range) * (1.5 / (2.0 * one) + 5e-8 / resolution) + 0.001;
                assert!(
                    off(place.0, expected.x) < allowed && off(place.1, expected.y) < allowed,
                    "{resolution} {point:?}: {place:?}"
                );
            }
        }
    }

    #[test]
    fn what_is_too_large_or_too_far_is_refused() {
        let shape = Shape::new(4000, 10, 0.05, Pose::IDENTITY).expect("good");
        assert!(matches!(
            Placement::check(&shape),
            Err(GridError::Extent { .. })
        ));
        let shape = Shape::new(400, 320, 0.05, Pose::IDENTITY).expect("good");
        assert_eq!(Placement::check(&shape), Ok(()));
        for x in [f32::NAN, 1e9, -60.0, 80.0] {
            let pose = Pose {
                x,
                y: 1.0,
                theta: 0.0,
            };
            assert_eq!(Placement::new(&shape, pose), None, "{x}");
        }
    }
}
