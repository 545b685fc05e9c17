//! Following a beam through a grid: cell by cell, or in leaps as far as the distance transform allows.
//!
//! Both ways walk exactly the same cells (Amanatides, Woo 1987, with the crossings counted by whole columns of
//! the longer axis), so they find the same one.

use super::{Grid, Shape};
use crate::{
    geometry::{Point, Pose},
    math,
    scan::Bearing,
};

/// What a beam meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hit {
    /// Column and row of the cell.
    pub cell: (i32, i32),
    /// Its byte.
    pub byte: u8,
    /// Distance along the beam to the foot of the cell's middle (m).
    pub range: f32,
}

/// A straight way through a grid from a cell of it on.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Where it starts (cells).
    start: Point,
    /// Unit vector.
    direction: Point,
    /// Cell at the current column's entry.
    x: i32,
    y: i32,
    /// Signs of the steps.
    step_x: i32,
    step_y: i32,
    /// Columns run along y.
    steep: bool,
    /// What the crossing gains a column, and what makes a whole cell: `gain` ≤ `whole` < 2²⁶.
    gain: i32,
    whole: i32,
    /// Crossing of the current column's far side, in `0..whole + gain`: the next cell aside from `whole` on.
    crossing: i32,
    /// Cells per millimetre.
    per_mm: f32,
}

impl Ray {
    /// From `map_from_lidar` in the direction `bearing`; `None` where the lidar is off the grid.
    #[must_use]
    pub fn new(shape: &Shape, map_from_lidar: Pose, bearing: Bearing) -> Option<Self> {
        let start = shape.cells_at(Point::new(map_from_lidar.x, map_from_lidar.y));
        let (x, y) = (super::floor(start.x), super::floor(start.y));
        shape.index(x, y)?;
        let heading = Bearing::from_radians(map_from_lidar.theta - shape.origin().theta);
        let (dy, dx) = math::sin_cos_q15(heading.0.wrapping_add(bearing.0));
        // Odd 2048ths of a cell: never on an edge, and the same distance from it whichever way it is counted.
        let inside = |place: f32, cell: i32| {
            let part = ((place - cell as f32) * 1024.0) as i32;
            2 * part.clamp(0, 1023) + 1
        };
        let to_far_side = |part: i32, d: i32| if d < 0 { part } else { 2048 - part };
        let (ax, ay) = (
            to_far_side(inside(start.x, x), dx),
            to_far_side(inside(start.y, y), dy),
        );
        let (dx_abs, dy_abs) = (dx.abs(), dy.abs());
        let steep = dy_abs > dx_abs;
        let (along, aside, left_along, left_aside) = if steep {
            (dy_abs, dx_abs, ay, ax)
        } else {
            (dx_abs, dy_abs, ax, ay)
        };
        Some(Self {
            start,
            direction: Point::new(dx as f32 / 32767.0, dy as f32 / 32767.0),
            x,
            y,
            step_x: if dx < 0 { -1 } else { 1 },
            step_y: if dy < 0 { -1 } else { 1 },
            steep,
            gain: 2048 * aside,
            whole: 2048 * along,
            crossing: (2048 - left_aside) * along + left_along * aside,
            per_mm: 0.001 / shape.resolution(),
        })
    }

    /// The cell `range_mm` along the way; it may be off the grid.
    #[must_use]
    pub fn cell_at(&self, range_mm: u16) -> (i32, i32) {
        let length = f32::from(range_mm) * self.per_mm;
        (
            super::floor(self.start.x + length * self.direction.x),
            super::floor(self.start.y + length * self.direction.y),
        )
    }

    /// The cells on the way, from the first on, until the foot of their middle is farther than `range_mm`.
    pub fn cells(&mut self, range_mm: u16) -> impl Iterator<Item = (i32, i32)> + '_ {
        let limit = f32::from(range_mm) * self.per_mm;
        let mut aside = None;
        core::iter::from_fn(move || {
            let cell = match aside.take() {
                Some(cell) => cell,
                None => {
                    let cell = (self.x, self.y);
                    aside = self.next_column();
                    cell
                }
            };
            (self.foot(cell) <= limit).then_some(cell)
        })
    }

    /// Distance (cells) along the way to the foot of the cell's middle.
    fn foot(&self, cell: (i32, i32)) -> f32 {
        let (x, y) = (
            cell.0 as f32 + 0.5 - self.start.x,
            cell.1 as f32 + 0.5 - self.start.y,
        );
        x * self.direction.x + y * self.direction.y
    }

    /// Moves to the next column; the cell beside the entry where the way crosses this column's side.
    fn next_column(&mut self) -> Option<(i32, i32)> {
        let aside = (self.crossing >= self.whole).then(|| {
            self.crossing -= self.whole;
            self.move_aside(1);
            (self.x, self.y)
        });
        self.crossing += self.gain;
        self.move_along(1);
        aside
    }

    /// Moves `columns` ≤ 31 on at once.
    fn skip(&mut self, columns: i32) {
        // `crossing` < 2²⁷ here and 31 gains < 2³¹ − 2²⁷: the entry of the current column lies one gain back.
        let total = self.crossing + (columns - 1) * self.gain;
        let cells = total.checked_div(self.whole).unwrap_or(0);
        self.crossing = total - cells * self.whole + self.gain;
        self.move_aside(cells);
        self.move_along(columns);
    }

    fn move_along(&mut self, cells: i32) {
        if self.steep {
            self.y += cells * self.step_y;
        } else {
            self.x += cells * self.step_x;
        }
    }

    fn move_aside(&mut self, cells: i32) {
        if self.steep {
            self.x += cells * self.step_x;
        } else {
            self.y += cells * self.step_y;
        }
    }
}

/// First cell within `range_mm` that `stops` a beam, looked for cell by cell; `None` where there is none, the
/// way leaves the grid first or starts off it.
pub fn exact<S: AsRef<[u8]>>(
    grid: &Grid<S>,
    map_from_lidar: Pose,
    bearing: Bearing,
    range_mm: u16,
    stops: impl Fn(u8) -> bool,
) -> Option<Hit> {
    let mut ray = Ray::new(grid.shape(), map_from_lidar, bearing)?;
    let foot = ray;
    for cell in ray.cells(range_mm) {
        let byte = grid.get(cell.0, cell.1)?;
        if stops(byte) {
            return Some(foot.hit(cell, byte, grid.shape()));
        }
    }
    None
}

impl Ray {
    fn hit(&self, cell: (i32, i32), byte: u8, shape: &Shape) -> Hit {
        Hit {
            cell,
            byte,
            range: math::max(self.foot(cell), 0.0) * shape.resolution(),
        }
    }
}

/// A grid together with the distances (whole cells, rounded down) from each of its cells to the nearest that
/// stops a beam: see [`super::distance::roots`].
#[derive(Debug, Clone, Copy)]
pub struct Skipping<'a> {
    grid: Grid<&'a [u8]>,
    distances: &'a [u8],
}

impl<'a> Skipping<'a> {
    /// `None` unless there is one distance a cell.
    #[must_use]
    pub fn new(grid: Grid<&'a [u8]>, distances: &'a [u8]) -> Option<Self> {
        (grid.cells().len() == distances.len()).then_some(Self { grid, distances })
    }

    /// First cell within `range_mm` that stops a beam, as [`exact`] finds it, in leaps over what is free.
    ///
    /// A few leaps in a furnished flat, where `exact` looks at dozens of cells.
    #[must_use]
    pub fn cast(&self, map_from_lidar: Pose, bearing: Bearing, range_mm: u16) -> Option<Hit> {
        let shape = self.grid.shape();
        let mut ray = Ray::new(shape, map_from_lidar, bearing)?;
        let foot = ray;
        let limit = f32::from(range_mm) * ray.per_mm;
        loop {
            let cell = (ray.x, ray.y);
            let distance = i32::from(*self.distances.get(shape.index(cell.0, cell.1)?)?);
            if distance == 0 {
                return self.within(&foot, cell, limit);
            }
            // Points up to `columns`·√2 on lie in cells up to that and √2 away: all nearer than `distance`.
            let columns = ((distance * 46_340) >> 16) - 1;
            if columns >= 1 {
                ray.skip(if columns > 31 { 31 } else { columns });
            } else if let Some(aside) = ray.next_column() {
                let index = shape.index(aside.0, aside.1)?;
                if *self.distances.get(index)? == 0 {
                    return self.within(&foot, aside, limit);
                }
            }
            if foot.foot((ray.x, ray.y)) > limit + 2.0 {
                return None;
            }
        }
    }

    fn within(&self, foot: &Ray, cell: (i32, i32), limit: f32) -> Option<Hit> {
        let byte = self.grid.get(cell.0, cell.1)?;
        (foot.foot(cell) <= limit).then(|| foot.hit(cell, byte, self.grid.shape()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_visits_every_cell_it_crosses() {
        let shape = Shape::new(6, 6, 1.0, Pose::IDENTITY).expect("good");
        let mut ray = Ray::new(
            &shape,
            Pose::new(0.5, 0.5, 0.0),
            Bearing::from_radians(0.463_647_6),
        )
        .expect("inside");
        // Slope one half from the middle of the first cell: sides are crossed at (1.5, 1) and (3.5, 2).
        let mut cells = ray.cells(4000);
        for expected in [(0, 0), (1, 0), (1, 1), (2, 1), (3, 1), (3, 2)] {
            assert_eq!(cells.next(), Some(expected));
        }
    }

    #[test]
    fn ranges_count_to_the_middle_of_the_cell() {
        let shape = Shape::new(8, 1, 0.5, Pose::IDENTITY).expect("good");
        let grid = Grid::new(shape, [0, 0, 0, 0, 0, 9, 0, 0]).expect("fits");
        let at = Pose::new(0.5, 0.25, 0.0);
        let hit = exact(&grid, at, Bearing(0), 4000, |b| b == 9).expect("a wall");
        assert_eq!((hit.cell, hit.byte), ((5, 0), 9));
        assert!((hit.range - 2.25).abs() < 1e-3, "{hit:?}");
        assert_eq!(exact(&grid, at, Bearing(0), 2000, |b| b == 9), None);
        assert_eq!(exact(&grid, at, Bearing(32768), 4000, |b| b == 9), None);
        assert_eq!(
            exact(&grid, Pose::new(-1.0, 0.0, 0.0), Bearing(0), 4000, |b| b
                == 9),
            None
        );
    }
}
