//! One line of a reference: the surface seen in one direction.

/// The surface seen in one direction, as a line through a point.
///
/// 12 bytes. The normal carries the line's weight: a residual computed with it is already divided by its own
/// standard deviation, relative to that of a beam of a usual range that hits head on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(align(4))]
pub struct Line {
    /// Point on the line (mm); -32 768 stands for no line.
    pub qx: i16,
    /// Point on the line (mm).
    pub qy: i16,
    /// Weighted normal, Q10: 0.86 times 1024 long for a beam that hits head on, 1.67 times for a grazing one; where noise grows
    /// with the range, times what the usual standard deviation is over that of this range, 1/6 to 2.2.
    pub mx: i16,
    /// Weighted normal, Q10.
    pub my: i16,
    /// Direction of the point, divided by its distance and by the angle between two lines: its cross product with
    /// another point (mm) is the number of lines between the two, Q16. At most 16 383, which falls short within a
    /// hand's breadth of the lidar.
    pub ux: i16,
    /// As `ux`.
    pub uy: i16,
}

impl Line {
    /// No surface: a place that no point has, and a direction far off every point's.
    pub const NONE: Self = Self {
        qx: i16::MIN,
        qy: 0,
        mx: 0,
        my: 0,
        ux: 16_383,
        uy: 0,
    };

    /// All bytes zero, for a reference without directions.
    pub(super) const ZERO: Self = Self {
        qx: 0,
        qy: 0,
        mx: 0,
        my: 0,
        ux: 0,
        uy: 0,
    };

    /// Whether a surface was seen there.
    #[must_use]
    pub const fn is_some(&self) -> bool {
        self.qx != i16::MIN
    }
}
