//! What an error depends on: one small chart for each quantity, errors upwards in powers of ten.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::axes::{digits, fail, header, ink, number};
use super::{Drawing, colour};

/// One chart.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// What is changed, with its unit.
    pub name: String,
    /// Its values.
    pub values: Vec<f64>,
    /// The error (cm) at each value, of each of [`Sweeps::lines`].
    pub errors: Vec<Vec<f64>>,
}

/// What to draw.
#[derive(Debug, Clone)]
pub struct Sweeps {
    /// Title line.
    pub title: String,
    /// Line under the title.
    pub caption: String,
    /// What the lines of all charts are.
    pub lines: Vec<String>,
    /// The charts, three in a row.
    pub charts: Vec<Sweep>,
}

const HEADER: u32 = 116;
const COLUMNS: usize = 3;
const CHART: (u32, u32) = (520, 400);
const COLOURS: [RGBColor; 3] = [colour::RED, colour::BLUE, colour::GREEN];
/// Errors that are drawn (cm).
const RANGE: (f64, f64) = (0.1, 1000.0);

impl Sweeps {
    fn rows(&self) -> usize {
        self.charts.len().div_ceil(COLUMNS).max(1)
    }
}

impl Drawing for Sweeps {
    fn size(&self) -> (u32, u32) {
        let rows = self.rows() as u32;
        (CHART.0 * COLUMNS as u32, HEADER + CHART.1 * rows)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(HEADER);
        let lines = self.lines.iter().zip(COLOURS);
        let legend: Vec<_> = lines
            .clone()
            .map(|(name, colour)| (name.as_str(), colour, 3))
            .collect();
        header(&top, 30, &self.title, &self.caption, &legend)?;
        let panels = body.split_evenly((self.rows(), COLUMNS));
        for (sweep, panel) in self.charts.iter().zip(&panels) {
            let low = sweep.values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = sweep.values.iter().copied().fold(low, f64::max);
            let margin = 0.04 * (high - low);
            let mut chart = ChartBuilder::on(panel)
                .margin(12)
                .x_label_area_size(52)
                .y_label_area_size(70)
                .build_cartesian_2d(low - margin..high + margin, (RANGE.0..RANGE.1).log_scale())
                .map_err(fail)?;
            let x_digits = digits((high - low) / 5.0);
            chart
                .configure_mesh()
                .x_desc(&sweep.name)
                .y_desc("largest error (cm)")
                .axis_desc_style(ink(18))
                .label_style(ink(16))
                .x_labels(6)
                .y_labels(5)
                .x_label_formatter(&|value| number(*value, x_digits))
                .y_label_formatter(&|value| number(*value, digits(*value)))
                .light_line_style(TRANSPARENT)
                .bold_line_style(RGBColor(228, 228, 228))
                .draw()
                .map_err(fail)?;
            for (errors, colour) in sweep.errors.iter().zip(COLOURS) {
                let inside = |error: &f64| error.max(RANGE.0).min(RANGE.1);
                let errors = errors.iter().map(inside);
                let points: Vec<_> = sweep.values.iter().copied().zip(errors).collect();
                let line = LineSeries::new(points.iter().copied(), colour.stroke_width(2));
                chart.draw_series(line).map_err(fail)?;
                let dots = points
                    .iter()
                    .map(|point| Circle::new(*point, 4, colour.filled()));
                chart.draw_series(dots).map_err(fail)?;
            }
        }
        Ok(())
    }
}
