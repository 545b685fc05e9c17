//! What a scan is matched against: a line for each direction, found without a search.

use crate::{
    matching::icp::projective::{line::Line, normals, range_noise::RangeNoise},
    scan::ScanPoint,
};

/// A scan as lines by direction: the k-th of `n` lines is what the lidar saw at `k/n` of a turn.
///
/// 12·N + 8 bytes. `n`, at most N, is best the number of beams of a full turn, also for a lidar that sees less than one.
#[derive(Debug, Clone)]
pub struct Reference<const N: usize> {
    lines: [Line; N],
    count: u16,
    directions: u16,
    noise: RangeNoise,
}

impl<const N: usize> Reference<N> {
    /// No lines; as many directions as there is room for.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_directions(u16::MAX)
    }

    /// No directions: all its bytes are zero.
    pub(crate) const ZERO: Self = Self {
        lines: [Line::ZERO; N],
        count: 0,
        directions: 0,
        noise: RangeNoise::NONE,
    };

    /// No lines; `directions` of them, at most N: matches do not depend on N then, only on this.
    #[must_use]
    pub(crate) const fn with_directions(directions: u16) -> Self {
        Self {
            lines: Self::no_lines(),
            count: 0,
            noise: RangeNoise::NONE,
            directions: Self::at_most_n(directions),
        }
    }

    /// The same in its place.
    pub(crate) fn restart(&mut self, directions: u16) {
        self.lines.fill(Line::NONE);
        (self.count, self.noise) = (0, RangeNoise::NONE);
        self.directions = Self::at_most_n(directions);
    }

    const fn at_most_n(directions: u16) -> u16 {
        if (directions as usize) < N {
            directions
        } else {
            N as u16
        }
    }

    /// Apart: so a reference that is made where it stays needs no second one on the stack.
    #[inline(never)]
    const fn no_lines() -> [Line; N] {
        [Line::NONE; N]
    }

    /// The line seen in each direction, counter-clockwise from straight ahead.
    #[must_use]
    pub fn lines(&self) -> &[Line] {
        self.lines
            .get(..usize::from(self.directions))
            .unwrap_or(&self.lines)
    }

    /// Number of points with a line: through their neighbours, or facing the lidar where they have none.
    #[must_use]
    pub const fn len(&self) -> u16 {
        self.count
    }

    /// Standard deviation of a range, as the scan itself shows it.
    pub(super) const fn noise(&self) -> RangeNoise {
        self.noise
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
        (self.count, self.noise) = normals::lay(lines, points);
    }
}

impl<const N: usize> Default for Reference<N> {
    fn default() -> Self {
        Self::new()
    }
}
