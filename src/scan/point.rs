//! A place hit by a beam, in integers.

use super::Bearing;
use crate::math;

/// A place hit by a beam: 8 bytes, all integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(align(4))]
pub struct ScanPoint {
    /// Forward of the lidar (mm).
    pub x: i16,
    /// Left of the lidar (mm).
    pub y: i16,
    /// Direction from the lidar.
    pub bearing: Bearing,
    /// Distance from the lidar (mm), at most 32 000.
    pub range: u16,
}

impl ScanPoint {
    /// The point `range` millimetres away, at most 32 767.
    #[must_use]
    pub const fn at(bearing: Bearing, range: u16) -> Self {
        let (s, c) = math::sin_cos_q15(bearing.0);
        let r = range as i32;
        Self {
            x: ((r * c + (1 << 14)) >> 15) as i16,
            y: ((r * s + (1 << 14)) >> 15) as i16,
            bearing,
            range,
        }
    }
}
