//! How matchers read a field, whether it is one table or tiles.

use super::{model::Scale, placement::Placement};
use crate::{geometry::Pose, grid::Shape, scan::ScanPoint};

/// Sum of the bytes in which a scan's beams end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Score {
    /// Sum of bytes, 255 a beam at most.
    pub sum: u32,
    /// Beams summed.
    pub beams: u16,
}

impl Score {
    /// Log-likelihood of the scan, its beams taken as independent (nat): over-confident, so temper it.
    #[must_use]
    pub fn nats(&self, scale: &Scale) -> f32 {
        let beams = f32::from(self.beams);
        beams * (scale.floor - scale.step) + scale.step * self.sum as f32
    }

    /// Share of the best possible score, 0…1.
    #[must_use]
    pub fn share(&self) -> f32 {
        if self.beams == 0 {
            return 0.0;
        }
        self.sum as f32 / (255.0 * f32::from(self.beams))
    }
}

/// A cell's byte with those beside it.
#[derive(Debug, Clone, Copy)]
pub struct Stencil {
    /// The cell's own.
    pub here: i32,
    /// One column less.
    pub left: i32,
    /// One column more.
    pub right: i32,
    /// One row less.
    pub below: i32,
    /// One row more.
    pub above: i32,
    /// One column and one row more.
    pub corner: i32,
}

/// Second derivatives of the bytes by column and row.
#[derive(Debug, Clone, Copy)]
pub struct Hessian {
    /// Twice by column.
    pub xx: i32,
    /// By each.
    pub xy: i32,
    /// Twice by row.
    pub yy: i32,
}

impl Stencil {
    /// How the bytes bend.
    #[inline]
    #[must_use]
    pub const fn hessian(&self) -> Hessian {
        Hessian {
            xx: self.right + self.left - 2 * self.here,
            xy: self.corner + self.here - self.above - self.right,
            yy: self.above + self.below - 2 * self.here,
        }
    }
}

/// Cells that beams can be looked up in: a whole table, or tiles.
pub trait Field {
    /// Size, resolution and place.
    fn shape(&self) -> &Shape;

    /// What the bytes mean.
    fn scale(&self) -> &Scale;

    /// The byte in column `x` and row `y`, that of unexplored cells off the field.
    fn byte(&self, x: u32, y: u32) -> u8;

    /// The byte with its neighbours; `None` at the edge and off the field.
    fn stencil(&self, x: u32, y: u32) -> Option<Stencil>;

    /// Sum of the bytes that `points` end in.
    fn sum(&self, points: &[ScanPoint], placement: &Placement) -> u32 {
        let mut sum = 0;
        for point in points {
            let (x, y) = placement.cell(point);
            sum += u32::from(self.byte(x, y));
        }
        sum
    }

    /// How well `points` fit, seen from `map_from_lidar`; a pose out of reach scores as all unexplored.
    fn score(&self, points: &[ScanPoint], map_from_lidar: Pose) -> Score {
        let sum = match Placement::new(self.shape(), map_from_lidar) {
            Some(placement) => self.sum(points, &placement),
            None => points.len() as u32 * u32::from(self.scale().unexplored),
        };
        Score {
            sum,
            beams: points.len() as u16,
        }
    }
}
