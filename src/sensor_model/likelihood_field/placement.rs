//! A pose in fixed point: from a point in millimetres to a cell of a grid in a few integer instructions.

use crate::{
    geometry::Pose,
    grid::{GridError, Shape},
    math,
    scan::points::ScanPoint,
};

/// A lidar's pose on a grid. Coordinates are cells in `Q shift`, modulo 2³².
///
/// There are [`COARSE`](Self::COARSE) binary places, so that coordinates reach 4096 cells, or [`FINE`](Self::FINE) in
/// grids of small cells, whose coordinates reach eight times as many. The rotation's entries are rounded to these
/// places: a point 8 m away is off by at most 0.006 cells, in grids of small cells by 0.05.
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
        let grid_from_lidar = shape.origin().between(map_from_lidar);
        if !grid_from_lidar.is_finite() {
            return None;
        }
        let shift = shift(shape);
        let one = (1u32 << shift) as f32;
        let coordinate = |metres: f32, side: u16| {
            let cells = metres / shape.resolution();
            let reach = Self::REACH_MM * 0.001 / shape.resolution();
            if !(cells > -reach && cells < f32::from(side) + reach) {
                return None;
            }
            let whole = cells as i32;
            let part = math::round_to_i32((cells - whole as f32) * one);
            Some(((whole << shift) as u32).wrapping_add(part as u32))
        };
        let (sin, cos) = math::sin_cos(grid_from_lidar.theta);
        let per_mm = one * 0.001 / shape.resolution();
        Some(Self {
            x: coordinate(grid_from_lidar.x, shape.width())?,
            y: coordinate(grid_from_lidar.y, shape.height())?,
            cos: math::round_to_i32(cos * per_mm),
            sin: math::round_to_i32(sin * per_mm),
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

    /// Coordinates of a point (cells, `Q shift`).
    #[inline]
    #[must_use]
    pub fn place(&self, point: &ScanPoint) -> (u32, u32) {
        let (px, py) = (i32::from(point.x), i32::from(point.y));
        // At most 46 340 mm times 2¹⁵: below 2³¹.
        (
            self.x
                .wrapping_add(self.cos.wrapping_mul(px) as u32)
                .wrapping_sub(self.sin.wrapping_mul(py) as u32),
            self.y
                .wrapping_add(self.sin.wrapping_mul(px) as u32)
                .wrapping_add(self.cos.wrapping_mul(py) as u32),
        )
    }

    /// Cell that a point lies in; beyond every side where it lies off the grid.
    #[inline]
    #[must_use]
    pub fn cell(&self, point: &ScanPoint) -> (u32, u32) {
        let (x, y) = self.place(point);
        (x >> (self.shift & 31), y >> (self.shift & 31))
    }
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
                let expected = shape.to_cells(
                    pose * Point::new(f32::from(point.x) * 1e-3, f32::from(point.y) * 1e-3),
                );
                let off = |got: u32, want: f32| (got as i32 as f32 / one - want).abs();
                // Half a unit of each entry for each millimetre, and what single precision leaves.
                let allowed = 1.5 * f32::from(point.range) / (2.0 * one) + 0.001;
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
