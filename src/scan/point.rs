//! A place hit by a beam, in integers.

use super::Bearing;
use crate::{geometry::Point, math};

/// Longest range that a point may have (mm).
pub(super) const MAX_RANGE_MM: u16 = 32_000;

/// A place hit by a beam: 8 bytes, all integers.
///
/// Direction, range and place always agree to a millimetre or two, which the bounds of the matchers' sums rest on: outside this crate it is
/// made by [`ScanPoint::at`] alone.
///
/// ```
/// use beamfix::{geometry::Point, scan::{Bearing, ScanPoint}};
///
/// let left = Point::from(ScanPoint::at(Bearing(16_384), 1500)); // a quarter of a turn
/// assert_eq!((left.x, left.y), (0.0, 1.5));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(align(4))]
pub struct ScanPoint {
    /// Forward of the lidar (mm).
    pub(crate) x: i16,
    /// Left of the lidar (mm).
    pub(crate) y: i16,
    /// Direction from the lidar.
    pub(crate) bearing: Bearing,
    /// Distance from the lidar (mm), at most 32 000.
    pub(crate) range: u16,
}

impl ScanPoint {
    /// The point `range` millimetres away; one farther off than 32 000 is put there.
    #[must_use]
    pub const fn at(bearing: Bearing, range: u16) -> Self {
        let range = if range < MAX_RANGE_MM {
            range
        } else {
            MAX_RANGE_MM
        };
        Self::within(bearing, range)
    }

    /// The same for a range of at most 32 000: one comparison a point less.
    pub(crate) const fn within(bearing: Bearing, range: u16) -> Self {
        let (s, c) = math::sin_cos_q15(bearing.0);
        let r = range as i32;
        Self {
            x: ((r * c + (1 << 14)) >> 15) as i16,
            y: ((r * s + (1 << 14)) >> 15) as i16,
            bearing,
            range,
        }
    }

    /// Forward of the lidar (mm).
    #[must_use]
    #[cfg(feature = "internals")]
    pub const fn x(&self) -> i16 {
        self.x
    }

    /// Left of the lidar (mm).
    #[must_use]
    #[cfg(feature = "internals")]
    pub const fn y(&self) -> i16 {
        self.y
    }

    /// Direction from the lidar.
    #[must_use]
    #[cfg(feature = "internals")]
    pub const fn bearing(&self) -> Bearing {
        self.bearing
    }

    /// Distance from the lidar (mm), at most 32 000.
    #[must_use]
    #[cfg(feature = "internals")]
    pub const fn range(&self) -> u16 {
        self.range
    }
}

impl From<ScanPoint> for Point {
    /// In the lidar's frame (m).
    fn from(point: ScanPoint) -> Self {
        Self::new(f32::from(point.x) / 1000.0, f32::from(point.y) / 1000.0)
    }
}
