//! A field from scans: every beam's end raises the cells around it, measured from the surface itself.
//!
//! Not from the middle of the cell it falls into: that costs a third of a cell. Each end is the middle of a
//! short straight piece laid through its neighbours on the same surface, so range noise averages out too.

use super::Profile;
use crate::{
    config::{self, ConfigError},
    geometry::{Point, Pose},
    grid::Shape,
    math,
    scan::{
        ScanPoint,
        surface::{Fit, Gap},
    },
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
    /// Two beams' ends at most this far apart always belong together (m). Default 0.04.
    pub max_gap: f32,
    /// And so do ends at most so many times their distance on a wall seen head-on. Default 4: 75° of incidence.
    pub max_slant: u16,
    /// A piece is laid through neighbours that lie within this of it (m). Default 0.03: three times a range's σ.
    pub max_deviation: f32,
}

impl DrawConfig {
    /// For lidars with 1 cm of range noise.
    pub const DEFAULT: Self = Self {
        neighbours: 3,
        max_gap: 0.04,
        max_slant: 4,
        max_deviation: 0.03,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("neighbours", self.neighbours as f32, 1.0, 64.0),
            config::within("max_gap", self.max_gap, 0.0, 10.0),
            config::within("max_slant", self.max_slant as f32, 0.0, 100.0),
            config::within("max_deviation", self.max_deviation, 0.001, 1.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for DrawConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// [`DrawConfig`] in the points' unit.
struct Limits {
    neighbours: usize,
    gap: Gap,
    /// mm.
    deviation: f32,
}

impl Limits {
    fn of(config: &DrawConfig) -> Self {
        Self {
            neighbours: config.neighbours,
            gap: Gap {
                mm: u32::from(math::to_mm(config.max_gap)),
                slope: u32::from(config.max_slant),
                // 11°.
                widest: 2048,
            },
            deviation: 1000.0 * config.max_deviation,
        }
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
    let limits = Limits::of(config);
    let mut last: Option<Piece> = None;
    for index in 0..points.len() {
        let Some(piece) = piece(points, index, &limits) else {
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
fn piece(points: &[ScanPoint], index: usize, limits: &Limits) -> Option<Piece> {
    let here = points.get(index)?;
    let at = |point: &ScanPoint| Point::new(f32::from(point.x), f32::from(point.y));
    let alone = Piece {
        middle: at(here),
        along: Point::new(1.0, 0.0),
        half: 0.0,
    };
    let joined = |pair: &&[ScanPoint]| matches!(pair, [a, b] if limits.gap.joins_points(a, b));
    let mut reach = limits.neighbours;
    while reach > 0 {
        let right = points.get(..=index)?.windows(2).rev().take(reach);
        let left = points.get(index..)?.windows(2).take(reach);
        let first = index - right.take_while(joined).count();
        let last = index + left.take_while(joined).count();
        let run = points.get(first..=last)?;
        if run.len() < 2 {
            return Some(slanted(points, index, limits).unwrap_or(alone));
        }
        if let Some(piece) = line_through(run, here, limits.deviation) {
            return Some(piece);
        }
        reach /= 2;
    }
    Some(alone)
}

/// A wall seen at so flat an angle that its beams lie far apart: the point is in line with both its neighbours.
fn slanted(points: &[ScanPoint], index: usize, limits: &Limits) -> Option<Piece> {
    let run = points.get(index.checked_sub(1)?..=index + 1)?;
    let piece = line_through(run, points.get(index)?, limits.deviation)?;
    Some(Piece { half: 1.0, ..piece })
}

/// The line through a run, cut to the part around `here`; `None` where a point is off it.
fn line_through(run: &[ScanPoint], here: &ScanPoint, deviation: f32) -> Option<Piece> {
    let fit = Fit::through(run, here)?;
    let mut longest = 0.0;
    for point in run {
        let place = fit.place(point, here);
        if math::abs(place.y) > deviation {
            return None;
        }
        longest = math::max(longest, math::abs(place.x));
    }
    // The point's own place on the line; the piece reaches half-way to its neighbours.
    let foot = fit.place(here, here).x;
    let (x, y) = (f32::from(here.x), f32::from(here.y));
    Some(Piece {
        middle: Point::new(
            x + fit.middle.x + foot * fit.along.x,
            y + fit.middle.y + foot * fit.along.y,
        ),
        along: fit.along,
        half: longest / (run.len() as f32 - 1.0),
    })
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
    // Off the canvas there is nothing to raise: these end before they begin.
    let first = |middle: f32, reach: f32| math::round_to_i32(middle - reach - 0.5).max(0);
    let last = |middle: f32, reach: f32, side: u16| {
        math::round_to_i32(middle + reach - 0.5).min(i32::from(side) - 1)
    };
    let (first_x, last_x) = (first(mx, rx), last(mx, rx, shape.width()));
    let (first_y, last_y) = (first(my, ry), last(my, ry, shape.height()));
    // Farther than any reach, and its square fits twice.
    let farthest = 40_000;
    for y in first_y..=last_y {
        let dy = quarter_mm(y, my);
        for x in first_x..=last_x {
            let dx = quarter_mm(x, mx);
            let across = (tx.wrapping_mul(dy) - ty.wrapping_mul(dx)) >> 12;
            let on = ((tx.wrapping_mul(dx) + ty.wrapping_mul(dy)) >> 12).abs() - half;
            let (off, beyond) = (across.abs().min(farthest), on.clamp(0, farthest));
            let square = ((off * off) as u32 + (beyond * beyond) as u32) >> 4;
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
    use crate::{scan::Bearing, sensor_model::likelihood_field::FieldModel};

    /// Counts the cells that are raised.
    struct Counted(Shape, u32);

    impl Canvas for Counted {
        fn shape(&self) -> &Shape {
            &self.0
        }

        fn raise(&mut self, _: i32, _: i32, _: u8) {
            self.1 += 1;
        }
    }

    #[test]
    fn ends_off_the_canvas_raise_nothing_however_far_and_long_the_pieces() {
        let shape = Shape::new(40, 40, 0.05, Pose::IDENTITY).expect("small");
        let profile = Profile::new(&FieldModel::DEFAULT);
        // Beams 0.1° and 10° apart, 0.4 m to 32 m long: pieces of 1 mm to some metres.
        for (step, range) in [(18u16, 400u16), (18, 32_000), (1820, 4000), (1820, 32_000)] {
            let points: heapless::Vec<ScanPoint, 16> = (0..16u16)
                .map(|k| ScanPoint::at(Bearing(k * step), range))
                .collect();
            for metres in [1.0f32, 5.0, 11.0, 12.0, 20.0, 40.0, 90.0] {
                for heading in [0.0, 0.7, 2.0, 3.1, -1.5] {
                    // The whole fan lies beyond the left edge, farther than a piece and the field around it reach.
                    let away = -metres - 33.0 - 8.0;
                    let mut canvas = Counted(shape, 0);
                    let pose = Pose::new(away, 1.0, heading);
                    scan(&mut canvas, &points, pose, &profile, &DrawConfig::DEFAULT);
                    assert_eq!(canvas.1, 0, "{step} {range} {metres} {heading}");
                    let near = Pose::new(1.0, 1.0, heading);
                    scan(&mut canvas, &points, near, &profile, &DrawConfig::DEFAULT);
                    assert!(range > 400 || canvas.1 > 0, "{step} {range} {heading}");
                }
            }
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
        let limits = Limits::of(&DrawConfig::DEFAULT);
        for (index, x) in [(0, 2000.0), (5, 2000.0), (6, 5000.0), (11, 5000.0)] {
            // Points are whole millimetres: 1 mm over a piece of 100 mm.
            let piece = piece(&points, index, &limits).expect("a point");
            assert!((piece.middle.x - x).abs() < 1.5, "{index}: {piece:?}");
            assert!(
                piece.along.x.abs() < 0.02 && piece.half > 10.0,
                "{index}: {piece:?}"
            );
        }
        assert_eq!(piece(&points, 12, &limits), None);
    }
}
