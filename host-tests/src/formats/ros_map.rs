//! Maps as ROS's `map_server` keeps them: a YAML file beside a PGM picture.
//!
//! `image`, `resolution` (m), `origin` (`[x, y, yaw]` of the lower left corner), `negate`, `occupied_thresh`,
//! `free_thresh`, and `mode`: `trinary` (the default), `scale` or `raw`. The picture's first row is the map's last.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use beamfix::geometry::Pose;
use beamfix::grid::{Grid, Shape, distance, occupancy};

use beamfix_sim::world::World;

/// A map in memory: [`occupancy`] bytes.
pub type Map = Grid<Vec<u8>>;

/// Widest and highest map that is read (cells).
pub const MAX_SIDE: usize = 4096;

/// Reads a map; an error says which file is wrong, and how.
pub fn read(yaml: &Path) -> Result<Map> {
    let text = fs::read_to_string(yaml).with_context(|| yaml.display().to_string())?;
    let header = Header::parse(&text).with_context(|| yaml.display().to_string())?;
    let image = yaml.parent().unwrap_or(Path::new("")).join(&header.image);
    let bytes = fs::read(&image).with_context(|| image.display().to_string())?;
    let picture = Picture::parse(&bytes).with_context(|| image.display().to_string())?;
    header
        .map(&picture)
        .with_context(|| yaml.display().to_string())
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
    // A face between two cells takes both: the floor must not leak through.
    let half = 0.5001 * f64::from(resolution);
    for y in 0..i32::from(shape.height()) {
        for x in 0..i32::from(shape.width()) {
            let middle = shape.middle_of(x, y);
            if world.clearance([f64::from(middle.x), f64::from(middle.y)]) <= half {
                *map.get_mut(x, y).expect("on the map") = occupancy::OCCUPIED;
            }
        }
    }
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

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Trinary,
    Scale,
    Raw,
}

#[derive(Debug)]
struct Header {
    image: String,
    resolution: f32,
    origin: [f32; 3],
    negate: bool,
    occupied: f64,
    free: f64,
    mode: Mode,
}

impl Header {
    fn parse(text: &str) -> Result<Self> {
        let value = |key: &str| {
            text.lines().find_map(|line| {
                let line = line.split(" #").next().unwrap_or(line);
                let (name, value) = line.split_once(':')?;
                (name.trim() == key).then(|| value.trim().trim_matches(['"', '\'']).to_owned())
            })
        };
        let needed = |key: &str| value(key).with_context(|| format!("no {key:?}"));
        let number = |key: &str, text: &str| -> Result<f64> {
            let number: f64 = text
                .trim()
                .parse()
                .with_context(|| format!("{key}: {text:?} is no number"))?;
            ensure!(number.is_finite(), "{key}: {text} is not finite");
            Ok(number)
        };
        let origin = needed("origin")?;
        let parts: Vec<&str> = origin.trim_matches(['[', ']']).split(',').collect();
        ensure!(
            parts.len() == 3,
            "origin: {origin} has {} numbers, not x, y and yaw",
            parts.len()
        );
        let mut place = [0.0; 3];
        for (place, part) in place.iter_mut().zip(&parts) {
            *place = number("origin", part)? as f32;
        }
        let threshold = |key: &str, default: f64| match value(key) {
            Some(text) => number(key, &text),
            None => Ok(default),
        };
        let (occupied, free) = (
            threshold("occupied_thresh", 0.65)?,
            threshold("free_thresh", 0.196)?,
        );
        ensure!(
            (0.0..=1.0).contains(&free) && (free..=1.0).contains(&occupied),
            "thresholds: free {free} and occupied {occupied} are not in order between 0 and 1"
        );
        let mode = match value("mode").as_deref() {
            None | Some("trinary") => Mode::Trinary,
            Some("scale") => Mode::Scale,
            Some("raw") => Mode::Raw,
            Some(other) => bail!("mode: {other:?} is none of trinary, scale and raw"),
        };
        let negate = match value("negate").as_deref() {
            None | Some("0" | "false") => false,
            Some("1" | "true") => true,
            Some(other) => bail!("negate: {other:?} is neither 0 nor 1"),
        };
        let image = needed("image")?;
        ensure!(!image.is_empty(), "image: no name");
        Ok(Self {
            image,
            resolution: number("resolution", &needed("resolution")?)? as f32,
            origin: place,
            negate,
            occupied,
            free,
            mode,
        })
    }

    fn map(&self, picture: &Picture) -> Result<Map> {
        let [x, y, yaw] = self.origin;
        let shape = Shape::new(
            picture.width as u32,
            picture.height as u32,
            self.resolution,
            Pose::new(x, y, yaw),
        )?;
        let mut cells = Vec::with_capacity(shape.len());
        for row in picture.pixels.chunks(picture.width).rev() {
            cells.extend(row.iter().map(|&pixel| self.byte(pixel, picture.most)));
        }
        Ok(Map::new(shape, cells)?)
    }

    /// The occupancy byte of a pixel.
    fn byte(&self, pixel: u16, most: u16) -> u8 {
        if self.mode == Mode::Raw {
            return match pixel {
                value @ 0..=100 => log_odds(f64::from(value) / 100.0),
                _ => occupancy::UNKNOWN,
            };
        }
        let light = f64::from(pixel) / f64::from(most);
        let probability = if self.negate { light } else { 1.0 - light };
        if probability > self.occupied {
            occupancy::OCCUPIED
        } else if probability < self.free {
            occupancy::FREE
        } else if self.mode == Mode::Scale {
            log_odds((probability - self.free) / (self.occupied - self.free).max(1e-9))
        } else {
            occupancy::UNKNOWN
        }
    }
}

fn log_odds(probability: f64) -> u8 {
    let p = probability.clamp(0.0005, 0.9995);
    let odds = libm::round(8.0 * libm::log(p / (1.0 - p))) as i32;
    (128 + 2 * odds).clamp(i32::from(occupancy::FREE), i32::from(occupancy::OCCUPIED)) as u8
}

/// A grey picture.
struct Picture {
    width: usize,
    height: usize,
    most: u16,
    pixels: Vec<u16>,
}

impl Picture {
    /// Binary (P5) and plain (P2) PGM.
    fn parse(bytes: &[u8]) -> Result<Self> {
        let mut at = 0;
        let kind = word(bytes, &mut at).unwrap_or_default();
        ensure!(
            kind == "P5" || kind == "P2",
            "not a PGM picture: it starts with {:?}",
            head(bytes)
        );
        let mut field = |name: &str| -> Result<usize> {
            let text = word(bytes, &mut at)
                .with_context(|| format!("the picture ends before its {name}"))?;
            text.parse()
                .with_context(|| format!("the picture's {name} {text:?} is no number"))
        };
        let (width, height, most) = (field("width")?, field("height")?, field("largest value")?);
        ensure!(
            (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height),
            "a picture of {width} x {height} pixels: each side must be 1 to {MAX_SIDE}"
        );
        ensure!(
            (1..=65_535).contains(&most),
            "largest value {most}: it must be 1 to 65535"
        );
        let count = width * height;
        let pixels: Vec<u16> = if kind == "P2" {
            let mut pixels = Vec::with_capacity(count);
            while pixels.len() < count {
                let Some(text) = word(bytes, &mut at) else {
                    break;
                };
                pixels.push(
                    text.parse()
                        .with_context(|| format!("pixel {} is {text:?}", pixels.len()))?,
                );
            }
            pixels
        } else {
            // One white-space character after the header.
            let data = bytes.get(at + 1..).unwrap_or(&[]);
            if most > 255 {
                data.chunks_exact(2)
                    .take(count)
                    .map(|pair| u16::from_be_bytes([pair[0], pair[1]]))
                    .collect()
            } else {
                data.iter()
                    .take(count)
                    .map(|&byte| u16::from(byte))
                    .collect()
            }
        };
        ensure!(
            pixels.len() == count,
            "the picture is cut off: {} of {width} x {height} = {count} pixels",
            pixels.len()
        );
        Ok(Self {
            width,
            height,
            most: most as u16,
            pixels,
        })
    }
}

/// The next word of a PGM's header, over comments.
fn word(bytes: &[u8], at: &mut usize) -> Option<String> {
    while let Some(&byte) = bytes.get(*at) {
        if byte == b'#' {
            *at += bytes[*at..]
                .iter()
                .position(|&b| b == b'\n')
                .unwrap_or(bytes.len() - *at);
        } else if byte.is_ascii_whitespace() {
            *at += 1;
        } else {
            break;
        }
    }
    let rest = bytes.get(*at..)?;
    let length = rest
        .iter()
        .position(u8::is_ascii_whitespace)
        .unwrap_or(rest.len())
        .min(20);
    *at += length;
    (length > 0).then(|| String::from_utf8_lossy(&rest[..length]).into_owned())
}

fn head(bytes: &[u8]) -> String {
    let mut text = String::new();
    for byte in bytes.iter().take(8) {
        let _ = write!(text, "{}", byte.escape_ascii());
    }
    text
}
