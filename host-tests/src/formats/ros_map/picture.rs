//! The picture of a ROS map: PGM, PNG or BMP.

use std::io::Cursor;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use beamfix::grid::Shape;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::formats::bytes;

/// Most pixels: twice the 4000 x 4000 that mappers begin with.
const MAX_PIXELS: u64 = 1 << 25;
/// Larger files are no such picture (bytes).
const MAX_FILE: u64 = 1 << 28;

/// A pixel from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Mean of its colours: 0 black, 1 white.
    pub shade: f64,
    /// Opacity, where the picture has one.
    pub alpha: Option<f64>,
}

impl Pixel {
    /// The grey that map savers write for unknown.
    pub const UNKNOWN: Self = Self {
        shade: 205.0 / 255.0,
        alpha: None,
    };
}

/// A picture in memory: grey, or colours with or without opacity, in 16 bits.
pub struct Picture(DynamicImage);

impl Picture {
    /// Reads a file; what is not one, or larger than any map, is an error before it is in memory.
    pub fn read(path: &Path) -> Result<Self> {
        let name = || path.display().to_string();
        let kind = std::fs::metadata(path).with_context(name)?;
        ensure!(kind.is_file(), "{}: not a file", path.display());
        let content = bytes::load_at_most(path, MAX_FILE)?;
        Self::parse(&content.bytes).with_context(name)
    }

    /// Reads a file's bytes.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
        // PGM values up to another largest one than 255 or 65535 are scaled by the decoder.
        let is_known = matches!(
            reader.format(),
            Some(ImageFormat::Pnm | ImageFormat::Png | ImageFormat::Bmp)
        );
        ensure!(
            is_known,
            "not a PGM, PNG or BMP picture: it starts with {:?}",
            head(bytes)
        );
        Ok(Self(decoded(reader.into_decoder().map_err(plain)?)?))
    }

    /// Pixels in a row.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.0.width()
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.0.height()
    }

    /// The pixel in a column and a row, from the upper left corner.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> Pixel {
        let share = |value: u16| f64::from(value) / 65_535.0;
        match &self.0 {
            DynamicImage::ImageLuma16(grey) => Pixel {
                shade: share(grey.get_pixel(x, y).0[0]),
                alpha: None,
            },
            DynamicImage::ImageRgba16(colours) => {
                let [r, g, b, alpha] = colours.get_pixel(x, y).0;
                Pixel {
                    shade: (share(r) + share(g) + share(b)) / 3.0,
                    alpha: Some(share(alpha)),
                }
            }
            other => {
                let colours = other.as_rgb16();
                let [r, g, b] = colours.map_or([0; 3], |colours| colours.get_pixel(x, y).0);
                Pixel {
                    shade: (share(r) + share(g) + share(b)) / 3.0,
                    alpha: None,
                }
            }
        }
    }
}

/// Decodes a picture of a size that a map may have.
fn decoded(decoder: impl ImageDecoder) -> Result<DynamicImage> {
    let (width, height) = decoder.dimensions();
    let sides = 1..=Shape::MAX_SIDE;
    ensure!(
        sides.contains(&width)
            && sides.contains(&height)
            && u64::from(width) * u64::from(height) <= MAX_PIXELS,
        "a picture of {width} x {height} pixels: at most {MAX_PIXELS}, and {} a side",
        Shape::MAX_SIDE
    );
    let image = DynamicImage::from_decoder(decoder).map_err(plain)?;
    let colour = image.color();
    Ok(match (colour.has_color(), colour.has_alpha()) {
        (false, false) => DynamicImage::ImageLuma16(image.into_luma16()),
        (true, false) => DynamicImage::ImageRgb16(image.into_rgb16()),
        (_, true) => DynamicImage::ImageRgba16(image.into_rgba16()),
    })
}

fn plain(error: image::ImageError) -> anyhow::Error {
    anyhow::anyhow!("the picture cannot be read, it may be cut off: {error}")
}

fn head(bytes: &[u8]) -> String {
    let start = bytes.get(..8).unwrap_or(bytes);
    start.escape_ascii().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shades(bytes: &[u8]) -> Vec<f64> {
        let picture = Picture::parse(bytes).unwrap_or_else(|error| panic!("{error:#}"));
        let columns = 0..picture.width();
        columns.map(|x| picture.pixel(x, 0).shade).collect()
    }

    #[test]
    fn pgm_is_read_plain_and_raw_with_any_largest_value() {
        for bytes in [
            &b"P5\n# a remark\n3 1\n255\n\x00\x33\xff"[..],
            b"P2\n3 1\n255\n0 51 255\n",
            b"P2\n3 1\n100\n0 20 100\n",
            b"P5\n3 1\n100\n\x00\x14\x64",
            b"P5\n3 1\n1000\n\x00\x00\x00\xc8\x03\xe8",
            b"P2\n3 1\n65535\n0 13107 65535\n",
        ] {
            let found = shades(bytes);
            let right = [0.0, 0.2, 1.0];
            // Scaled to 8 or 16 bits, and rounded there.
            let fits = found
                .iter()
                .zip(right)
                .all(|(a, b)| (a - b).abs() < 0.5 / 255.0);
            assert!(fits && found.len() == 3, "{found:?}: {}", head(bytes));
        }
    }

    #[test]
    fn png_and_bmp_are_read_with_their_opacity() {
        let image =
            image::RgbaImage::from_fn(2, 1, |x, _| image::Rgba([204, 204, 204, 255 * x as u8]));
        let grey = image::GrayImage::from_fn(2, 1, |_, _| image::Luma([51]));
        let mut png = Cursor::new(Vec::new());
        image.write_to(&mut png, ImageFormat::Png).expect("memory");
        let picture = Picture::parse(png.get_ref()).expect("a PNG");
        let pixel = |x| picture.pixel(x, 0);
        assert_eq!((pixel(0).alpha, pixel(1).alpha), (Some(0.0), Some(1.0)));
        assert!((pixel(0).shade - 0.8).abs() < 1e-9);
        let mut bmp = Cursor::new(Vec::new());
        grey.write_to(&mut bmp, ImageFormat::Bmp).expect("memory");
        assert!((shades(bmp.get_ref())[1] - 0.2).abs() < 1e-9);
    }

    #[test]
    fn pictures_that_cannot_be_are_refused_before_they_fill_the_memory() {
        for (bytes, word) in [
            (&b"P5\n40000 25000\n255\n"[..], "40000 x 25000"),
            (b"P5\n8000 8000\n255\n", "8000 x 8000"),
            (b"P5\n4 4\n255\nabc", "cut off"),
            (b"P5\n0 4\n255\n", "0 x 4"),
            (b"GIF89a", "GIF89a"),
            (b"", "PGM"),
        ] {
            let Err(error) = Picture::parse(bytes) else {
                panic!("read: {}", head(bytes));
            };
            let text = format!("{error:#}");
            assert!(text.contains(word) && text.lines().count() == 1, "{text}");
        }
    }
}
