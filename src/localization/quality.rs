//! How well a scan fits a pose: beams that end on surfaces, against beams that went through them.

use crate::{
    geometry::Pose,
    math,
    scan::{ScanPoint, thinning::thinned},
    sensor_model::likelihood_field::{Field, placement::Placement},
};

/// The small steps (mm), and how many of them are a large one.
const FINE_MM: i32 = 25;
const LEAP: i32 = 6;

/// What became of a scan's beams.
///
/// People and things that moved end beams early, and count as nothing. A beam that went through a wall counts against; one
/// that ends where the map is unexplored says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Quality {
    /// Beams looked at.
    pub beams: u16,
    /// Those that end within 1.5σ of a surface.
    pub on_surface: u16,
    /// Those that passed a surface before they ended.
    pub through: u16,
    /// Those that passed none and end where the map is unexplored.
    pub unexplored: u16,
}

impl Quality {
    /// No beams.
    pub const NONE: Self = Self {
        beams: 0,
        on_surface: 0,
        through: 0,
        unexplored: 0,
    };

    /// Looks at no more than `most` of the points, each at its end and every 0.15 m on the way, near surfaces every 2.5 cm.
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
        let near = field.scale().byte_at(1.5);
        // Steps of 0.15 m see every surface that a beam crosses: one lies within 0.075 m of a step.
        let crossing = field.scale().byte_at(0.075 / field.scale().sigma);
        // A beam that only grazes one comes near it, but not onto it.
        let surface = field.scale().byte_at(0.25);
        for point in thinned(points, most) {
            quality.beams += 1;
            let (x, y) = placement.cell(point);
            let end = field.byte(x, y);
            if end >= near {
                quality.on_surface += 1;
            }
            // The last 0.4 m may graze what the beam ends on.
            let most = i32::from(point.range.saturating_sub(400)) / FINE_MM;
            let touches = |step: i32, limit: u8| {
                let part = ScanPoint {
                    x: part(point.x, step, point.range),
                    y: part(point.y, step, point.range),
                    ..*point
                };
                let (x, y) = placement.cell(&part);
                let byte = field.byte(x, y);
                byte >= limit && byte != field.scale().unexplored
            };
            let passed = (1..=most / LEAP)
                .filter(|leap| touches(LEAP * leap, crossing))
                .any(|leap| {
                    let near = LEAP * leap - LEAP / 2..=LEAP * leap + LEAP / 2;
                    near.into_iter().any(|step| touches(step, surface))
                });
            quality.through += u16::from(passed);
            quality.unexplored += u16::from(!passed && end == field.scale().unexplored);
        }
        quality
    }

    /// Share of the beams that end in what the map knows which end on a surface, less that of those that passed one: at most
    /// 1. Of all beams a third counts in any case: a pose that looks out of the map has no evidence.
    #[must_use]
    pub fn value(&self) -> f32 {
        let known = self.beams.saturating_sub(self.unexplored);
        self.share_of(known.max(self.beams / 3))
    }

    /// The same as a share of all beams: for poses of which most are wrong, some of which look out of the map.
    #[must_use]
    pub fn strict_value(&self) -> f32 {
        self.share_of(self.beams)
    }

    /// Whether few beams passed a surface, `most` a share of those that nothing ended early. The fewer beams agree, because
    /// people end the others, the fewer may have.
    pub(crate) fn is_confident(&self, most: f32) -> bool {
        let agreeing = math::min(2.0 * self.value(), 1.0);
        self.through_share() <= most * agreeing * agreeing
    }

    fn share_of(&self, beams: u16) -> f32 {
        if beams == 0 {
            return 0.0;
        }
        (f32::from(self.on_surface) - f32::from(self.through)) / f32::from(beams)
    }

    /// Share of beams that passed a surface among those that nothing ended early: people change nothing in it.
    #[must_use]
    pub fn through_share(&self) -> f32 {
        let seen = self.on_surface.saturating_add(self.through);
        f32::from(self.through) / f32::from(seen.max(1))
    }
}

/// The place after `step` times [`FINE_MM`] on the way to a coordinate.
fn part(end: i16, step: i32, range: u16) -> i16 {
    let scaled = i32::from(end) * step * FINE_MM;
    scaled.checked_div(i32::from(range)).unwrap_or(0) as i16
}
