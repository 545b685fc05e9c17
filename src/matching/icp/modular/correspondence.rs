//! Second stage: which reference point a point is paired with.

pub mod nearest;

use crate::{
    geometry::Point,
    matching::icp::modular::normals::Cloud,
    math,
    scan::{ScanPoint, slots::Slots},
};
use nearest::{Place, Sweep};

/// Pairs a point with one of the reference.
pub trait Correspond {
    /// Looks at the reference once, before the first pass.
    fn prepare(&mut self, reference: Cloud<'_>);

    /// Index of the reference point that belongs to what lies at `place` with `normal`, both in the reference's frame.
    fn find(&mut self, reference: Cloud<'_>, place: Point, normal: [f32; 2]) -> Option<usize>;
}

/// The closest point, found by walking along the ordered scan: the default. Robust, but a slide along a wall takes many
/// passes.
///
/// Exact: [`BruteForce`] finds the same. On average a few dozen steps a point, the fewer the better the guess.
#[derive(Debug, Clone, Copy, Default)]
pub struct Closest {
    sweep: Sweep,
    hint: usize,
}

impl Correspond for Closest {
    fn prepare(&mut self, reference: Cloud<'_>) {
        self.sweep = Sweep::of(reference.points);
    }

    fn find(&mut self, reference: Cloud<'_>, place: Point, _: [f32; 2]) -> Option<usize> {
        let found = self
            .sweep
            .nearest(reference.points, Place::of(place), self.hint, |_| true)?;
        self.hint = found.index;
        Some(found.index)
    }
}

/// The closest point, by looking at all: the obvious twin of [`Closest`].
#[derive(Debug, Clone, Copy, Default)]
pub struct BruteForce;

impl Correspond for BruteForce {
    fn prepare(&mut self, _: Cloud<'_>) {}

    fn find(&mut self, reference: Cloud<'_>, place: Point, _: [f32; 2]) -> Option<usize> {
        Some(nearest::brute_force(reference.points, Place::of(place), |_| true)?.index)
    }
}

/// The closest point whose surface faces the same way: where two sides of a thin wall are near each other.
///
/// Points without a surface on either side of the pair find none.
#[derive(Debug, Clone, Copy)]
pub struct ClosestCompatible {
    /// Least cosine between the normals. Default 0.707: 45 degrees.
    pub cos_limit: f32,
    sweep: Sweep,
    hint: usize,
}

impl ClosestCompatible {
    /// With this least cosine between the normals.
    #[must_use]
    pub fn new(cos_limit: f32) -> Self {
        Self {
            cos_limit,
            sweep: Sweep::default(),
            hint: 0,
        }
    }
}

impl Default for ClosestCompatible {
    fn default() -> Self {
        Self::new(core::f32::consts::FRAC_1_SQRT_2)
    }
}

impl Correspond for ClosestCompatible {
    fn prepare(&mut self, reference: Cloud<'_>) {
        self.sweep = Sweep::of(reference.points);
    }

    fn find(&mut self, reference: Cloud<'_>, place: Point, normal: [f32; 2]) -> Option<usize> {
        let [nx, ny] = normal;
        let compatible = |k: usize| {
            let surface = reference.surfaces.get(k);
            surface.is_some_and(|s| nx * s.normal[0] + ny * s.normal[1] > self.cos_limit)
        };
        let found =
            self.sweep
                .nearest(reference.points, Place::of(place), self.hint, compatible)?;
        self.hint = found.index;
        Some(found.index)
    }
}

/// The reference surface that the point's normal meets first, either way: good on smooth surfaces, bad on clutter,
/// whose normals point anywhere.
///
/// Looks at all the reference's segments.
#[derive(Debug, Clone, Copy)]
pub struct NormalShooting {
    /// Farthest that is shot (m). Default 0.5.
    pub reach: f32,
    /// Longest segment between two neighbours that is hit (m). Default 0.3: more is a gap between two surfaces.
    pub gap: f32,
}

impl Default for NormalShooting {
    fn default() -> Self {
        Self {
            reach: 0.5,
            gap: 0.3,
        }
    }
}

impl Correspond for NormalShooting {
    fn prepare(&mut self, _: Cloud<'_>) {}

    fn find(&mut self, reference: Cloud<'_>, place: Point, normal: [f32; 2]) -> Option<usize> {
        let [nx, ny] = normal;
        if nx == 0.0 && ny == 0.0 {
            return None;
        }
        let (mut best, mut found) = (self.reach, None);
        for (k, pair) in reference.points.windows(2).enumerate() {
            let [a, b] = pair else { continue };
            let relative = |p: &ScanPoint| {
                [
                    f32::from(p.x) * 1e-3 - place.x,
                    f32::from(p.y) * 1e-3 - place.y,
                ]
            };
            let ([ax, ay], [bx, by]) = (relative(a), relative(b));
            // Which side of the normal's line the two ends lie on, and how far along it.
            let (left, right) = (nx * ay - ny * ax, nx * by - ny * bx);
            if (left > 0.0) == (right > 0.0) {
                continue;
            }
            let (dx, dy) = (bx - ax, by - ay);
            if dx * dx + dy * dy > self.gap * self.gap {
                continue;
            }
            let share = left / (left - right);
            let along = nx * (ax + share * dx) + ny * (ay + share * dy);
            if math::abs(along) < best {
                best = math::abs(along);
                found = Some(if share < 0.5 { k } else { k + 1 });
            }
        }
        found
    }
}

/// The reference point seen in the same direction: by far the cheapest, and with point-to-line the one that slides
/// best. Wants a guess within a few degrees and few occlusions.
///
/// 2·B bytes; B is best the number of beams of a full turn.
#[derive(Debug, Clone, Copy)]
pub struct Projection<const B: usize> {
    /// Index of the point seen in each direction, [`NOTHING`] for none.
    table: [u16; B],
}

const NOTHING: u16 = u16::MAX;

impl<const B: usize> Projection<B> {
    /// Before any reference.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            table: [NOTHING; B],
        }
    }

    const SLOTS: Slots = Slots::new(B);
}

impl<const B: usize> Default for Projection<B> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const B: usize> Correspond for Projection<B> {
    fn prepare(&mut self, reference: Cloud<'_>) {
        self.table.fill(NOTHING);
        for (k, point) in reference.points.iter().enumerate() {
            if let Some(slot) = self.table.get_mut(Self::SLOTS.of(point.bearing.0)) {
                *slot = k as u16;
            }
        }
    }

    fn find(&mut self, _: Cloud<'_>, place: Point, _: [f32; 2]) -> Option<usize> {
        let place = Place::of(place);
        let slot = Self::SLOTS.of(math::atan2_turn(place.y, place.x));
        let before = slot.checked_sub(1).unwrap_or(B.saturating_sub(1));
        let after = if slot + 1 < B { slot + 1 } else { 0 };
        // Beams do not fall evenly into the slots: an empty one is its neighbour's.
        [slot, before, after]
            .into_iter()
            .filter_map(|k| self.table.get(k).copied())
            .find(|k| *k != NOTHING)
            .map(usize::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        matching::icp::modular::normals::{self, Surface},
        scan::Bearing,
    };

    /// A wall at x = 2 m seen from -20 to 20 degrees, one point a degree.
    fn wall() -> [ScanPoint; 41] {
        core::array::from_fn(|k| {
            let bearing = Bearing::from_radians((k as f32 - 20.0).to_radians());
            let (_, c) = math::sin_cos(bearing.radians());
            ScanPoint::at(bearing, (2000.0 / c) as u16)
        })
    }

    #[test]
    fn each_choice_finds_what_it_looks_for() {
        let points = wall();
        let mut surfaces = [Surface::NONE; 41];
        let cloud = normals::lay(&points, 4, &mut surfaces);
        // Behind the wall, at y = 0.35: closest is the point at 10 degrees, in line with it the one at 8.
        let place = Point::new(2.45, 0.353);
        fn found(
            choice: &mut impl Correspond,
            cloud: Cloud<'_>,
            place: Point,
            n: [f32; 2],
        ) -> Option<usize> {
            choice.prepare(cloud);
            choice.find(cloud, place, n)
        }
        let normal = [-1.0, 0.0];
        assert_eq!(
            found(&mut Closest::default(), cloud, place, normal),
            Some(30)
        );
        assert_eq!(found(&mut BruteForce, cloud, place, normal), Some(30));
        assert_eq!(
            found(&mut Projection::<360>::new(), cloud, place, normal),
            Some(28)
        );
        assert_eq!(
            found(&mut ClosestCompatible::default(), cloud, place, normal),
            Some(30)
        );
        assert_eq!(
            found(&mut ClosestCompatible::default(), cloud, place, [1.0, 0.0]),
            None
        );
        assert_eq!(
            found(&mut NormalShooting::default(), cloud, place, normal),
            Some(30)
        );
        let reach = NormalShooting {
            reach: 0.4,
            ..NormalShooting::default()
        };
        assert_eq!(found(&mut { reach }, cloud, place, normal), None);
        // Slanted by 45 degrees it meets the wall 0.45 m to the side.
        let slanted = [-0.707, -0.707];
        let far = NormalShooting {
            reach: 1.0,
            ..NormalShooting::default()
        };
        assert_eq!(found(&mut { far }, cloud, place, slanted), Some(17));
        assert_eq!(
            found(
                &mut Projection::<360>::new(),
                cloud,
                Point::new(-1.0, 0.0),
                normal
            ),
            None
        );
    }
}
