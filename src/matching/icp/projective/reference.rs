//! What a scan is matched against: a line for each direction, found without a search.

use crate::{matching::icp::projective::normals, scan::ScanPoint};

/// The surface seen in one direction, as a line through a point.
///
/// 12 bytes. The normal carries the line's weight: a residual computed with it is already divided by its own
/// standard deviation, relative to that of a beam that hits head on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(align(4))]
pub struct Line {
    /// Point on the line (mm); -32 768 stands for no line.
    pub qx: i16,
    /// Point on the line (mm).
    pub qy: i16,
    /// Weighted normal, Q10: of length 1024 for a beam that hits head on, up to 5 times that for a grazing one.
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

    /// Whether a surface was seen there.
    #[must_use]
    pub const fn is_some(&self) -> bool {
        self.qx != i16::MIN
    }
}

/// A scan as lines by direction: the k-th of `n` lines is what the lidar saw at `k/n` of a turn.
///
/// 12·N + 4 bytes. `n`, at most N, is best the number of beams of a full turn, also for a lidar that sees less than one.
#[derive(Debug, Clone)]
pub struct Reference<const N: usize> {
    lines: [Line; N],
    count: u16,
    directions: u16,
}

impl<const N: usize> Reference<N> {
    /// No lines; as many directions as there is room for.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_directions(u16::MAX)
    }

    /// No lines; `directions` of them, at most N: matches do not depend on N then, only on this.
    #[must_use]
    pub const fn with_directions(directions: u16) -> Self {
        let all = if N > u16::MAX as usize {
            u16::MAX
        } else {
            N as u16
        };
        Self {
            lines: [Line::NONE; N],
            count: 0,
            directions: if directions < all { directions } else { all },
        }
    }

    /// The line seen in each direction, counter-clockwise from straight ahead.
    #[must_use]
    pub fn lines(&self) -> &[Line] {
        self.lines
            .get(..usize::from(self.directions))
            .unwrap_or(&self.lines)
    }

    /// Number of points that a line could be laid through.
    #[must_use]
    pub const fn len(&self) -> u16 {
        self.count
    }

    /// Whether there is no line at all.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Lays lines through `points`, in the order of measurement, in place of those before.
    ///
    /// The larger part of the preparation that `bench` counts.
    pub fn assign(&mut self, points: &[ScanPoint]) {
        let directions = usize::from(self.directions);
        let lines = self.lines.get_mut(..directions).unwrap_or_default();
        self.count = normals::lay(lines, points);
    }
}

impl<const N: usize> Default for Reference<N> {
    fn default() -> Self {
        Self::new()
    }
}
