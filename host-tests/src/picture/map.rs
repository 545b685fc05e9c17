//! A map seen from above: walls, measured points, paths.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;

use super::{Drawing, FONT, colour, equal_axes};
use crate::sim::World;

/// A path with its name in the legend.
#[derive(Debug, Clone)]
pub struct Path {
    /// What it is.
    pub name: String,
    /// Its colour.
    pub colour: RGBColor,
    /// Width (pixels).
    pub width: u32,
    /// Corners (m).
    pub places: Vec<[f64; 2]>,
}

/// What to draw, all in one frame (m).
#[derive(Debug, Clone, Default)]
pub struct Map {
    /// Title line.
    pub title: String,
    /// Line under the title.
    pub caption: String,
    /// What really stands there, where that is known.
    pub world: Option<World>,
    /// What the lidar saw.
    pub points: Vec<[f64; 2]>,
    /// Paths, the first one lowest.
    pub paths: Vec<Path>,
}

const WIDTH: u32 = 1500;
const LABELS: (u32, u32) = (70, 50);
const HEADER: u32 = 116;

impl Map {
    /// Corners of what the picture shows: the world and the points, the paths where there is neither.
    fn limits(&self) -> ([f64; 2], [f64; 2]) {
        let corners = self
            .world
            .iter()
            .flat_map(|w| w.segments.iter().flat_map(|s| [s.from, s.to]));
        let seen: Vec<[f64; 2]> = corners.chain(self.points.iter().copied()).collect();
        let driven = self
            .paths
            .iter()
            .flat_map(|path| path.places.iter().copied());
        let shown = if seen.is_empty() {
            driven.collect()
        } else {
            seen
        };
        shown
            .iter()
            .fold(([0.0; 2], [0.5; 2]), |(low, high), place| {
                (
                    std::array::from_fn(|k| low[k].min(place[k])),
                    std::array::from_fn(|k| high[k].max(place[k])),
                )
            })
    }

    /// Names and colours of what is drawn, in one row.
    fn legend<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let walls = self.world.iter().map(|_| ("true walls", colour::INK, 2));
        let points = (!self.points.is_empty()).then_some((
            "measured points, placed by the estimate",
            colour::POINTS,
            5,
        ));
        let paths = self
            .paths
            .iter()
            .map(|path| (path.name.as_str(), path.colour, path.width));
        let mut x = LABELS.0 as i32;
        for (name, colour, width) in walls.chain(points).chain(paths) {
            let line = PathElement::new([(x, 96), (x + 30, 96)], colour.stroke_width(width));
            area.draw(&line).map_err(fail)?;
            area.draw_text(name, &ink(19), (x + 38, 86)).map_err(fail)?;
            x += 38 + width_of(name) + 28;
        }
        Ok(())
    }
}

impl Drawing for Map {
    fn size(&self) -> (u32, u32) {
        let (low, high) = self.limits();
        let shape = (high[1] - low[1]) / (high[0] - low[0]);
        let plot = f64::from(WIDTH - LABELS.0) * shape.clamp(0.4, 1.1);
        (WIDTH, plot as u32 + LABELS.1 + HEADER)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (width, height) = self.size();
        let (low, high) = self.limits();
        let plot = (width - LABELS.0 - 20, height - LABELS.1 - HEADER - 20);
        let [x, y] = equal_axes(low, high, plot);
        let inside = |p: &[f64; 2]| x.contains(&p[0]) && y.contains(&p[1]);
        let (header, body) = area.split_vertically(HEADER);
        header
            .draw_text(&self.title, &ink(30), (LABELS.0 as i32, 12))
            .map_err(fail)?;
        header
            .draw_text(&self.caption, &ink(21), (LABELS.0 as i32, 50))
            .map_err(fail)?;
        self.legend(&header)?;
        let mut chart = ChartBuilder::on(&body)
            .margin_right(20)
            .margin_top(20)
            .x_label_area_size(LABELS.1)
            .y_label_area_size(LABELS.0)
            .build_cartesian_2d(x.clone(), y.clone())
            .map_err(fail)?;
        chart
            .configure_mesh()
            .x_desc("x (m)")
            .y_desc("y (m)")
            .axis_desc_style(ink(20))
            .label_style(ink(18))
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(228, 228, 228))
            .x_labels(14)
            .y_labels(10)
            .draw()
            .map_err(fail)?;
        let dot = colour::POINTS.mix(0.35).filled();
        let points = self
            .points
            .iter()
            .filter(|p| inside(p))
            .map(|p| Circle::new((p[0], p[1]), 1, dot));
        chart.draw_series(points).map_err(fail)?;
        let world = self.world.iter();
        let faces = world
            .clone()
            .flat_map(|w| w.segments.iter().map(|s| vec![s.from, s.to]));
        let round = world.flat_map(|w| w.circles.iter().map(|c| ring(c.centre, c.radius)));
        for (line, colour, width) in faces.chain(round).map(|line| (line, colour::INK, 2)).chain(
            self.paths
                .iter()
                .map(|path| (path.places.clone(), path.colour, path.width)),
        ) {
            // Piece by piece: long polylines cross themselves, which the bitmap backend fills badly.
            let pieces = line
                .windows(2)
                .filter(|piece| piece.iter().all(inside))
                .map(|piece| {
                    PathElement::new(
                        [(piece[0][0], piece[0][1]), (piece[1][0], piece[1][1])],
                        colour.stroke_width(width),
                    )
                });
            chart.draw_series(pieces).map_err(fail)?;
        }
        Ok(())
    }
}

fn ink(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&colour::INK)
}

fn fail(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("drawing: {error}")
}

/// Width of a legend's text (pixels), near enough.
fn width_of(text: &str) -> i32 {
    let size = (FONT, 19).into_font().box_size(text);
    size.map_or(10 * text.len() as i32, |(width, _)| width as i32)
}

/// A circle as a closed line.
fn ring(centre: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    (0..=48)
        .map(|k| {
            let angle = core::f64::consts::TAU * f64::from(k) / 48.0;
            [
                centre[0] + radius * libm::cos(angle),
                centre[1] + radius * libm::sin(angle),
            ]
        })
        .collect()
}
