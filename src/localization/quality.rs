//! How well a scan fits a pose: beams that end on surfaces, against beams that went through them.

use crate::{
    geometry::Pose,
    matching::correlative::stride,
    scan::ScanPoint,
    sensor_model::likelihood_field::{Field, placement::Placement},
};

/// What became of a scan's beams.
///
/// People and things that moved end beams early, and count as nothing. A beam that went through a wall counts against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Quality {
    /// Beams looked at.
    pub beams: u16,
    /// Those that end within 1.5σ of a surface.
    pub on_surface: u16,
    /// Those that passed a surface before they ended.
    pub through: u16,
}

impl Quality {
    /// No beams.
    pub const NONE: Self = Self {
        beams: 0,
        on_surface: 0,
        through: 0,
    };

    /// Looks at no more than `most` of the points, each at its end and every 0.15 m on the way.
    pub fn of<F: Field + ?Sized>(
        field: &F,
        points: &[ScanPoint],
        map_from_lidar: Pose,
        most: usize,
    ) -> Self {
        let mut quality = Self::NONE;
        let Some(placement) = Placement::new(field.shape(), map_from_lidar) else {
            return Self {
                beams: points.len() as u16,
                ..Self::NONE
            };
        };
        let near = byte_at(field, 1.5);
        // Steps of 0.15 m see every surface that a beam crosses: one lies within 0.075 m of a step.
        let crossing = byte_at(field, 0.075 / field.scale().sigma);
        for point in points.iter().step_by(stride(points.len(), most)) {
            quality.beams += 1;
            let (x, y) = placement.cell(point);
            if field.byte(x, y) >= near {
                quality.on_surface += 1;
            }
            // Two steps near a surface, one after the other, are a beam that grazes it; the last 0.4 m may do so.
            let steps = i32::from(point.range.saturating_sub(400)) / 150;
            let mut before = true;
            for step in 1..=steps {
                let part = ScanPoint {
                    x: part(point.x, step, point.range),
                    y: part(point.y, step, point.range),
                    ..*point
                };
                let (x, y) = placement.cell(&part);
                let byte = field.byte(x, y);
                let here = byte >= crossing && byte != field.scale().unexplored;
                if here && !before {
                    quality.through += 1;
                    break;
                }
                before = here;
            }
        }
        quality
    }

    /// Share of beams that end on a surface less that of beams that passed one: at most 1.
    #[must_use]
    pub fn value(&self) -> f32 {
        if self.beams == 0 {
            return 0.0;
        }
        (f32::from(self.on_surface) - f32::from(self.through)) / f32::from(self.beams)
    }
}

/// The place after `step` times 0.15 m on the way to a coordinate.
fn part(end: i16, step: i32, range: u16) -> i16 {
    let scaled = i32::from(end) * step * 150;
    scaled.checked_div(i32::from(range)).unwrap_or(0) as i16
}

/// Byte of a cell `sigmas` standard deviations from a surface.
pub(super) fn byte_at<F: Field + ?Sized>(field: &F, sigmas: f32) -> u8 {
    let steps = 0.5 * sigmas * sigmas / field.scale().step;
    255 - crate::math::round_to_i32(crate::math::min(steps, 250.0)) as u8
}
