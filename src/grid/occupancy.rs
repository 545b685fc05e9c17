//! What is known about each cell: free, occupied or nothing, as log-odds in a byte.
//!
//! A cell's byte is 128 + 16·ln(p/(1−p)), even; bit 0 marks a cell while a scan is inserted. 128 is unknown.

use super::{Grid, cast::Ray};
use crate::{
    config::{self, ConfigError},
    geometry::Pose,
    math,
    scan::ScanPoint,
};

/// Nothing known: even odds.
pub const UNKNOWN: u8 = 128;
/// As surely occupied as a byte can say.
pub const OCCUPIED: u8 = 254;
/// As surely free as a byte can say.
pub const FREE: u8 = 2;

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cell {
    /// Nothing: a beam passes.
    Free,
    /// Something that returns a beam.
    Occupied,
    /// Not seen, or seen as both.
    Unknown,
}

/// What a byte says: occupied from a probability of 0.65 on, free up to 0.35, as `map_server` does by default.
#[must_use]
pub const fn cell(byte: u8) -> Cell {
    match byte {
        0..=118 => Cell::Free,
        138.. => Cell::Occupied,
        _ => Cell::Unknown,
    }
}

/// Whether a byte says occupied.
#[must_use]
pub const fn is_occupied(byte: u8) -> bool {
    matches!(cell(byte), Cell::Occupied)
}

/// Whether a byte says free.
#[must_use]
pub const fn is_free(byte: u8) -> bool {
    matches!(cell(byte), Cell::Free)
}

/// Makes each byte as sure as a byte can be of what it says: for maps that are to be compared or kept.
pub fn decide(bytes: &mut [u8]) {
    for byte in bytes {
        *byte = match cell(*byte) {
            Cell::Free => FREE,
            Cell::Occupied => OCCUPIED,
            Cell::Unknown => UNKNOWN,
        };
    }
}

/// What one look at a cell is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpdateConfig {
    /// Added where a beam ends (1/16 of log-odds, even). Default 14: p = 0.7.
    pub hit: u8,
    /// Taken off where a beam passes (1/16 of log-odds, even). Default 6: p = 0.4.
    pub miss: u8,
    /// Longest range that is entered, and longest way that is believed to be free (m). Default 12.0: an LD06.
    pub max_range: f32,
}

impl UpdateConfig {
    /// For lidars of about 12 m.
    pub const DEFAULT: Self = Self {
        hit: 14,
        miss: 6,
        max_range: 12.0,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("hit", self.hit as f32, 2.0, 126.0),
            config::within("miss", self.miss as f32, 2.0, 126.0),
            config::within("max_range", self.max_range, 0.1, 32.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for UpdateConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Enters a scan taken at `map_from_lidar`: occupied where beams end, free along them.
///
/// Each cell counts once a scan, however many beams meet it, and where one beam ends no other makes free, so
/// that walls seen at a grazing angle stay. Does nothing where the lidar
/// is off the grid or its pose is not finite. Returns the number of beams entered.
pub fn update<S: AsRef<[u8]> + AsMut<[u8]>>(
    grid: &mut Grid<S>,
    map_from_lidar: Pose,
    points: &[ScanPoint],
    config: &UpdateConfig,
) -> u16 {
    if !map_from_lidar.is_finite() {
        return 0;
    }
    let max_range_mm = math::to_mm(config.max_range);
    let (hit, miss) = (config.hit & !1, config.miss & !1);
    let shape = *grid.shape();
    let mut entered = 0;
    for point in points {
        if point.range > max_range_mm {
            continue;
        }
        let Some(end) =
            Ray::new(&shape, map_from_lidar, point.bearing).map(|ray| ray.cell_at(point.range))
        else {
            return entered;
        };
        entered += 1;
        if let Some(byte) = grid.get_mut(end.0, end.1).filter(|byte| **byte & 1 == 0) {
            let sum = byte.saturating_add(hit);
            *byte = (if sum > OCCUPIED { OCCUPIED } else { sum }) | 1;
        }
    }
    for point in points {
        let Some(mut ray) = Ray::new(&shape, map_from_lidar, point.bearing) else {
            break;
        };
        let range = if point.range > max_range_mm {
            max_range_mm
        } else {
            point.range
        };
        let end = ray.cell_at(range);
        for cell in ray.cells(range) {
            if cell == end {
                break;
            }
            let Some(byte) = grid.get_mut(cell.0, cell.1) else {
                break;
            };
            if *byte & 1 == 0 {
                let rest = byte.saturating_sub(miss);
                *byte = (if rest < FREE { FREE } else { rest }) | 1;
            }
        }
    }
    // Every marked cell lies on the way to a point: walking the ways again finds them all.
    for point in points {
        let Some(mut ray) = Ray::new(&shape, map_from_lidar, point.bearing) else {
            break;
        };
        let end = ray.cell_at(point.range);
        for cell in ray.cells(point.range) {
            let Some(byte) = grid.get_mut(cell.0, cell.1) else {
                break;
            };
            *byte &= !1;
        }
        if let Some(byte) = grid.get_mut(end.0, end.1) {
            *byte &= !1;
        }
    }
    entered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{grid::Shape, scan::Bearing};

    fn row() -> Grid<[u8; 10]> {
        let shape = Shape::new(10, 1, 0.1, Pose::IDENTITY).expect("good");
        Grid::new(shape, [UNKNOWN; 10]).expect("fits")
    }

    #[test]
    fn a_beam_frees_its_way_and_fills_its_end() {
        let mut grid = row();
        let ahead = ScanPoint::at(Bearing(0), 500);
        let entered = update(
            &mut grid,
            Pose::new(0.05, 0.05, 0.0),
            &[ahead, ahead],
            &UpdateConfig::DEFAULT,
        );
        assert_eq!(entered, 2);
        assert_eq!(
            grid.cells(),
            [122, 122, 122, 122, 122, 142, 128, 128, 128, 128]
        );
        assert_eq!(cell(grid.cells()[5]), Cell::Occupied);
        for _ in 0..40 {
            update(
                &mut grid,
                Pose::new(0.05, 0.05, 0.0),
                &[ahead],
                &UpdateConfig::DEFAULT,
            );
        }
        assert_eq!(grid.cells()[4..7], [FREE, OCCUPIED, UNKNOWN]);
    }

    #[test]
    fn beyond_the_range_and_off_the_grid_nothing_is_filled() {
        let mut grid = row();
        let config = UpdateConfig {
            max_range: 0.3,
            ..UpdateConfig::DEFAULT
        };
        let far = ScanPoint::at(Bearing(0), 700);
        assert_eq!(
            update(&mut grid, Pose::new(0.05, 0.05, 0.0), &[far], &config),
            0
        );
        assert_eq!(
            grid.cells(),
            [122, 122, 122, 128, 128, 128, 128, 128, 128, 128]
        );
        let before = *grid.cells().first_chunk::<10>().expect("ten");
        assert_eq!(
            update(&mut grid, Pose::new(-1.0, 0.05, 0.0), &[far], &config),
            0
        );
        assert_eq!(
            update(
                &mut grid,
                Pose {
                    x: f32::NAN,
                    ..Pose::IDENTITY
                },
                &[far],
                &config
            ),
            0
        );
        assert_eq!(grid.cells(), before);
    }
}
