//! A point and its correspondence, as the stages hand it on.

use super::normals::Cloud;
use crate::geometry::Point;

/// A point and its correspondence, both in the reference's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Where the point comes to lie (m).
    pub place: Point,
    /// Its surface's normal; (0, 0) where it has none.
    pub normal: [f32; 2],
    /// Index of the point in its scan.
    pub point: u16,
    /// Index of the reference point.
    pub reference: u16,
    /// Distance from the reference point (m).
    pub distance: f32,
    /// Signed distance from the reference point's line (m), towards the reference's lidar; `distance` where it has
    /// no line.
    pub across: f32,
    /// What is minimised: one of the two above.
    pub residual: f32,
    /// What the pair counts; 0 once it is rejected.
    pub weight: f32,
}

impl Pair {
    /// The point at `place` and the `found`-th reference point.
    pub(super) fn new(
        reference: Cloud<'_>,
        place: Point,
        normal: [f32; 2],
        index: usize,
        found: usize,
    ) -> Option<Self> {
        let (point, surface) = (reference.points.get(found)?, reference.surfaces.get(found)?);
        let off = Point::new(
            place.x - f32::from(point.x) * 1e-3,
            place.y - f32::from(point.y) * 1e-3,
        );
        let distance = off.norm();
        Some(Self {
            place,
            normal,
            point: index as u16,
            reference: found as u16,
            distance,
            across: if surface.is_some() {
                surface.across(place)
            } else {
                distance
            },
            residual: distance,
            weight: 1.0,
        })
    }
}
