//! A field from scans: every beam's end raises the cells around it, measured from the surface itself.
//!
//! Not from the middle of the cell it falls into: that costs a third of a cell. Each end is the middle of a
//! short straight piece laid through its neighbours on the same surface, so range noise averages out too.

use super::Profile;
use crate::{
    geometry::{Point, Pose},
    grid::Shape,
    math,
    scan::points::ScanPoint,
};

/// What a scan can be drawn on.
pub trait Canvas {
    /// Size, resolution and place.
    fn shape(&self) -> &Shape;

    /// Raises a cell to at least `byte`; off the canvas nothing happens.
    fn raise(&mut self, x: i32, y: i32, byte: u8);
}

/// How neighbours are told from strangers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawConfig {
    /// Neighbours on each side that a piece is laid through. Default 3.
    pub neighbours: usize,
    /// Two beams' ends at most this far apart always belong together (mm). Default 40.
    pub gap_mm: u16,
    /// And so do ends at most so many times their distance on a wall seen head-on. Default 4: 75° of incidence.
    pub slant: u16,
    /// A piece is laid through neighbours that lie within this of it (mm). Default 30: three times a range's σ.
    pub straight_mm: u16,
}

impl DrawConfig {
    /// For lidars with 1 cm of range noise.
    pub const DEFAULT: Self = Self {
        neighbours: 3,
        gap_mm: 40,
        slant: 4,
        straight_mm: 30,
    };
}

impl Default for DrawConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Straight piece of a surface, in millimetres in the lidar's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    middle: Point,
    /// Unit vector along it.
    along: Point,
    /// Half its length.
    half: f32,
}

/// Draws a scan taken at `map_from_lidar` onto `canvas`, which keeps what is higher.
///
/// Beams that fall within half a cell of the last piece share it.
/// Does nothing if the pose is not finite.
pub fn scan<C: Canvas + ?Sized>(
    canvas: &mut C,
    points: &[ScanPoint],
    map_from_lidar: Pose,
    profile: &Profile,
    config: &DrawConfig,
) {
    if !map_from_lidar.is_finite() {
        return;
    }
    let half_cell = 500.0 * canvas.shape().resolution();
    let mut last: Option<Piece> = None;
    for index in 0..points.len() {
        let Some(piece) = piece(points, index, config) else {
            continue;
        };
        let near = last.is_some_and(|last| {
            let step = Point::new(
                piece.middle.x - last.middle.x,
                piece.middle.y - last.middle.y,
            );
            step.norm() < half_cell
        });
        if near {
            continue;
        }
        // Long enough to meet the next one half-way.
        let half = if piece.half > 0.0 {
            math::max(piece.half, half_cell)
        } else {
            0.0
        };
        draw(canvas, &Piece { half, ..piece }, map_from_lidar, profile);
        last = Some(piece);
    }
}

/// The piece around one point; `None` where there is no such point.
fn piece(points: &[ScanPoint], index: usize, config: &DrawConfig) -> Option<Piece> {
    let here = points.get(index)?;
    let at = |point: &ScanPoint| Point::new(f32::from(point.x), f32::from(point.y));
    let alone = Piece {
        middle: at(here),
        along: Point::new(1.0, 0.0),
        half: 0.0,
    };
    let mut reach = config.neighbours;
    while reach > 0 {
        let right = points.get(..=index)?.windows(2).rev().take(reach);
        let left = points.get(index..)?.windows(2).take(reach);
        let first = index - right.take_while(|pair| together(pair, config)).count();
        let last = index + left.take_while(|pair| together(pair, config)).count();
        let run = points.get(first..=last)?;
        if run.len() < 2 {
            return Some(slanted(points, index, config).unwrap_or(alone));
        }
        if let Some(piece) = line_through(run, at(here), f32::from(config.straight_mm)) {
            return Some(piece);
        }
        reach /= 2;
    }
    Some(alone)
}

/// A wall seen at so flat an angle that its beams lie far apart: the point is in line with both its neighbours.
fn slanted(points: &[ScanPoint], index: usize, config: &DrawConfig) -> Option<Piece> {
    let run = points.get(index.checked_sub(1)?..=index + 1)?;
    let here = Point::new(
        f32::from(points.get(index)?.x),
        f32::from(points.get(index)?.y),
    );
    let piece = line_through(run, here, f32::from(config.straight_mm))?;
    Some(Piece { half: 1.0, ..piece })
}

/// Whether two beams in a row end on the same surface.
fn together(pair: &[ScanPoint], config: &DrawConfig) -> bool {
    let [a, b] = pair else { return false };
    let (dx, dy) = (
        i32::from(a.x) - i32::from(b.x),
        i32::from(a.y) - i32::from(b.y),
    );
    let apart = (b.bearing.0.wrapping_sub(a.bearing.0) as i16).unsigned_abs();
    let range = u32::from(if a.range < b.range { a.range } else { b.range });
    // 2π/65536 in Q24: 1609. Bearings more than 11° apart count as 11°.
    let apart = u32::from(if apart > 2048 { 2048 } else { apart });
    let head_on = ((range * apart) >> 8).wrapping_mul(1609) >> 16;
    let allowed = u32::from(config.gap_mm) + u32::from(config.slant) * head_on;
    math::isqrt((dx.wrapping_mul(dx) as u32).wrapping_add(dy.wrapping_mul(dy) as u32)) <= allowed
}

/// Least squares line through a run, cut to the part around `here`; `None` where a point is off it.
fn line_through(run: &[ScanPoint], here: Point, straight_mm: f32) -> Option<Piece> {
    let count = run.len() as f32;
    let (mut mx, mut my) = (0.0, 0.0);
    for point in run {
        mx += f32::from(point.x);
        my += f32::from(point.y);
    }
    let middle = Point::new(mx / count, my / count);
    let off = |point: &ScanPoint| {
        Point::new(f32::from(point.x) - middle.x, f32::from(point.y) - middle.y)
    };
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for point in run {
        let d = off(point);
        xx += d.x * d.x;
        xy += d.x * d.y;
        yy += d.y * d.y;
    }
    let along = principal(xx - yy, 2.0 * xy);
    let mut longest = 0.0;
    for point in run {
        let d = off(point);
        if math::abs(along.x * d.y - along.y * d.x) > straight_mm {
            return None;
        }
        longest = math::max(longest, math::abs(along.x * d.x + along.y * d.y));
    }
    // The point's own place on the line; the piece reaches half-way to its neighbours.
    let foot = along.x * (here.x - middle.x) + along.y * (here.y - middle.y);
    Some(Piece {
        middle: Point::new(middle.x + foot * along.x, middle.y + foot * along.y),
        along,
        half: longest / (count - 1.0),
    })
}

/// Unit vector at half the angle of `(x, y)`.
fn principal(x: f32, y: f32) -> Point {
    let norm = math::sqrt(x * x + y * y);
    if !(norm > 0.0) {
        return Point::new(1.0, 0.0);
    }
    let cosine = math::sqrt(math::max(0.5 * (1.0 + x / norm), 0.0));
    let sine = math::sqrt(math::max(0.5 * (1.0 - x / norm), 0.0));
    Point::new(cosine, if y < 0.0 { -sine } else { sine })
}

/// Raises the cells within the profile's reach of a piece.
fn draw<C: Canvas + ?Sized>(
    canvas: &mut C,
    piece: &Piece,
    map_from_lidar: Pose,
    profile: &Profile,
) {
    let shape = *canvas.shape();
    let cell_mm = shape.resolution() * 1000.0;
    let grid_from_lidar = shape.origin().between(map_from_lidar);
    let turn = Pose {
        x: 0.0,
        y: 0.0,
        ..grid_from_lidar
    };
    let along = turn * piece.along;
    let middle = grid_from_lidar * Point::new(piece.middle.x * 1e-3, piece.middle.y * 1e-3);
    let limit = 20.0 + f32::from(Shape::MAX_SIDE as u16);
    let (mx, my) = (middle.x / shape.resolution(), middle.y / shape.resolution());
    if !(mx > -limit && mx < limit && my > -limit && my < limit) {
        return;
    }
    // Quarters of a millimetre and Q12 from here on: a reach of 4 m keeps products below 2²⁸.
    let reach = profile.hit_reach_mm() as f32 + 1.0;
    let extent = |along: f32| (math::abs(along) * piece.half + reach) / cell_mm;
    let (rx, ry) = (extent(along.x), extent(along.y));
    let (tx, ty) = (
        math::round_to_i32(along.x * 4096.0),
        math::round_to_i32(along.y * 4096.0),
    );
    let half = math::round_to_i32(4.0 * piece.half);
    let quarter_mm =
        |cell: i32, middle: f32| math::round_to_i32((cell as f32 + 0.5 - middle) * cell_mm * 4.0);
    let clip = |cell: i32, side: u16| cell.max(0).min(i32::from(side) - 1);
    let first_x = clip(math::round_to_i32(mx - rx - 0.5), shape.width());
    let last_x = clip(math::round_to_i32(mx + rx - 0.5), shape.width());
    let first_y = clip(math::round_to_i32(my - ry - 0.5), shape.height());
    let last_y = clip(math::round_to_i32(my + ry - 0.5), shape.height());
    for y in first_y..=last_y {
        let dy = quarter_mm(y, my);
        for x in first_x..=last_x {
            let dx = quarter_mm(x, mx);
            let across = (tx.wrapping_mul(dy) - ty.wrapping_mul(dx)) >> 12;
            let on = ((tx.wrapping_mul(dx) + ty.wrapping_mul(dy)) >> 12).abs() - half;
            let beyond = if on > 0 { on } else { 0 };
            let square = (across * across + beyond * beyond) as u32 >> 4;
            let byte = profile.byte(square);
            if byte > profile.scale().unexplored {
                canvas.raise(x, y, byte);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Bearing;

    #[test]
    fn half_the_angle_of_a_direction() {
        for (x, y, expected) in [
            (1.0, 0.0, (1.0, 0.0)),
            (-1.0, 0.0, (0.0, 1.0)),
            (
                0.0,
                1.0,
                (
                    core::f32::consts::FRAC_1_SQRT_2,
                    core::f32::consts::FRAC_1_SQRT_2,
                ),
            ),
            (
                0.0,
                -1.0,
                (
                    core::f32::consts::FRAC_1_SQRT_2,
                    -core::f32::consts::FRAC_1_SQRT_2,
                ),
            ),
            (0.0, 0.0, (1.0, 0.0)),
        ] {
            let half = principal(x, y);
            assert!(
                (half.x - expected.0).abs() < 1e-6 && (half.y - expected.1).abs() < 1e-6,
                "({x}, {y}): {half:?}"
            );
        }
    }

    #[test]
    fn pieces_lie_on_their_wall_and_end_at_a_jump() {
        // A wall at x = 2 m, then one at 5 m: 1° apart.
        let points: heapless::Vec<ScanPoint, 16> = (-6i16..6)
            .map(|k| {
                let bearing = Bearing((k * 182) as u16);
                let x = if k < 0 { 2000.0 } else { 5000.0 };
                let (_, c) = math::sin_cos(bearing.radians());
                ScanPoint::at(bearing, (x / c) as u16)
            })
            .collect();
        for (index, x) in [(0, 2000.0), (5, 2000.0), (6, 5000.0), (11, 5000.0)] {
            // Points are whole millimetres: 1 mm over a piece of 100 mm.
            let piece = piece(&points, index, &DrawConfig::DEFAULT).expect("a point");
            assert!((piece.middle.x - x).abs() < 1.5, "{index}: {piece:?}");
            assert!(
                piece.along.x.abs() < 0.02 && piece.half > 10.0,
                "{index}: {piece:?}"
            );
        }
        assert_eq!(piece(&points, 12, &DrawConfig::DEFAULT), None);
    }
}
