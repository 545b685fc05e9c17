//! A map seen from above: walls, measured points, paths.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::axes::{bounds, dots, header, line, metres};
use super::{Drawing, colour};
use beamfix_sim::World;

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
    /// How well the estimate is known along its path.
    pub ellipses: Option<Ellipses>,
}

/// Ellipses of one kind.
#[derive(Debug, Clone)]
pub struct Ellipses {
    /// What they are.
    pub name: String,
    /// Closed lines (m).
    pub shapes: Vec<Vec<[f64; 2]>>,
}

const WIDTH: u32 = 1500;
const HEADER: u32 = 116;
/// Fewer points are drawn large.
const FEW: usize = 4000;

impl Map {
    /// Corners of what the picture shows: the world and the points, the paths where there is neither.
    pub(crate) fn limits(&self) -> ([f64; 2], [f64; 2]) {
        let corners = self
            .world
            .iter()
            .flat_map(|w| w.segments.iter().flat_map(|s| [s.from, s.to]));
        let seen: Vec<[f64; 2]> = corners.chain(self.points.iter().copied()).collect();
        let driven = || {
            self.paths
                .iter()
                .flat_map(|path| path.places.iter().copied())
        };
        if seen.is_empty() {
            bounds(driven())
        } else {
            bounds(seen.into_iter())
        }
    }
}

impl Drawing for Map {
    fn size(&self) -> (u32, u32) {
        let (low, high) = self.limits();
        let shape = (high[1] - low[1]) / (high[0] - low[0]).max(1e-6);
        (
            WIDTH,
            (f64::from(WIDTH - 90) * shape.clamp(0.4, 1.1)) as u32 + 70 + HEADER,
        )
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(HEADER);
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
        let ellipses = self
            .ellipses
            .iter()
            .map(|all| (all.name.as_str(), colour::PURPLE, 2));
        let legend: Vec<_> = walls.chain(points).chain(paths).chain(ellipses).collect();
        header(&top, 70, &self.title, &self.caption, &legend)?;

        let (low, high) = self.limits();
        let (mut chart, limits) = metres(&body, low, high, "")?;
        // A few scans are hardly seen as thinly as many are drawn.
        let (size, weight) = if self.points.len() < FEW {
            (3, 0.9)
        } else {
            (1, 0.35)
        };
        dots(
            &mut chart,
            &limits,
            self.points.iter().copied(),
            size,
            colour::POINTS.mix(weight).filled(),
        )?;
        if let Some(world) = &self.world {
            for face in &world.segments {
                line(
                    &mut chart,
                    &limits,
                    &[face.from, face.to],
                    colour::INK.stroke_width(2),
                )?;
            }
            for column in &world.circles {
                line(
                    &mut chart,
                    &limits,
                    &ring(column.centre, column.radius),
                    colour::INK.stroke_width(2),
                )?;
            }
        }
        for path in &self.paths {
            line(
                &mut chart,
                &limits,
                &path.places,
                path.colour.stroke_width(path.width),
            )?;
        }
        for shape in self.ellipses.iter().flat_map(|all| &all.shapes) {
            line(&mut chart, &limits, shape, colour::PURPLE.stroke_width(2))?;
        }
        Ok(())
    }
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
