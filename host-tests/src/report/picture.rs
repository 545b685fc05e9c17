//! Pictures: PNG and SVG that need no font and no library of the system.

pub mod axes;
pub mod chart;
pub mod density;
pub mod heat;
pub mod map;
pub mod pair;
pub mod sweeps;

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Once;

use anyhow::{Context, Result, anyhow, bail};
use plotters::backend::{BitMapBackend, DrawingBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::prelude::SVGBackend;
use plotters::style::{FontStyle, RGBColor, WHITE, register_font};

/// The one font of all pictures.
pub const FONT: &str = "sans-serif";

/// Colours that stay apart on white, also for the colour-blind (Okabe and Ito).
pub mod colour {
    /// A colour.
    pub type Colour = super::RGBColor;
    use super::RGBColor;

    /// Walls and text.
    pub const INK: RGBColor = RGBColor(40, 40, 40);
    /// Measured points.
    pub const POINTS: RGBColor = RGBColor(86, 140, 190);
    /// Truth.
    pub const GREEN: RGBColor = RGBColor(0, 158, 115);
    /// Estimates.
    pub const RED: RGBColor = RGBColor(213, 70, 0);
    /// Wheel odometry, guesses.
    pub const ORANGE: RGBColor = RGBColor(230, 159, 0);
    /// References.
    pub const BLUE: RGBColor = RGBColor(0, 90, 178);
    /// What was rejected.
    pub const PURPLE: RGBColor = RGBColor(180, 90, 150);
}

/// A drawing on some surface: written once, drawn to PNG and SVG.
pub trait Drawing {
    /// Width and height (pixels).
    fn size(&self) -> (u32, u32);

    /// Draws everything on an empty white area.
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static;

    /// The same for a file of lines and shapes, where dots would make it large.
    fn draw_shapes<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        self.draw(area)
    }
}

/// How a picture is kept, by the ending of its file's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `.png`
    Png,
    /// `.svg`
    Svg,
}

impl Kind {
    /// Other endings are refused: a map or a log must not be drawn over.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().and_then(|ending| ending.to_str());
        match ending.map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Ok(Self::Png),
            Some("svg") => Ok(Self::Svg),
            _ => bail!("{}: a picture's name ends in .png or .svg", path.display()),
        }
    }
}

/// Draws into a file, whose name tells the [`Kind`].
pub fn save(drawing: &impl Drawing, path: &Path) -> Result<()> {
    let kind = Kind::of(path)?;
    use_font();
    let name = || path.display().to_string();
    let (width, height) = drawing.size();
    if kind == Kind::Svg {
        let mut text = String::new();
        let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
        area.fill(&WHITE)?;
        drawing.draw_shapes(&area)?;
        present(area)?;
        return std::fs::write(path, text).with_context(name);
    }
    let mut pixels = vec![0; 3 * width as usize * height as usize];
    fill(
        drawing,
        BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area(),
    )?;
    let image = image::RgbImage::from_raw(width, height, pixels).context("the picture's size")?;
    image
        .save_with_format(path, image::ImageFormat::Png)
        .with_context(name)
}

/// Draws an animation that runs for ever: a GIF of 216 colours, six steps of each part.
pub fn animate(frames: &[impl Drawing], path: &Path) -> Result<()> {
    /// How long a frame is shown, and how long the first and the last (10 ms).
    const SHOWN: (u16, u16) = (40, 150);
    let Some(first) = frames.first() else {
        bail!("{}: nothing to animate", path.display());
    };
    use_font();
    let name = || path.display().to_string();
    let part = |step: u8| 51 * step;
    let palette: Vec<u8> = (0..216)
        .flat_map(|k| [part(k / 36), part(k / 6 % 6), part(k % 6)])
        .collect();
    let (width, height) = first.size();
    let size = (u16::try_from(width)?, u16::try_from(height)?);
    let file = BufWriter::new(File::create(path).with_context(name)?);
    let mut encoder = gif::Encoder::new(file, size.0, size.1, &palette).with_context(name)?;
    encoder
        .set_repeat(gif::Repeat::Infinite)
        .with_context(name)?;
    for (k, frame) in frames.iter().enumerate() {
        let mut pixels = vec![0; 3 * width as usize * height as usize];
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        fill(frame, area)?;
        let step = |part: u8| (part.saturating_add(25)) / 51;
        let index = |rgb: &[u8]| 36 * step(rgb[0]) + 6 * step(rgb[1]) + step(rgb[2]);
        let is_end = k == 0 || k + 1 == frames.len();
        let frame = gif::Frame {
            width: size.0,
            height: size.1,
            delay: if is_end { SHOWN.1 } else { SHOWN.0 },
            buffer: pixels.chunks_exact(3).map(index).collect(),
            ..gif::Frame::default()
        };
        encoder.write_frame(&frame).with_context(name)?;
    }
    Ok(())
}

fn fill<B: DrawingBackend>(drawing: &impl Drawing, area: DrawingArea<B, Shift>) -> Result<()>
where
    B::ErrorType: 'static,
{
    area.fill(&WHITE)?;
    drawing.draw(&area)?;
    present(area)
}

fn present<B: DrawingBackend>(area: DrawingArea<B, Shift>) -> Result<()>
where
    B::ErrorType: 'static,
{
    area.present().map_err(|error| anyhow!("drawing: {error}"))
}

fn use_font() {
    static REGISTER: Once = Once::new();
    REGISTER.call_once(|| {
        // The bytes are compiled in; a failure would show as a picture that cannot be drawn.
        let _ = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        let _ = register_font(FONT, FontStyle::Bold, dejavu::sans::bold());
    });
}
