//! Errors over time.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::axes::{fail, header, ink};
use super::{Drawing, colour};

/// What to draw.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// Title line.
    pub title: String,
    /// Time (s), error of position (cm), error of heading (degrees).
    pub errors: Vec<(f64, f64, f64)>,
}

impl Drawing for Errors {
    fn size(&self) -> (u32, u32) {
        (1400, 560)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(116);
        let legend = [
            ("position (cm)", colour::RED, 3),
            ("heading (degrees)", colour::BLUE, 3),
        ];
        header(
            &top,
            70,
            &self.title,
            "error of the estimate against the truth after every scan",
            &legend,
        )?;
        let seconds = self.errors.last().map_or(1.0, |error| error.0);
        let highest = self
            .errors
            .iter()
            .fold(1.0f64, |most, &(_, cm, degrees)| most.max(cm).max(degrees));
        let mut chart = ChartBuilder::on(&body)
            .margin_right(24)
            .margin_left(8)
            .x_label_area_size(50)
            .y_label_area_size(70)
            .build_cartesian_2d(0.0..seconds, 0.0..1.05 * highest)
            .map_err(fail)?;
        chart
            .configure_mesh()
            .x_desc("time (s)")
            .y_desc("cm, degrees")
            .axis_desc_style(ink(20))
            .label_style(ink(18))
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(228, 228, 228))
            .draw()
            .map_err(fail)?;
        let position = self.errors.iter().map(|&(t, cm, _)| (t, cm));
        let heading = self.errors.iter().map(|&(t, _, degrees)| (t, degrees));
        chart
            .draw_series(LineSeries::new(heading, colour::BLUE.stroke_width(2)))
            .map_err(fail)?;
        chart
            .draw_series(LineSeries::new(position, colour::RED.stroke_width(2)))
            .map_err(fail)?;
        Ok(())
    }
}
