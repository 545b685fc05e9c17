//! A field that rolls along with the robot: a square window of tiles, of which only those near surfaces take memory.

use super::{Field, Scale, Stencil, draw::Canvas};
use crate::{
    geometry::{Point, Pose},
    grid::{GridError, Shape},
    math,
};

/// Cells on a tile's side.
const SIDE: i32 = 8;
/// No tile here.
const NONE: u16 = u16::MAX;

/// Tiles of 8 by 8 cells in a window of I = n² places, from a pool of T: 68·T + 2·I bytes.
///
/// At 5 cm, I = 1600 is a window of 16 m and 3.2 KB; a furnished flat takes 250 to 420 tiles, 17 to 29 KB.
#[derive(Debug, Clone)]
pub struct Tiles<const T: usize, const I: usize> {
    shape: Shape,
    scale: Scale,
    /// Tiles on the window's side.
    side: i32,
    /// First tile of the window, counted from the map's origin.
    first: (i32, i32),
    /// Number in the pool, by place modulo the side.
    index: [u16; I],
    cells: [[u8; 64]; T],
    /// Which tile of the map each of the pool is; [`FREE`] where it is none.
    owner: [(i16, i16); T],
    /// Where to look for a free one next.
    next: usize,
    in_use: u16,
    dropped: u32,
}

const FREE: (i16, i16) = (i16::MIN, i16::MIN);

impl<const T: usize, const I: usize> Tiles<T, I> {
    /// An empty window around `middle`, cells of `resolution` metres.
    ///
    /// Fails unless I is a square of 2 or more, 1 ≤ T < 65 535 and the window is one that a [`Shape`] can be.
    pub fn new(resolution: f32, middle: Point, scale: Scale) -> Result<Self, GridError> {
        let side = math::isqrt(I as u32);
        if T == 0 || T >= usize::from(NONE) || side < 2 || (side * side) as usize != I {
            return Err(GridError::Storage {
                needed: (side * side) as usize,
                passed: I,
            });
        }
        let cells = side * SIDE as u32;
        let mut tiles = Self {
            shape: Shape::new(cells, cells, resolution, Pose::IDENTITY)?,
            scale,
            side: side as i32,
            first: (0, 0),
            index: [NONE; I],
            cells: [[scale.unexplored; 64]; T],
            owner: [FREE; T],
            next: 0,
            in_use: 0,
            dropped: 0,
        };
        super::Placement::check(&tiles.shape)?;
        tiles.roll(middle)?;
        Ok(tiles)
    }

    /// Moves the window so that `middle` is in its middle tile; what leaves it is forgotten.
    ///
    /// Fails for a place that is not finite or farther than 30 000 tiles away.
    pub fn roll(&mut self, middle: Point) -> Result<(), GridError> {
        let tile = self.shape.resolution() * SIDE as f32;
        let place = |at: f32| {
            let tiles = at / tile;
            (-30_000.0..30_000.0)
                .contains(&tiles)
                .then(|| math::round_to_i32(tiles) - self.side / 2)
        };
        let (Some(x), Some(y)) = (place(middle.x), place(middle.y)) else {
            return Err(GridError::Origin);
        };
        self.first = (x, y);
        for slot in 0..T {
            let Some(&owner) = self.owner.get(slot) else {
                break;
            };
            if owner != FREE && !self.inside(owner) {
                self.release(slot);
            }
        }
        let origin = Pose::new(x as f32 * tile, y as f32 * tile, 0.0);
        let cells = u32::from(self.shape.width());
        self.shape = Shape::new(cells, cells, self.shape.resolution(), origin)?;
        Ok(())
    }

    /// Forgets everything; the window stays.
    pub fn clear(&mut self) {
        self.index = [NONE; I];
        self.owner = [FREE; T];
        self.in_use = 0;
    }

    /// Tiles in use.
    #[must_use]
    pub fn in_use(&self) -> u16 {
        self.in_use
    }

    /// Tiles given up because the pool was empty: the farthest from the window's middle go first.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    fn inside(&self, tile: (i16, i16)) -> bool {
        let (x, y) = (
            i32::from(tile.0) - self.first.0,
            i32::from(tile.1) - self.first.1,
        );
        (0..self.side).contains(&x) && (0..self.side).contains(&y)
    }

    /// Place in the index of a tile of the map.
    fn place(&self, x: i32, y: i32) -> usize {
        let wrap = |k: i32| k.checked_rem_euclid(self.side).unwrap_or(0);
        (wrap(y) * self.side + wrap(x)) as usize
    }

    fn release(&mut self, slot: usize) {
        let Some(owner) = self.owner.get_mut(slot) else {
            return;
        };
        let (x, y) = (i32::from(owner.0), i32::from(owner.1));
        *owner = FREE;
        self.in_use = self.in_use.saturating_sub(1);
        let place = self.place(x, y);
        if let Some(entry) = self.index.get_mut(place) {
            *entry = NONE;
        }
    }

    /// A tile of the pool for a tile of the map; `None` where it would be the farthest of all.
    fn claim(&mut self, x: i32, y: i32) -> Option<usize> {
        if usize::from(self.in_use) >= T {
            let distance = |tile: (i32, i32)| {
                let (dx, dy) = (
                    2 * (tile.0 - self.first.0) + 1 - self.side,
                    2 * (tile.1 - self.first.1) + 1 - self.side,
                );
                dx * dx + dy * dy
            };
            let mut farthest = (0, distance((x, y)));
            let mut slot = None;
            for (k, owner) in self.owner.iter().enumerate() {
                let d = distance((i32::from(owner.0), i32::from(owner.1)));
                if d > farthest.1 {
                    farthest = (k, d);
                    slot = Some(k);
                }
            }
            self.dropped = self.dropped.wrapping_add(1);
            self.release(slot?);
        }
        for _ in 0..T {
            let slot = self.next;
            self.next = if slot + 1 < T { slot + 1 } else { 0 };
            let owner = self.owner.get_mut(slot)?;
            if *owner == FREE {
                *owner = (x as i16, y as i16);
                self.cells.get_mut(slot)?.fill(self.scale.unexplored);
                self.in_use += 1;
                let place = self.place(x, y);
                *self.index.get_mut(place)? = slot as u16;
                return Some(slot);
            }
        }
        None
    }

    /// Number in the pool of the tile of a cell of the window, and the cell's place in it.
    #[inline]
    fn find(&self, x: u32, y: u32) -> (Option<usize>, usize) {
        let width = u32::from(self.shape.width());
        if x >= width || y >= width {
            return (None, 0);
        }
        let place = self.place(
            self.first.0 + (x >> 3) as i32,
            self.first.1 + (y >> 3) as i32,
        );
        let slot = self.index.get(place).copied().unwrap_or(NONE);
        (
            (slot != NONE).then_some(usize::from(slot)),
            ((y & 7) * 8 + (x & 7)) as usize,
        )
    }
}

impl<const T: usize, const I: usize> Canvas for Tiles<T, I> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn raise(&mut self, x: i32, y: i32, byte: u8) {
        let width = i32::from(self.shape.width());
        if !(0..width).contains(&x) || !(0..width).contains(&y) {
            return;
        }
        let (slot, cell) = self.find(x as u32, y as u32);
        let slot = slot.or_else(|| self.claim(self.first.0 + (x >> 3), self.first.1 + (y >> 3)));
        let cells = slot.and_then(|slot| self.cells.get_mut(slot));
        if let Some(cell) = cells
            .and_then(|cells| cells.get_mut(cell))
            .filter(|cell| **cell < byte)
        {
            *cell = byte;
        }
    }
}

impl<const T: usize, const I: usize> Field for Tiles<T, I> {
    fn shape(&self) -> &Shape {
        &self.shape
    }

    fn scale(&self) -> &Scale {
        &self.scale
    }

    #[inline]
    fn byte(&self, x: u32, y: u32) -> u8 {
        let (slot, cell) = self.find(x, y);
        let cells = slot.and_then(|slot| self.cells.get(slot));
        cells
            .and_then(|cells| cells.get(cell))
            .copied()
            .unwrap_or(self.scale.unexplored)
    }

    fn stencil(&self, x: u32, y: u32) -> Option<Stencil> {
        let last = u32::from(self.shape.width()) - 1;
        if x == 0 || y == 0 || x >= last || y >= last {
            return None;
        }
        let at = |x: u32, y: u32| i32::from(self.byte(x, y));
        Some(Stencil {
            here: at(x, y),
            left: at(x - 1, y),
            right: at(x + 1, y),
            below: at(x, y - 1),
            above: at(x, y + 1),
            corner: at(x + 1, y + 1),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor_model::likelihood_field::FieldModel;

    fn tiles() -> Tiles<3, 16> {
        Tiles::new(0.1, Point::new(0.0, 0.0), FieldModel::DEFAULT.scale()).expect("a window")
    }

    #[test]
    fn cells_stay_where_they_are_while_the_window_rolls() {
        let mut tiles = tiles();
        let cell_at = |tiles: &Tiles<3, 16>, at: Point| {
            let (x, y) = Canvas::shape(tiles).cell_of(at);
            tiles.byte(x as u32, y as u32)
        };
        let place = Point::new(0.35, -0.25);
        let (x, y) = Canvas::shape(&tiles).cell_of(place);
        tiles.raise(x, y, 200);
        let unexplored = tiles.scale.unexplored;
        for (middle, expected) in [
            ((0.8, 0.0), 200),
            ((1.6, -0.8), 200),
            ((-0.4, 0.9), 200),
            ((4.0, 0.0), unexplored),
            ((0.0, 0.0), unexplored),
        ] {
            tiles.roll(Point::new(middle.0, middle.1)).expect("near");
            assert_eq!(cell_at(&tiles, place), expected, "{middle:?}");
        }
        assert_eq!(tiles.in_use(), 0);
        assert_eq!(
            tiles.roll(Point::new(f32::NAN, 0.0)),
            Err(GridError::Origin)
        );
    }

    #[test]
    fn an_empty_pool_gives_up_what_is_farthest() {
        let mut tiles = tiles();
        // Window of 32 cells; its middle is between the second and the third tile.
        for (x, y) in [(0, 0), (9, 9), (17, 9)] {
            tiles.raise(x, y, 150);
        }
        assert_eq!((tiles.in_use(), tiles.dropped()), (3, 0));
        tiles.raise(17, 17, 150);
        assert_eq!((tiles.in_use(), tiles.dropped()), (3, 1));
        assert_eq!(tiles.byte(0, 0), tiles.scale.unexplored);
        assert_eq!(tiles.byte(17, 17), 150);
        // Farther than all others: it is the one that goes.
        tiles.raise(31, 31, 150);
        assert_eq!(
            (tiles.dropped(), tiles.byte(31, 31)),
            (2, tiles.scale.unexplored)
        );
        tiles.clear();
        assert_eq!(
            (tiles.in_use(), tiles.byte(9, 9)),
            (0, tiles.scale.unexplored)
        );
    }

    #[test]
    fn a_window_that_is_no_square_is_refused() {
        let scale = FieldModel::DEFAULT.scale();
        let middle = Point::new(0.0, 0.0);
        assert!(matches!(
            Tiles::<3, 15>::new(0.1, middle, scale),
            Err(GridError::Storage { .. })
        ));
        assert!(matches!(
            Tiles::<0, 16>::new(0.1, middle, scale),
            Err(GridError::Storage { .. })
        ));
        assert!(matches!(
            Tiles::<3, 16>::new(0.0, middle, scale),
            Err(GridError::Resolution { .. })
        ));
    }
}
