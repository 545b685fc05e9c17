//! A likelihood field seen from above.

use anyhow::Result;
use beamfix::geometry::Point;
use beamfix::sensor_model::likelihood_field::{LikelihoodField, stored};
use plotters::coord::Shift;
use plotters::prelude::*;

use super::Drawing;
use super::axes::{fail, header, line, metres};

/// What to draw.
pub struct Heat<'a> {
    /// Title line.
    pub title: String,
    /// Line under the title.
    pub caption: String,
    /// The field, in its map's frame.
    pub field: LikelihoodField<&'a [u8]>,
    /// Where a robot drove in it (m); may be empty.
    pub path: Vec<[f64; 2]>,
}

const WIDTH: u32 = 1500;
const HEADER: u32 = 116;
/// Where nothing is explored.
const UNEXPLORED: RGBColor = RGBColor(90, 100, 120);

/// Seen on black, red and yellow.
const PATH: RGBColor = RGBColor(0, 170, 230);

/// From black over red to a pale yellow, which is no paper, as a beam likes to end there.
fn glow(byte: u8) -> RGBColor {
    let part = |from: i32, most: i32| ((i32::from(byte) - from) * 3).clamp(0, most) as u8;
    RGBColor(part(0, 255), part(85, 255), part(170, 150))
}

impl Heat<'_> {
    /// Corners of the box around the map (m): its own axes may be turned.
    fn limits(&self) -> ([f64; 2], [f64; 2]) {
        let shape = self.field.grid().shape();
        let side = |cells: u16| f32::from(cells) * shape.resolution();
        let (width, height) = (side(shape.width()), side(shape.height()));
        let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
        super::axes::bounds(corners.into_iter().map(|(x, y)| {
            let corner = shape.origin() * Point::new(x, y);
            [corner.x.into(), corner.y.into()]
        }))
    }
}

impl Heat<'_> {
    /// What stands over the map; gives the area below it.
    fn head<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<DrawingArea<B, Shift>>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(HEADER);
        let path = (!self.path.is_empty()).then_some(("estimated path", PATH, 4));
        let legend: Vec<_> = [
            ("beams end here", glow(255), 12),
            ("near a surface", glow(120), 12),
            ("nothing near", glow(0), 12),
            ("unexplored", UNEXPLORED, 12),
        ]
        .into_iter()
        .chain(path)
        .collect();
        header(&top, 70, &self.title, &self.caption, &legend)?;
        Ok(body)
    }

    /// The colour of a cell's byte.
    fn colours(&self) -> impl Fn(u8) -> RGBColor {
        let unexplored = stored::header(&self.field)[5];
        move |byte| {
            if byte == unexplored {
                UNEXPLORED
            } else {
                glow(byte)
            }
        }
    }
}

impl Drawing for Heat<'_> {
    fn size(&self) -> (u32, u32) {
        let (low, high) = self.limits();
        let shape = (high[1] - low[1]) / (high[0] - low[0]).max(1e-6);
        (
            WIDTH,
            (f64::from(WIDTH - 90) * shape.clamp(0.3, 1.5)) as u32 + 70 + HEADER,
        )
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let body = self.head(area)?;
        let (low, high) = self.limits();
        let (mut chart, limits) = metres(&body, low, high, "")?;
        let [x_axis, y_axis] = &limits;
        let plot = chart.plotting_area();
        let (width, height) = plot.dim_in_pixel();
        let shape = self.field.grid().shape();
        let colour = self.colours();
        for row in 0..height {
            for column in 0..width {
                let along = |axis: &std::ops::Range<f64>, k: u32, of: u32| {
                    axis.start + (axis.end - axis.start) * (f64::from(k) + 0.5) / f64::from(of)
                };
                let (x, y) = (along(x_axis, column, width), along(y_axis, row, height));
                let (cell_x, cell_y) = shape.cell_of(Point::new(x as f32, y as f32));
                let Some(byte) = self.field.grid().get(cell_x, cell_y) else {
                    continue;
                };
                plot.draw_pixel((x, y), &colour(byte)).map_err(fail)?;
            }
        }
        line(&mut chart, &limits, &self.path, PATH.stroke_width(3))
    }

    /// A box for each run of cells of one colour in a row.
    fn draw_shapes<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let body = self.head(area)?;
        let (low, high) = self.limits();
        let (mut chart, limits) = metres(&body, low, high, "")?;
        let grid = self.field.grid();
        let shape = grid.shape();
        let side = shape.resolution();
        let colour = self.colours();
        let corner = |x: usize, y: usize| {
            let corner = shape.origin() * Point::new(x as f32 * side, y as f32 * side);
            (f64::from(corner.x), f64::from(corner.y))
        };
        let width = usize::from(shape.width());
        for (y, row) in grid.cells().chunks(width.max(1)).enumerate() {
            let mut x = 0;
            for run in row.chunk_by(|a, b| colour(*a) == colour(*b)) {
                let end = x + run.len();
                let corners = [(x, y), (end, y), (end, y + 1), (x, y + 1)];
                let corners: Vec<_> = corners.map(|(x, y)| corner(x, y)).into();
                let shape = Polygon::new(corners, colour(run[0]).filled());
                chart.draw_series([shape]).map_err(fail)?;
                x = end;
            }
        }
        line(&mut chart, &limits, &self.path, PATH.stroke_width(3))
    }
}
