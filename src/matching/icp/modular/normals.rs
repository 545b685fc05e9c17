//! The surface under each point of an ordered scan: total least squares over its neighbours.

use crate::{
    geometry::Point,
    scan::{
        ScanPoint,
        surface::{Fit, Gap},
    },
};

/// A scan and the surfaces that its points lie on, both in the order of measurement and of the same length.
#[derive(Debug, Clone, Copy)]
pub struct Cloud<'a> {
    /// Places hit (mm).
    pub points: &'a [ScanPoint],
    /// The line through each and its neighbours.
    pub surfaces: &'a [Surface],
}

/// A line through a point and its neighbours. 20 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// The point's foot on the line (m): it carries less noise than the point itself.
    pub foot: Point,
    /// Unit normal, towards the lidar; (0, 0) where there is no line.
    pub normal: [f32; 2],
    /// First or last point of its run: what lies beyond may be the same surface, or nothing.
    pub edge: bool,
}

/// Root mean square distance of the points from their line beyond which it is none (mm): twice the noise of a cheap
/// lidar.
const FLAT_MM: f32 = 20.0;
impl Surface {
    /// No line.
    pub const NONE: Self = Self {
        foot: Point::new(0.0, 0.0),
        normal: [0.0; 2],
        edge: true,
    };

    /// Whether a line could be laid.
    #[must_use]
    pub fn is_some(&self) -> bool {
        self.normal != [0.0; 2]
    }

    /// Signed distance of `place` from the line (m), positive on the lidar's side.
    #[must_use]
    pub fn across(&self, place: Point) -> f32 {
        let [nx, ny] = self.normal;
        nx * (place.x - self.foot.x) + ny * (place.y - self.foot.y)
    }
}

/// Lays a line through each of `points` and up to `half` neighbours on each side, on the same run.
///
/// Where those bend (a corner) the line goes through the neighbours on one side alone; where these bend too, or a run
/// has fewer than three points, there is none. As many surfaces as fit are filled.
pub fn lay<'a>(points: &'a [ScanPoint], half: usize, surfaces: &'a mut [Surface]) -> Cloud<'a> {
    let mut rest = points;
    let mut room = surfaces.iter_mut();
    while !rest.is_empty() {
        let Some((run, others)) = rest.split_at_checked(Gap::WALL.run_length(rest).max(1)) else {
            break;
        };
        for (i, surface) in (0..run.len()).zip(room.by_ref()) {
            *surface = at(run, i, half);
        }
        rest = others;
    }
    let filled = points.len().min(surfaces.len());
    Cloud {
        points: points.get(..filled).unwrap_or_default(),
        surfaces: surfaces.get(..filled).unwrap_or_default(),
    }
}

/// The surface under the `i`-th point of a run.
fn at(run: &[ScanPoint], i: usize, half: usize) -> Surface {
    let Some(point) = run.get(i) else {
        return Surface::NONE;
    };
    let edge = i == 0 || i + 1 == run.len();
    let place = Point::new(f32::from(point.x) * 1e-3, f32::from(point.y) * 1e-3);
    let last = run.len().saturating_sub(1);
    let span = |from: usize, to: usize| run.get(from..=to.min(last));
    let (centred, before, after) = (
        span(i.saturating_sub(half), i + half),
        span(i.saturating_sub(half), i),
        span(i, i + half),
    );
    let flat = |points: Option<&[ScanPoint]>| {
        let run = points.filter(|run| run.len() > 2)?;
        Fit::through(run, point).filter(|fit| fit.mean_square < FLAT_MM * FLAT_MM)
    };
    let one_side = || match (flat(before), flat(after)) {
        (Some(a), Some(b)) => Some(if a.mean_square < b.mean_square { a } else { b }),
        (a, b) => a.or(b),
    };
    flat(centred).or_else(one_side).map_or(
        Surface {
            foot: place,
            normal: [0.0; 2],
            edge,
        },
        |fit| {
            // Towards the lidar.
            let Point { x: c, y: s } = fit.along;
            let sign = if c * place.y - s * place.x > 0.0 {
                -1.0
            } else {
                1.0
            };
            let [nx, ny] = [-s * sign, c * sign];
            let offset = 1e-3 * (nx * fit.middle.x + ny * fit.middle.y);
            Surface {
                foot: Point::new(place.x + nx * offset, place.y + ny * offset),
                normal: [nx, ny],
                edge,
            }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math, scan::Bearing};

    /// A wall through (2 m, 0) whose normal has direction `normal` (degrees).
    fn wall(normal: f32) -> [ScanPoint; 21] {
        let (s, c) = math::sin_cos(normal.to_radians());
        core::array::from_fn(|k| {
            let bearing = Bearing((k as u16).wrapping_mul(182).wrapping_sub(1820));
            let (bs, bc) = math::sin_cos(bearing.radians());
            let range = 2.0 * c / (bc * c + bs * s);
            ScanPoint::at(bearing, math::round_to_i32(1000.0 * range) as u16)
        })
    }

    #[test]
    fn the_normal_of_a_wall_faces_the_lidar() {
        for degrees in [0.0f32, 20.0, -45.0, 60.0] {
            let points = wall(degrees);
            let mut surfaces = [Surface::NONE; 21];
            let cloud = lay(&points, 4, &mut surfaces);
            let (s, c) = math::sin_cos(degrees.to_radians());
            for (k, surface) in cloud.surfaces.iter().enumerate() {
                // 1 mm steps over 0.1 m and more: a hundredth.
                let [nx, ny] = surface.normal;
                let off = (nx + c).abs() + (ny + s).abs();
                assert!(off < 0.03, "{degrees} {k}: {surface:?}");
                assert_eq!(surface.edge, k == 0 || k == 20, "{k}");
                let across = surface.across(Point::new(0.0, 0.0));
                assert!((across - 2.0 * c).abs() < 0.03, "{degrees} {k}: {across}");
            }
        }
    }

    #[test]
    fn a_corner_keeps_both_walls() {
        // Two walls that meet at (2, 2): x = 2 below 45 degrees, y = 2 above.
        let points: [ScanPoint; 31] = core::array::from_fn(|k| {
            let bearing = Bearing::from_radians((30.0 + k as f32).to_radians());
            let (s, c) = math::sin_cos(bearing.radians());
            ScanPoint::at(bearing, (2000.0 / if s > c { s } else { c }) as u16)
        });
        let mut surfaces = [Surface::NONE; 31];
        let cloud = lay(&points, 4, &mut surfaces);
        for (k, surface) in cloud.surfaces.iter().enumerate() {
            let [nx, ny] = surface.normal;
            let off = if k < 15 { ny } else { nx };
            assert!(
                k == 15 || (surface.is_some() && off.abs() < 0.1),
                "{k}: {surface:?}"
            );
        }
    }
}
