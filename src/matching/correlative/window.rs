//! The window of poses that is searched, as whole cells and headings.

use super::{config::CorrelativeConfig, pyramid::Pyramid};
use crate::{
    config::ConfigError,
    geometry::{Point, Pose},
    matching::MatchError,
    math,
    scan::ScanPoint,
    sensor_model::likelihood_field::Field,
};

/// Most blocks on a side of the window at the pyramid's top.
pub(super) const SIDE: i32 = 12;

/// A cell of the window and its sum of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Candidate {
    /// Sum of bytes.
    pub sum: u32,
    /// Columns from the window's first.
    pub x: i16,
    /// Rows from the window's first.
    pub y: i16,
    /// Headings from the window's first.
    pub heading: i16,
}

/// The window as whole cells and headings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    guess: Pose,
    /// Cells on a side, a multiple of the pyramid's top stride.
    pub side: i16,
    /// Cells from the window's first to the guess.
    centre: i16,
    /// Headings.
    pub headings: i16,
    pub(super) step: f32,
    pub(super) resolution: f32,
    pub(super) axes: f32,
}

impl Window {
    /// The window around `guess`.
    ///
    /// # Errors
    /// [`MatchError::BadGuess`] if the guess is not finite, [`MatchError::BadConfig`] if the window has more blocks or
    /// headings than fit.
    pub fn new(
        pyramid: &Pyramid<'_>,
        points: &[ScanPoint],
        guess: Pose,
        config: &CorrelativeConfig,
    ) -> Result<Self, MatchError> {
        if !guess.is_finite() {
            return Err(MatchError::BadGuess);
        }
        let shape = pyramid.field().shape();
        let resolution = shape.resolution();
        let farthest = points.iter().map(|point| point.range).max().unwrap_or(1);
        let cell_turn = resolution / math::max(f32::from(farthest) * 1e-3, resolution);
        let step = if config.heading_step > 0.0 {
            config.heading_step
        } else {
            cell_turn
        };
        // Rounded up, so that the window is never smaller than asked for.
        let half_headings = math::round_to_i32(config.heading_range / step + 0.499);
        let half_cells = math::round_to_i32(config.position_range / resolution + 0.499);
        let top = i32::from(pyramid.top_stride());
        let out_of_range = |setting, value, max| {
            MatchError::BadConfig(ConfigError::OutOfRange {
                setting,
                value,
                min: 0.0,
                max,
            })
        };
        if !(config.heading_range >= 0.0 && half_headings < 5000) {
            let max = 4999.0 * step;
            return Err(out_of_range("heading_range", config.heading_range, max));
        }
        let blocks = half_cells.saturating_mul(2).saturating_add(top) / top.max(1);
        if !(config.position_range >= 0.0 && blocks <= SIDE) {
            let max = (top * SIDE / 2 - 1) as f32 * resolution;
            return Err(out_of_range("position_range", config.position_range, max));
        }
        Ok(Self {
            guess,
            side: (blocks * top) as i16,
            centre: ((blocks * top) / 2) as i16,
            headings: (2 * half_headings + 1) as i16,
            step,
            resolution,
            axes: shape.origin().theta,
        })
    }

    /// Where the lidar is with a heading and in the window's first cell: what blocks count from.
    pub(super) fn corner(&self, heading: i16) -> Pose {
        self.pose(0, 0, heading)
    }

    /// The pose that a cell and heading of the window stand for.
    #[must_use]
    pub fn pose(&self, x: i16, y: i16, heading: i16) -> Pose {
        let cells = |place: i16| f32::from(place - self.centre) * self.resolution;
        let axes = Pose {
            x: 0.0,
            y: 0.0,
            theta: self.axes,
        };
        let shift = axes * Point::new(cells(x), cells(y));
        let turn = f32::from(heading - self.headings / 2) * self.step;
        Pose::new(
            self.guess.x + shift.x,
            self.guess.y + shift.y,
            self.guess.theta + turn,
        )
    }

    /// Headings from the guess's outwards: the likelier, the sooner a good score prunes the rest.
    pub(super) fn outwards(&self) -> impl Iterator<Item = i16> {
        let middle = self.headings / 2;
        (0..=middle).flat_map(move |k| {
            [middle - k, middle + k]
                .into_iter()
                .take(if k == 0 { 1 } else { 2 })
        })
    }
}

/// What lies around a pose already found.
#[derive(Debug, Clone, Copy)]
pub struct Near {
    /// The cell of that pose.
    pub(super) best: Candidate,
    /// Columns and rows that are near it.
    pub(super) cells: i16,
    /// Headings that are near it.
    pub(super) headings: i16,
}

impl Near {
    pub(super) fn holds(&self, other: &Candidate) -> bool {
        (other.x - self.best.x).abs() <= self.cells
            && (other.y - self.best.y).abs() <= self.cells
            && (other.heading - self.best.heading).abs() <= self.headings
    }
}
