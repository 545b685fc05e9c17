//! Using some of the points, evenly spread, where all are not needed or do not fit.

use super::ScanPoint;

/// Every so-many-th of `len` points is used so that they are at most `room`.
pub(crate) fn stride(len: usize, room: usize) -> usize {
    len.div_ceil(room.max(1)).max(1)
}

/// At most `room` of the points, evenly spread.
pub(crate) fn thinned(points: &[ScanPoint], room: usize) -> impl Iterator<Item = &ScanPoint> {
    points.iter().step_by(stride(points.len(), room))
}
