//! What all pictures share: text, legends, axes in metres with one scale.

use anyhow::{Result, anyhow};
use beamfix::linalg::Covariance;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::{FONT, colour};

/// A chart in metres.
pub type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Dark text of `size` pixels.
#[must_use]
pub fn ink(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&colour::INK)
}

/// A drawing error as the tool's.
pub fn fail(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("drawing: {error}")
}

/// Title, caption and legend at the top of an area; 116 pixels.
pub fn header<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    left: i32,
    title: &str,
    caption: &str,
    legend: &[(&str, RGBColor, u32)],
) -> Result<()>
where
    B::ErrorType: 'static,
{
    area.draw_text(title, &ink(30), (left, 12)).map_err(fail)?;
    area.draw_text(caption, &ink(21), (left, 50))
        .map_err(fail)?;
    let mut x = left;
    for &(name, colour, width) in legend {
        let line = PathElement::new([(x, 96), (x + 30, 96)], colour.stroke_width(width));
        area.draw(&line).map_err(fail)?;
        area.draw_text(name, &ink(19), (x + 38, 86)).map_err(fail)?;
        let size = (FONT, 19).into_font().box_size(name);
        x += 66 + size.map_or(10 * name.len() as i32, |(width, _)| width as i32);
    }
    Ok(())
}

/// A chart that shows at least `low`..`high` (m), both axes with the same scale; gives its limits too.
pub fn metres<'a, B: DrawingBackend>(
    area: &'a DrawingArea<B, Shift>,
    low: [f64; 2],
    high: [f64; 2],
    caption: &str,
) -> Result<(Chart<'a, B>, [std::ops::Range<f64>; 2])>
where
    B::ErrorType: 'static,
{
    const LABELS: (u32, u32) = (96, 50);
    let title = if caption.is_empty() { 0 } else { 36 };
    let (width, height) = area.dim_in_pixel();
    let plot = (
        width.saturating_sub(LABELS.0 + 20),
        height.saturating_sub(LABELS.1 + 20 + title),
    );
    let [x, y] = equal(low, high, plot);
    let mut builder = ChartBuilder::on(area);
    builder
        .margin_left(8)
        .margin_right(20)
        .margin_top(20)
        .x_label_area_size(LABELS.1)
        .y_label_area_size(LABELS.0);
    if !caption.is_empty() {
        builder.caption(caption, ink(22));
    }
    let mut chart = builder
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(fail)?;
    // As many digits as two labels need to differ.
    let labels = (plot.0 as usize / 110, plot.1 as usize / 90);
    let step = (x.end - x.start) / labels.0.max(1) as f64;
    let digits = digits(step).max(1);
    let label = |value: &f64| number(*value, digits);
    chart
        .configure_mesh()
        .x_desc("x (m)")
        .y_desc("y (m)")
        .axis_desc_style(ink(20))
        .label_style(ink(18))
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(228, 228, 228))
        .x_labels(labels.0)
        .y_labels(labels.1)
        .draw()
        .map_err(fail)?;
    Ok((chart, [x, y]))
}

/// How many decimals labels so far apart need to differ.
#[must_use]
pub fn digits(step: f64) -> usize {
    libm::ceil(-libm::log10(step.max(1e-9))).max(0.0) as usize
}

/// A label; a rounding error below zero would be written as -0.
#[must_use]
pub fn number(value: f64, digits: usize) -> String {
    let value = if value.abs() < 1e-9 { 0.0 } else { value };
    format!("{value:.digits$}")
}

/// The closed line that holds 95 % of the positions, 2.45 standard deviations, so many times as large.
#[must_use]
pub fn ellipse(centre: [f64; 2], covariance: Covariance, scale: f64) -> Vec<[f64; 2]> {
    let (xx, xy, yy) = (
        f64::from(covariance.0.xx),
        f64::from(covariance.0.xy),
        f64::from(covariance.0.yy),
    );
    // Cholesky: the unit circle becomes the ellipse.
    let a = libm::sqrt(xx.max(0.0));
    let b = if a > 0.0 { xy / a } else { 0.0 };
    let c = libm::sqrt((yy - b * b).max(0.0));
    (0..=72)
        .map(|k| {
            let angle = core::f64::consts::TAU * f64::from(k) / 72.0;
            let (u, v) = (libm::cos(angle), libm::sin(angle));
            let [u, v] = [u, v].map(|side| 2.4477 * scale * side);
            [centre[0] + a * u, centre[1] + b * u + c * v]
        })
        .collect()
}

/// Limits (m) that give both axes the same scale in `size` pixels.
fn equal(low: [f64; 2], high: [f64; 2], size: (u32, u32)) -> [std::ops::Range<f64>; 2] {
    let pixels = [f64::from(size.0.max(1)), f64::from(size.1.max(1))];
    let scales = [0, 1].map(|k| (high[k] - low[k]) / pixels[k]);
    let scale = scales[0].max(scales[1]).max(1e-7) * 1.06;
    std::array::from_fn(|k| {
        let middle = 0.5 * (low[k] + high[k]);
        let half = 0.5 * scale * pixels[k];
        middle - half..middle + half
    })
}

/// Corners of the smallest box around `places`; a square metre around the origin if there are none.
pub fn bounds(places: impl Iterator<Item = [f64; 2]>) -> ([f64; 2], [f64; 2]) {
    let around = |(low, high): ([f64; 2], [f64; 2]), place: [f64; 2]| {
        (
            std::array::from_fn(|k| low[k].min(place[k])),
            std::array::from_fn(|k| high[k].max(place[k])),
        )
    };
    let (low, high) = places.fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), around);
    if low[0] > high[0] {
        ([-0.5; 2], [0.5; 2])
    } else {
        (low, high)
    }
}

/// A line drawn piece by piece, without the pieces outside `limits`.
///
/// Long polylines cross themselves, which the bitmap backend fills badly.
pub fn line<B: DrawingBackend>(
    chart: &mut Chart<'_, B>,
    limits: &[std::ops::Range<f64>; 2],
    places: &[[f64; 2]],
    style: impl Into<ShapeStyle>,
) -> Result<()>
where
    B::ErrorType: 'static,
{
    let style = style.into();
    let inside = |p: &[f64; 2]| limits[0].contains(&p[0]) && limits[1].contains(&p[1]);
    let pieces = places
        .windows(2)
        .filter(|piece| piece.iter().all(inside))
        .map(|piece| {
            PathElement::new(
                [(piece[0][0], piece[0][1]), (piece[1][0], piece[1][1])],
                style,
            )
        });
    chart.draw_series(pieces).map_err(fail)?;
    Ok(())
}

/// Dots of `size` pixels, without those outside `limits`.
pub fn dots<B: DrawingBackend>(
    chart: &mut Chart<'_, B>,
    limits: &[std::ops::Range<f64>; 2],
    places: impl Iterator<Item = [f64; 2]>,
    size: u32,
    style: impl Into<ShapeStyle>,
) -> Result<()>
where
    B::ErrorType: 'static,
{
    let style = style.into();
    let inside = |p: &[f64; 2]| limits[0].contains(&p[0]) && limits[1].contains(&p[1]);
    let series = places
        .filter(inside)
        .map(|p| Circle::new((p[0], p[1]), size, style));
    chart.draw_series(series).map_err(fail)?;
    Ok(())
}
