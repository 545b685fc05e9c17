//! A histogram with the density fitted to it, logarithmic upwards.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::axes::{fail, header, ink};
use super::{Drawing, colour};

/// What to draw: densities (1/m) in bins of `step` from `low` on (m).
#[derive(Debug, Clone, Default)]
pub struct Density {
    /// Title line.
    pub title: String,
    /// Line under the title.
    pub caption: String,
    /// Where the first bin starts (m).
    pub low: f64,
    /// Width of a bin (m).
    pub step: f64,
    /// Measured.
    pub data: Vec<f64>,
    /// Fitted.
    pub fitted: Vec<f64>,
}

/// Lowest density shown (1/m).
const FLOOR: f64 = 1e-4;

impl Drawing for Density {
    fn size(&self) -> (u32, u32) {
        (1300, 760)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(116);
        let legend = [("measured", colour::POINTS, 8), ("fitted", colour::RED, 3)];
        header(&top, 60, &self.title, &self.caption, &legend)?;
        let high = self.low + self.step * self.data.len() as f64;
        let most = self
            .data
            .iter()
            .chain(&self.fitted)
            .fold(1.0f64, |a, &b| if a > b { a } else { b });
        let mut chart = ChartBuilder::on(&body)
            .margin(20)
            .x_label_area_size(50)
            .y_label_area_size(80)
            .build_cartesian_2d(self.low..high, (FLOOR..2.0 * most).log_scale())
            .map_err(fail)?;
        chart
            .configure_mesh()
            .x_desc("measured less expected range (m)")
            .y_desc("density (1/m)")
            .label_style(ink(18))
            .axis_desc_style(ink(20))
            .draw()
            .map_err(fail)?;
        let bars = self
            .data
            .iter()
            .enumerate()
            .filter(|(_, value)| **value > FLOOR)
            .map(|(k, &value)| {
                let from = self.low + self.step * k as f64;
                Rectangle::new(
                    [(from, FLOOR), (from + 0.9 * self.step, value)],
                    colour::POINTS.filled(),
                )
            });
        chart.draw_series(bars).map_err(fail)?;
        let middles = self.fitted.iter().enumerate().map(|(k, &value)| {
            (
                self.low + self.step * (k as f64 + 0.5),
                if value > FLOOR { value } else { FLOOR },
            )
        });
        chart
            .draw_series(LineSeries::new(middles, colour::RED.stroke_width(3)))
            .map_err(fail)?;
        Ok(())
    }
}
