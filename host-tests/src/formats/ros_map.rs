//! Maps as ROS's `map_server` keeps them: a YAML file beside a picture (PGM, PNG or BMP).
//!
//! `image`, `resolution` (m), `origin` (`[x, y, yaw]` of the lower left corner), `negate`, `occupied_thresh`,
//! `free_thresh`, and `mode`: `trinary` (the default), `scale` or `raw`. The picture's first row is the map's last.

pub mod header;
pub mod picture;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use beamfix::geometry::Pose;
use beamfix::grid::{Grid, Shape, distance, occupancy};

use beamfix_sim::world::World;

use self::header::Header;
use self::picture::{Picture, Pixel};

/// A map in memory: [`occupancy`] bytes.
pub type Map = Grid<Vec<u8>>;

/// Maps of more cells than this are cropped to what is known, where that is less than half.
const LARGE: usize = 1 << 20;
/// Unknown cells that a cropped map keeps around what is known: as far as a field reaches from a wall, 1 m at 5 cm.
const BORDER: i32 = 20;

/// Reads a map; an error says which file is wrong, and how.
pub fn read(yaml: &Path) -> Result<Map> {
    read_remarking(yaml, &mut Vec::new())
}

/// The files that a map is read from: the YAML file, and the picture that it names.
#[must_use]
pub fn files(yaml: &Path) -> Vec<PathBuf> {
    let mut files = vec![yaml.to_owned()];
    // What is no map is said when it is read.
    if let Ok(header) = Header::read(yaml) {
        files.push(yaml.parent().unwrap_or(Path::new("")).join(&header.image));
    }
    files
}

/// [`read`], with remarks of one line each about what is odd.
pub fn read_remarking(yaml: &Path, remarks: &mut Vec<String>) -> Result<Map> {
    let name = || yaml.display().to_string();
    let header = Header::read(yaml)?;
    let image = yaml.parent().unwrap_or(Path::new("")).join(&header.image);
    let picture = Picture::read(&image)?;
    let map = of_picture(&header, &picture).with_context(name)?;
    if header.frees_the_unknown() {
        let columns = 0..picture.width();
        let is_unknown = |x, y| picture.pixel(x, y).shade == Pixel::UNKNOWN.shade;
        let count: usize = columns
            .map(|x| (0..picture.height()).filter(|&y| is_unknown(x, y)).count())
            .sum();
        if count > 0 {
            remarks.push(format!(
                "{}: free_thresh {} makes {count} cells of grey 205 free, which map savers write for unknown: 0.196 keeps them unknown",
                yaml.display(),
                header.free
            ));
        }
    }
    let cropped = cropped(map)?;
    if (cropped.shape().width(), cropped.shape().height())
        != (picture.width() as u16, picture.height() as u16)
    {
        remarks.push(format!(
            "{}: {} x {} cells, cropped to the {} x {} around what is known",
            yaml.display(),
            picture.width(),
            picture.height(),
            cropped.shape().width(),
            cropped.shape().height()
        ));
    }
    Ok(cropped)
}

fn of_picture(header: &Header, picture: &Picture) -> Result<Map> {
    let [x, y, yaw] = header.origin;
    let shape = Shape::new(
        picture.width(),
        picture.height(),
        header.resolution,
        Pose::new(x, y, yaw),
    )?;
    let mut cells = Vec::with_capacity(shape.len());
    for row in (0..picture.height()).rev() {
        cells.extend((0..picture.width()).map(|x| header.byte(picture.pixel(x, row))));
    }
    Ok(Map::new(shape, cells)?)
}

/// A large map without the unknown cells around it.
fn cropped(map: Map) -> Result<Map> {
    let shape = *map.shape();
    let (width, height) = (i32::from(shape.width()), i32::from(shape.height()));
    if shape.len() <= LARGE {
        return Ok(map);
    }
    let (mut low, mut high) = ([width, height], [0, 0]);
    for (k, &byte) in map.cells().iter().enumerate() {
        if byte != occupancy::UNKNOWN {
            let at = [k as i32 % width, k as i32 / width];
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis] + 1);
            }
        }
    }
    let ends = [width, height];
    for axis in 0..2 {
        low[axis] = (low[axis] - BORDER).max(0);
        high[axis] = (high[axis] + BORDER).min(ends[axis]);
    }
    let sides = [high[0] - low[0], high[1] - low[1]];
    if sides.iter().any(|side| *side <= 0) || 2 * sides[0] * sides[1] > width * height {
        return Ok(map);
    }
    let step = |cells: i32| cells as f32 * shape.resolution();
    let corner = shape.origin() * Pose::new(step(low[0]), step(low[1]), 0.0);
    let part = Shape::new(sides[0] as u32, sides[1] as u32, shape.resolution(), corner)?;
    let mut cells = Vec::with_capacity(part.len());
    for y in low[1]..high[1] {
        let start = (y * width + low[0]) as usize;
        cells.extend_from_slice(&map.cells()[start..start + sides[0] as usize]);
    }
    Ok(Map::new(part, cells)?)
}

/// Writes a map as `path` and, beside it, a picture of the same name with `.pgm`: trinary.
pub fn write(map: &Map, path: &Path) -> Result<PathBuf> {
    let image = path.with_extension("pgm");
    let shape = map.shape();
    let name = image
        .file_name()
        .and_then(|name| name.to_str())
        .context("a map needs a file name")?;
    let Pose { x, y, theta } = shape.origin();
    let yaml = format!(
        "image: {name}\nmode: trinary\nresolution: {}\norigin: [{x}, {y}, {theta}]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        shape.resolution()
    );
    let mut pgm =
        format!("P5\n# beamfix\n{} {}\n255\n", shape.width(), shape.height()).into_bytes();
    for row in map.cells().chunks(usize::from(shape.width())).rev() {
        pgm.extend(row.iter().map(|&byte| match occupancy::cell(byte) {
            occupancy::Cell::Free => 254,
            occupancy::Cell::Occupied => 0,
            occupancy::Cell::Unknown => 205u8,
        }));
    }
    fs::write(&image, pgm).with_context(|| image.display().to_string())?;
    fs::write(path, yaml).with_context(|| path.display().to_string())?;
    Ok(image)
}

/// The squared distances (cells²) from each cell to the nearest one that `stops` a beam.
pub fn squares(map: &Map, stops: impl Fn(u8) -> bool) -> Vec<u16> {
    let mut squares = vec![0; map.shape().len()];
    let mut scratch = Box::new(distance::Scratch::<{ Shape::MAX_SIDE as usize }>::new());
    distance::squared(map.shape(), map.cells(), stops, &mut squares, &mut scratch)
        .expect("buffers of the map's size");
    squares
}

/// A simulated place as a map: occupied where a face crosses a cell, free where one gets to from `inside`.
pub fn of_world(
    world: &World,
    low: [f64; 2],
    high: [f64; 2],
    resolution: f32,
    inside: [f64; 2],
) -> Result<Map> {
    let side = |k: usize| libm::ceil((high[k] - low[k]) / f64::from(resolution) - 1e-6) as u32;
    let shape = Shape::new(
        side(0),
        side(1),
        resolution,
        Pose::new(low[0] as f32, low[1] as f32, 0.0),
    )?;
    let mut map = Map::new(shape, vec![occupancy::UNKNOWN; shape.len()])?;
    let sides = [shape.width(), shape.height()].map(i32::from);
    occupy(world, &mut map, [0, 0], sides);
    let start = shape.cell_of(beamfix::geometry::Point::new(
        inside[0] as f32,
        inside[1] as f32,
    ));
    let mut open = vec![start];
    while let Some((x, y)) = open.pop() {
        let Some(cell) = map
            .get_mut(x, y)
            .filter(|cell| **cell == occupancy::UNKNOWN)
        else {
            continue;
        };
        *cell = occupancy::FREE;
        open.extend([(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]);
    }
    Ok(map)
}

/// Makes the cells of a part occupied that a face crosses: the part from the cell `low` on, of so many columns and rows.
/// A part that no face is near is left out as a whole.
fn occupy(world: &World, map: &mut Map, low: [i32; 2], sides: [i32; 2]) {
    let shape = *map.shape();
    let [columns, rows] = sides;
    let [first, last] = [low, [low[0] + columns - 1, low[1] + rows - 1]].map(|[x, y]| {
        let middle = shape.middle_of(x, y);
        [f64::from(middle.x), f64::from(middle.y)]
    });
    // A face between two cells takes both: the floor must not leak through.
    let half = 0.5001 * f64::from(shape.resolution());
    let middle = [0, 1].map(|k| 0.5 * (first[k] + last[k]));
    let around = 0.5 * libm::hypot(last[0] - first[0], last[1] - first[1]);
    // Rounding to f32 moves middles of cells by far less than a twentieth of one.
    if world.clearance(middle) > around + 1.1 * half {
        return;
    }
    if columns == 1 && rows == 1 {
        if world.clearance(middle) <= half {
            *map.get_mut(low[0], low[1]).expect("on the map") = occupancy::OCCUPIED;
        }
        return;
    }
    let is_wide = columns >= rows;
    let (left, right) = if is_wide {
        ([columns / 2, rows], [columns - columns / 2, rows])
    } else {
        ([columns, rows / 2], [columns, rows - rows / 2])
    };
    let next = if is_wide {
        [low[0] + left[0], low[1]]
    } else {
        [low[0], low[1] + left[1]]
    };
    occupy(world, map, low, left);
    occupy(world, map, next, right);
}

#[cfg(test)]
mod tests {
    use super::*;
    use beamfix::geometry::Point;

    /// nav2 places cell (column, row from below) with its middle half a cell beyond the corner, turned by the yaw.
    #[test]
    fn cells_lie_where_nav2_puts_them() {
        let yaml = "image: m.pgm\nresolution: 0.5\norigin: [10, -4, 1.5707963]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";
        // Black is the lower left pixel's right neighbour.
        let pgm = b"P2\n3 2\n255\n254 254 254\n254 0 254\n";
        let header = Header::parse(yaml).expect("a header");
        let map = of_picture(&header, &Picture::parse(pgm).expect("a picture")).expect("a map");
        assert_eq!(map.get(1, 0), Some(occupancy::OCCUPIED));
        let middle = map.shape().middle_of(1, 0);
        // 0.75 m along the map's x, which points along the world's y, and 0.25 m along its own y.
        assert!(
            (middle.x - 9.75).abs() < 1e-5 && (middle.y + 3.25).abs() < 1e-5,
            "{middle:?}"
        );
        assert_eq!(map.shape().cell_of(Point::new(9.75, -3.25)), (1, 0));
    }

    #[test]
    fn large_maps_are_cropped_to_what_is_known_and_stay_in_place() {
        let shape = Shape::new(2000, 1500, 0.05, Pose::new(-50.0, -30.0, 0.3)).expect("a shape");
        let mut map = Map::new(shape, vec![occupancy::UNKNOWN; shape.len()]).expect("cells");
        for (x, y) in [(700, 400), (900, 650)] {
            *map.get_mut(x, y).expect("on the map") = occupancy::OCCUPIED;
        }
        let places = [(700, 400), (900, 650)].map(|(x, y)| shape.middle_of(x, y));
        let small = cropped(map).expect("a part");
        let part = small.shape();
        assert_eq!((part.width(), part.height()), (241, 291));
        for place in places {
            let (x, y) = part.cell_of(place);
            assert_eq!(small.get(x, y), Some(occupancy::OCCUPIED), "{place:?}");
            let off = part.middle_of(x, y);
            assert!((off.x - place.x).abs() < 1e-4 && (off.y - place.y).abs() < 1e-4);
        }
    }
}
