//! Error and standard deviation over time: position above, heading below.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::axes::{digits, fail, header, ink, number};
use super::{Drawing, colour};
use crate::report::score::quantile;

/// What is known after a scan; position in cm, heading in degrees.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Row {
    /// Since the start (s).
    pub time: f64,
    /// Error of position and heading, where the truth is known.
    pub error: Option<(f64, f64)>,
    /// Standard deviation of position, in the direction in which it is largest, and of heading.
    pub sigma: Option<(f64, f64)>,
    /// Whether a match confirms the pose.
    pub is_measured: bool,
}

/// What to draw.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// Title line.
    pub title: String,
    /// What the error is.
    pub caption: String,
    /// One a scan.
    pub rows: Vec<Row>,
}

/// So many standard deviations are drawn: a good estimate is seldom farther off.
const SIGMAS: f64 = 2.0;
const HEADER: u32 = 116;

impl Errors {
    /// Whether there is anything to draw.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows
            .iter()
            .all(|row| row.error.is_none() && row.sigma.is_none())
    }

    fn panel<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        name: &str,
        of: fn((f64, f64)) -> f64,
    ) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let errors = series(&self.rows, |row| row.error.map(of));
        let sigmas = series(&self.rows, |row| row.sigma.map(|pair| SIGMAS * of(pair)));
        let last = self.rows.last().map_or(1.0, |row| row.time);
        let first = self.rows.first().map_or(0.0, |row| row.time);
        let all = |pieces: &[Vec<(f64, f64)>]| -> Vec<f64> {
            pieces.iter().flatten().map(|point| point.1).collect()
        };
        let (seen, stated) = (all(&errors), all(&sigmas));
        // Where a robot is lost, its standard deviation grows beyond all that is of interest.
        let usual = if stated.is_empty() {
            0.0
        } else {
            1.3 * quantile(&stated, 0.95)
        };
        let most = seen.iter().fold(usual, |most, &value| most.max(value));
        let most = if most > 0.0 { 1.08 * most } else { 1.0 };
        let mut chart = ChartBuilder::on(area)
            .margin_right(30)
            .margin_left(8)
            .margin_top(8)
            .x_label_area_size(52)
            .y_label_area_size(90)
            .build_cartesian_2d(first..last.max(first + 1e-3), 0.0..most)
            .map_err(fail)?;
        let (x_digits, y_digits) = (digits((last - first) / 12.0), digits(most / 6.0));
        chart
            .configure_mesh()
            .x_desc("time (s)")
            .y_desc(name)
            .axis_desc_style(ink(20))
            .label_style(ink(18))
            .x_labels(12)
            .y_labels(6)
            .x_label_formatter(&|value| number(*value, x_digits))
            .y_label_formatter(&|value| number(*value, y_digits))
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(228, 228, 228))
            .draw()
            .map_err(fail)?;
        for (pieces, colour) in [(sigmas, colour::BLUE), (errors, colour::RED)] {
            for piece in pieces {
                // A line that leaves the chart comes back where it left.
                let piece = piece.into_iter().map(|(t, value)| (t, value.min(most)));
                let line = LineSeries::new(piece, colour.stroke_width(2));
                chart.draw_series(line).map_err(fail)?;
            }
        }
        let refused = self.rows.iter().filter(|row| !row.is_measured);
        let marks = refused.map(|row| {
            PathElement::new(
                [(row.time, 0.0), (row.time, 0.05 * most)],
                colour::PURPLE.stroke_width(2),
            )
        });
        chart.draw_series(marks).map_err(fail)?;
        Ok(())
    }
}

/// The values over time, in pieces without gaps.
fn series(rows: &[Row], value: impl Fn(&Row) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = vec![Vec::new()];
    for row in rows {
        match value(row).filter(|value| value.is_finite()) {
            Some(value) => {
                if let Some(piece) = pieces.last_mut() {
                    piece.push((row.time, value));
                }
            }
            None => pieces.push(Vec::new()),
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

impl Drawing for Errors {
    fn size(&self) -> (u32, u32) {
        (1400, 860)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(HEADER);
        let has = |of: fn(&Row) -> bool| self.rows.iter().any(of);
        let legend: Vec<_> = [
            (has(|row| row.error.is_some()), "error", colour::RED),
            (
                has(|row| row.sigma.is_some()),
                "2 standard deviations, as stated",
                colour::BLUE,
            ),
            (
                has(|row| !row.is_measured),
                "no match of its own",
                colour::PURPLE,
            ),
        ]
        .into_iter()
        .filter_map(|(is_drawn, name, colour)| is_drawn.then_some((name, colour, 3)))
        .collect();
        header(&top, 98, &self.title, &self.caption, &legend)?;
        let (above, below) = body.split_vertically((860 - HEADER) / 2);
        self.panel(&above, "position (cm)", |pair| pair.0)?;
        self.panel(&below, "heading (degrees)", |pair| pair.1)
    }
}
