//! Map to map: the correlation of two occupancy grids, Thrun, Burgard, Fox, *Probabilistic Robotics*, section 6.5.
//!
//! Unlike a likelihood field it penalises free space on walls, which makes it a check for loop closures.

pub mod correlation;
pub mod smoothing;

use super::{
    DegenerateDirection, MatchError, degeneracy,
    window_covariance::{AS_GOOD, REACH, WindowCovariance},
};
use crate::{
    config::{self, ConfigError},
    geometry::Pose,
    grid::Grid,
    linalg::Covariance,
    math,
};
pub use correlation::{Correlation, correlate};
pub use smoothing::{Kernel, smooth};

/// Where to look, and what counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapConfig {
    /// Half the window's side (m), at most 20 cells of the map. Default 0.2.
    pub position_range: f32,
    /// Half the window's angle (rad), at most 20 steps. Default 0.07: 4°.
    pub heading_range: f32,
    /// From one heading to the next (rad). Default 0.0175: 1°.
    pub heading_step: f32,
    /// Least correlation about the common mean. Default 0.3.
    pub min_correlation: f32,
    /// Fewest cells that both maps must know. Default 200.
    pub min_cells: u32,
}

impl MapConfig {
    /// For local maps of a few metres.
    pub const DEFAULT: Self = Self {
        position_range: 0.2,
        heading_range: 0.07,
        heading_step: 0.0175,
        min_correlation: 0.3,
        min_cells: 200,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("position_range", self.position_range, 0.0, 100.0),
            config::within("heading_range", self.heading_range, 0.0, 3.15),
            config::within("heading_step", self.heading_step, 1e-4, 1.0),
            config::within("min_correlation", self.min_correlation, -1.0, 1.0),
            config::within("min_cells", self.min_cells as f32, 1.0, 16777216.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for MapConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What a correlation lower by one costs a pose (nat): e-fold in a twentieth.
const NATS: f32 = 20.0;
/// Where one map lies in another, and how far that can be trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MapMatch {
    /// Pose of the local map in the other one.
    pub pose: Pose,
    /// How far off `pose` may be: position in the map's frame, heading (m², m·rad, rad²).
    pub covariance: Covariance,
    /// How alike the two maps are at `pose`.
    pub correlation: Correlation,
    /// The direction that the maps do not determine, if there is one.
    pub degenerate_direction: Option<DegenerateDirection>,
}

/// Pose of `local` in `map` with the highest correlation about the common mean, tried at every cell and heading of the
/// window and refined by a parabola along each axis.
///
/// Decide ([`decide`](crate::grid::occupancy::decide)) and smooth both first. Costs [`correlate`] times the poses: 729 by default, and 132 more.
///
/// # Errors
/// [`MatchError::BadGuess`] for a guess that is not finite, [`MatchError::BadConfig`] for a window of more than 20 cells or
/// headings to a side, [`MatchError::Unlikely`] where the maps are not alike anywhere in it.
pub fn align(
    map: &Grid<&[u8]>,
    local: &Grid<&[u8]>,
    guess: Pose,
    config: &MapConfig,
) -> Result<MapMatch, MatchError> {
    if !guess.is_finite() {
        return Err(MatchError::BadGuess);
    }
    let resolution = map.shape().resolution();
    let reach = steps("position_range", config.position_range, resolution)?;
    let turns = steps("heading_range", config.heading_range, config.heading_step)?;
    let pose = |x: f32, y: f32, t: f32| {
        Pose::new(
            guess.x + x * resolution,
            guess.y + y * resolution,
            guess.theta + t * config.heading_step,
        )
    };
    let score = |x: i32, y: i32, t: i32| {
        let found = correlate(map, local, pose(x as f32, y as f32, t as f32));
        if found.cells >= config.min_cells {
            found.common
        } else {
            -1.0
        }
    };
    let mut best = (-1.0, 0, 0, 0);
    for t in -turns..=turns {
        for y in -reach..=reach {
            for x in -reach..=reach {
                let value = score(x, y, t);
                if value > best.0 {
                    best = (value, x, y, t);
                }
            }
        }
    }
    let (value, x, y, t) = best;
    if value < config.min_correlation {
        return Err(MatchError::Unlikely { score: value });
    }
    // The top of the parabola through the best value and its neighbours, within half a step.
    let off = |before: f32, after: f32| {
        let bend = before - 2.0 * value + after;
        let steps = if bend < -1e-6 {
            0.5 * (before - after) / bend
        } else {
            0.0
        };
        math::min(math::max(steps, -0.5), 0.5)
    };
    let top = pose(
        x as f32 + off(score(x - 1, y, t), score(x + 1, y, t)),
        y as f32 + off(score(x, y - 1, t), score(x, y + 1, t)),
        t as f32 + off(score(x, y, t - 1), score(x, y, t + 1)),
    );
    let mut spread = WindowCovariance::new(resolution, config.heading_step);
    for dt in -REACH..=REACH {
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let [sx, sy, st] = [dx, dy, dt].map(i32::from);
                let lost = score(x + sx, y + sy, t + st) - value;
                spread.add([dx, dy, dt], NATS * lost);
            }
        }
    }
    let mut covariance = spread.covariance(0.0);
    let lever = 0.5 * f32::from(local.shape().width()) * local.shape().resolution();
    let open = spread.open(&covariance, lever);
    let kept = open.and_then(|open| {
        let pose = open.keep(top, guess);
        let there = correlate(map, local, pose);
        let as_good = NATS * (there.common - value) >= AS_GOOD;
        (there.cells >= config.min_cells && as_good).then_some((open, pose, there))
    });
    if let Some((open, ..)) = kept {
        let information = covariance.information().ok_or(MatchError::Degenerate)?;
        (_, covariance) = degeneracy::uncertainty(&information.0, 1.0, Some(&open))?;
    }
    let (pose, correlation) = kept.map_or_else(
        || (top, correlate(map, local, top)),
        |(_, pose, there)| (pose, there),
    );
    Ok(MapMatch {
        pose,
        covariance,
        correlation,
        degenerate_direction: kept.map(|(open, ..)| open.told(&covariance)),
    })
}

/// Steps from the middle of the window to its edge.
fn steps(setting: &'static str, range: f32, step: f32) -> Result<i32, MatchError> {
    let max = 20.0 * step;
    config::within(setting, range, 0.0, max).map_err(MatchError::BadConfig)?;
    Ok(math::round_to_i32(range / step))
}
