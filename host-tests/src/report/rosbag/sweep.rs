//! Bearings in equal steps, as a `LaserScan` states them.

use beamfix::scan::Beam;

/// In bearings of 1/65536 turn.
const UNITS: f64 = 65_536.0;

/// The line through the bearings of scans: first bearing and step (1/65536 turn), one that holds for many scans.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sweep {
    line: (f64, f64),
    /// Largest distance of a bearing from the line so far (1/65536 turn).
    largest: f64,
}

impl Sweep {
    /// First bearing and step (rad) for the beams of a scan: such that each rounds to its own bearing, where there are.
    pub fn fit(&mut self, beams: &[Beam]) -> (f32, f32) {
        let bearings = unwrapped(beams);
        let shift = spread(&bearings, self.line.1).shift_from(self.line.0);
        // The last scan's line: the same array means the same directions.
        if shift >= 0.5 || bearings.is_empty() {
            self.line = best(&bearings);
        }
        let shift = spread(&bearings, self.line.1).shift_from(self.line.0);
        self.largest = self.largest.max(shift);
        let radians = |units: f64| (units / UNITS * core::f64::consts::TAU) as f32;
        (radians(self.line.0), radians(self.line.1))
    }

    /// Largest distance of a bearing from its place (rad); none where every bearing is as it was, after rounding.
    pub fn largest_shift(&self) -> f64 {
        if self.largest < 0.5 {
            0.0
        } else {
            self.largest / UNITS * core::f64::consts::TAU
        }
    }
}

/// Bearings that grow or fall steadily (1/65536 turn): a step is at most half a turn.
fn unwrapped(beams: &[Beam]) -> Vec<f64> {
    let mut last = beams.first().map_or(0, |beam| beam.bearing.0);
    let mut sum = f64::from(last as i16);
    let next = |beam: &Beam| {
        sum += f64::from(beam.bearing.0.wrapping_sub(last) as i16);
        last = beam.bearing.0;
        sum
    };
    beams.iter().map(next).collect()
}

/// Lowest and highest of what is left of bearings without `step` for each.
struct Spread {
    low: f64,
    high: f64,
}

impl Spread {
    fn shift_from(&self, first: f64) -> f64 {
        (self.high - first).max(first - self.low)
    }
}

fn spread(bearings: &[f64], step: f64) -> Spread {
    let rest = bearings
        .iter()
        .enumerate()
        .map(|(k, b)| b - step * k as f64);
    let none = Spread {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };
    rest.fold(none, |all, rest| Spread {
        low: all.low.min(rest),
        high: all.high.max(rest),
    })
}

/// First bearing and step of the line that no bearing is far from: the spread is convex in the step.
fn best(bearings: &[f64]) -> (f64, f64) {
    let (Some(first), Some(last)) = (bearings.first(), bearings.last()) else {
        return (0.0, 0.0);
    };
    let gaps = bearings.len().saturating_sub(1).max(1) as f64;
    let middle = (last - first) / gaps;
    let width = |step: f64| {
        let spread = spread(bearings, step);
        spread.high - spread.low
    };
    let reach = width(middle).max(1.0) / gaps;
    let (mut low, mut high) = (middle - 2.0 * reach, middle + 2.0 * reach);
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if width(low + third) < width(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    let step = 0.5 * (low + high);
    let spread = spread(bearings, step);
    (0.5 * (spread.low + spread.high), step)
}
