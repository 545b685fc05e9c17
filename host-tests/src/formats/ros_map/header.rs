//! The YAML file of a ROS map.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use beamfix::grid::occupancy;
use serde_json::{Map, Value};

use super::picture::Pixel;
use crate::formats::bytes;

/// How a picture's greys become occupancy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mode {
    /// Free, occupied or unknown.
    Trinary,
    /// Between the thresholds in shares.
    Scale,
    /// 0 to 100 percent as they stand.
    Raw,
}

/// What the file says.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The picture, relative to the file.
    pub image: String,
    /// Side of a cell (m).
    pub resolution: f32,
    /// Pose of the lower left corner (m, m, rad).
    pub origin: [f32; 3],
    /// White is occupied.
    pub negate: bool,
    /// Occupied from this share on.
    pub occupied: f64,
    /// Free up to this share.
    pub free: f64,
    /// How greys are read.
    pub mode: Mode,
}

/// Larger files are no map's (bytes).
const MAX_FILE: u64 = 1 << 20;

impl Header {
    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self> {
        let content = bytes::load_at_most(path, MAX_FILE)?;
        let text = String::from_utf8_lossy(&content.bytes);
        Self::parse(&text).with_context(|| path.display().to_string())
    }

    /// Reads a file's text.
    pub fn parse(text: &str) -> Result<Self> {
        let options = serde_saphyr::options! { with_snippet: false };
        let keys: Map<String, Value> = serde_saphyr::from_str_with_options(text, options)
            .map_err(|error| anyhow!("not the YAML of a map: {}", one_line(&error)))?;
        let needed = |key: &str| keys.get(key).with_context(|| format!("no {key:?}"));
        let threshold = |key: &str, default: f64| match keys.get(key) {
            Some(value) => number(key, value),
            None => Ok(default),
        };
        let origin = needed("origin")?;
        let parts = origin.as_array().map_or(&[][..], Vec::as_slice);
        ensure!(
            parts.len() == 3,
            "origin: {origin} has {} numbers, not x, y and yaw",
            parts.len()
        );
        let mut place = [0.0; 3];
        for (place, part) in place.iter_mut().zip(parts) {
            *place = number("origin", part)? as f32;
        }
        let (occupied, free) = (
            threshold("occupied_thresh", 0.65)?,
            threshold("free_thresh", 0.196)?,
        );
        ensure!(
            (0.0..=1.0).contains(&free) && (free..=1.0).contains(&occupied),
            "thresholds: free {free} and occupied {occupied} are not in order between 0 and 1"
        );
        let mode = keys.get("mode").map(text_of).unwrap_or_default();
        let mode = match mode.to_lowercase().as_str() {
            "" | "trinary" => Mode::Trinary,
            "scale" => Mode::Scale,
            "raw" => Mode::Raw,
            _ => bail!("mode: {mode:?} is none of trinary, scale and raw"),
        };
        let negate = keys.get("negate").map(text_of).unwrap_or_default();
        // YAML 1.1, which ROS reads, knows more words for it than YAML 1.2.
        let negate = match negate.to_lowercase().as_str() {
            "" | "0" | "false" | "no" | "off" => false,
            "1" | "true" | "yes" | "on" => true,
            _ => bail!("negate: {negate:?} is neither 0 nor 1"),
        };
        let image = text_of(needed("image")?);
        ensure!(!image.is_empty(), "image: no name");
        Ok(Self {
            image,
            resolution: number("resolution", needed("resolution")?)? as f32,
            origin: place,
            negate,
            occupied,
            free,
            mode,
        })
    }

    /// The occupancy byte of a pixel, as nav2's map server reads it.
    #[must_use]
    pub fn byte(&self, pixel: Pixel) -> u8 {
        // Its trinary mode averages the opacity in with the colours.
        let shade = match (self.mode, pixel.alpha) {
            (Mode::Trinary, Some(alpha)) => (3.0 * pixel.shade + alpha) / 4.0,
            _ => pixel.shade,
        };
        if self.mode == Mode::Raw {
            return match libm::round(255.0 * shade) {
                percent if percent <= 100.0 => log_odds(percent / 100.0),
                _ => occupancy::UNKNOWN,
            };
        }
        let is_see_through = pixel.alpha.is_some_and(|alpha| alpha < 1.0);
        let probability = if self.negate { shade } else { 1.0 - shade };
        if self.mode == Mode::Scale && is_see_through {
            occupancy::UNKNOWN
        } else if probability >= self.occupied {
            occupancy::OCCUPIED
        } else if probability <= self.free {
            occupancy::FREE
        } else if self.mode == Mode::Scale {
            log_odds((probability - self.free) / (self.occupied - self.free).max(1e-9))
        } else {
            occupancy::UNKNOWN
        }
    }

    /// Whether the grey that map savers write for unknown counts as free.
    #[must_use]
    pub fn frees_the_unknown(&self) -> bool {
        self.mode != Mode::Raw && !self.negate && self.byte(Pixel::UNKNOWN) == occupancy::FREE
    }
}

fn one_line(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.trim().to_owned(),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

/// A number, in quotes or not.
fn number(key: &str, value: &Value) -> Result<f64> {
    let text = text_of(value);
    let number: f64 = text
        .parse()
        .with_context(|| format!("{key}: {text:?} is no number"))?;
    ensure!(number.is_finite(), "{key}: {text} is not finite");
    Ok(number)
}

fn log_odds(probability: f64) -> u8 {
    let p = probability.clamp(0.0005, 0.9995);
    let odds = libm::round(8.0 * libm::log(p / (1.0 - p))) as i32;
    (128 + 2 * odds).clamp(i32::from(occupancy::FREE), i32::from(occupancy::OCCUPIED)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: &str = "image: map.pgm\nresolution: 0.05\norigin: [-10, -10, 0]\nnegate: 0\n\
                         occupied_thresh: 0.65\nfree_thresh: 0.196\n";

    #[test]
    fn every_way_to_write_a_map_in_yaml_is_the_same() {
        let plain = Header::parse(PLAIN).expect("plain");
        for (name, text) in [
            (
                "keys in quotes",
                PLAIN
                    .replace("image", "\"image\"")
                    .replace("origin", "'origin'"),
            ),
            (
                "values in quotes",
                PLAIN
                    .replace("0.05", "\"0.05\"")
                    .replace("map.pgm", "'map.pgm'"),
            ),
            (
                "a block list",
                PLAIN.replace(" [-10, -10, 0]", "\n- -10.0\n- -10.0\n- 0.0"),
            ),
            (
                "an indented block list",
                PLAIN.replace(" [-10, -10, 0]", "\n  - -10\n  - -1.0e1\n  - 0"),
            ),
            (
                "a flow mapping",
                "{image: map.pgm, resolution: 0.05, origin: [-10, -10, 0]}".into(),
            ),
            ("wrapped lines", PLAIN.replace("-10, -10,", "-10,\n  -10,")),
            (
                "an anchor",
                PLAIN.replace("[-10, -10, 0]", "&corner [-10, -10, 0]") + "again: *corner\n",
            ),
            ("a byte order mark", format!("\u{feff}{PLAIN}")),
            (
                "a tab before a remark",
                PLAIN.replace("0.05", "0.05\t# metres"),
            ),
            ("False", PLAIN.replace("negate: 0", "negate: False")),
            ("no", PLAIN.replace("negate: 0", "negate: no")),
            ("Trinary", PLAIN.replace("negate: 0", "mode: Trinary")),
            (
                "a nested key",
                format!("tool:\n  image: other.png\n  resolution: 9\n{PLAIN}"),
            ),
            ("Windows lines", PLAIN.replace('\n', "\r\n")),
        ] {
            let header = Header::parse(&text).unwrap_or_else(|error| panic!("{name}: {error:#}"));
            assert_eq!(header, plain, "{name}");
        }
    }

    #[test]
    fn what_is_no_map_is_refused_in_one_line() {
        for (text, word) in [
            ("", "origin"),
            ("[1, 2", "YAML"),
            ("image: a.pgm\norigin: [0, 0, 0]\n", "resolution"),
            (&PLAIN.replace("-10, -10, 0", "0, 0"), "2 numbers"),
            (&PLAIN.replace("0.65", ".nan"), "non-finite"),
            (&PLAIN.replace("0.65", "0.1"), "order"),
            (&PLAIN.replace("negate: 0", "negate: 7"), "negate"),
            (&PLAIN.replace("negate: 0", "mode: grey"), "mode"),
            (
                "a: &a [1,1,1,1,1,1,1,1]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b,*b,*b,*b]\n\
                 d: &d [*c,*c,*c,*c,*c,*c,*c,*c]\ne: &e [*d,*d,*d,*d,*d,*d,*d,*d]\nf: &f [*e,*e,*e,*e,*e,*e,*e,*e]\n\
                 g: &g [*f,*f,*f,*f,*f,*f,*f,*f]\nh: [*g,*g,*g,*g,*g,*g,*g,*g]\n",
                "YAML",
            ),
        ] {
            let error = format!("{:#}", Header::parse(text).expect_err(text));
            assert!(
                error.contains(word) && error.lines().count() == 1,
                "{error}"
            );
        }
    }

    #[test]
    fn greys_are_read_as_ros_reads_them() {
        let plain = Header::parse(PLAIN).expect("plain");
        let with = |text: &str| Header::parse(&format!("{PLAIN}{text}")).expect(text);
        let strict = Header::parse(&PLAIN.replace("0.65", "1.0")).expect("strict");
        let wide = Header::parse(&PLAIN.replace("0.196", "0.25")).expect("wide");
        let raw = with("mode: raw\n");
        let scale = with("mode: scale\n");
        let grey = |grey: f64| Pixel {
            shade: grey / 255.0,
            alpha: None,
        };
        let clear = |value: f64, alpha: f64| Pixel {
            alpha: Some(alpha),
            ..grey(value)
        };
        let (free, occupied, unknown) = (occupancy::FREE, occupancy::OCCUPIED, occupancy::UNKNOWN);
        for (name, header, pixel, expected) in [
            ("black", &plain, grey(0.0), occupied),
            ("white", &plain, grey(254.0), free),
            ("205", &plain, grey(205.0), unknown),
            ("black from 1.0 on", &strict, grey(0.0), occupied),
            ("nearly black from 1.0 on", &strict, grey(1.0), unknown),
            ("at the limit", &plain, grey(255.0 * 0.35), occupied),
            ("205 below 0.25", &wide, grey(205.0), free),
            ("see-through", &scale, clear(254.0, 0.0), unknown),
            ("opaque", &scale, clear(254.0, 1.0), free),
            ("half see-through", &scale, clear(254.0, 0.5), unknown),
            ("opaque in three values", &plain, clear(254.0, 1.0), free),
            (
                "see-through in three values",
                &plain,
                clear(254.0, 0.0),
                unknown,
            ),
            ("black in three values", &plain, clear(0.0, 1.0), occupied),
            ("raw 100", &raw, grey(100.0), log_odds(1.0)),
            ("raw 101", &raw, grey(101.0), unknown),
            ("raw 0", &raw, grey(0.0), log_odds(0.0)),
        ] {
            assert_eq!(header.byte(pixel), expected, "{name}");
        }
        assert!(wide.frees_the_unknown() && !plain.frees_the_unknown());
    }
}
