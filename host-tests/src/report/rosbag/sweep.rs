//! Bearings in equal steps, as a `LaserScan` states them.

use beamfix::scan::{Beam, Bearing};

/// In bearings of 1/65536 turn.
const UNITS: f64 = 65_536.0;

/// First bearing and step (rad), kept as long as they serve.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sweep {
    line: (f32, f32),
    /// Largest distance of a bearing from its place so far (1/65536 turn); 0 where each was as it is read.
    largest: f64,
}

impl Sweep {
    /// First bearing and step (rad) for the beams of a scan: such that each is read as it was, where there are such.
    pub fn fit(&mut self, beams: &[Beam]) -> (f32, f32) {
        if gives(self.line, beams) {
            return self.line;
        }
        let bearings = unwrapped(beams);
        let (first, step) = best(&bearings);
        let shift = spread(&bearings, step).shift_from(first);
        let last = beams.len().saturating_sub(1).max(1) as f64;
        // Where rounding alone is between: lines beside the best one, as single precision has them.
        let sides = -10..=10i32;
        let beside = sides
            .clone()
            .flat_map(|a| sides.clone().map(move |b| (f64::from(a), f64::from(b))))
            .map(|(a, b)| (radians(first + 0.002 * a), radians(step + 0.002 * b / last)));
        let mut beside = beside.take(if shift < 0.51 { usize::MAX } else { 0 });
        match beside.find(|line| gives(*line, beams)) {
            Some(line) => self.line = line,
            None => {
                self.line = (radians(first), radians(step));
                self.largest = self.largest.max(shift);
            }
        }
        self.line
    }

    /// Largest distance of a bearing from its place so far (rad).
    pub fn largest_shift(&self) -> f64 {
        self.largest / UNITS * core::f64::consts::TAU
    }
}

fn radians(units: f64) -> f32 {
    (units / UNITS * core::f64::consts::TAU) as f32
}

/// Whether the bearings of a line, read as a `LaserScan`'s are, are those of the beams.
fn gives((first, step): (f32, f32), beams: &[Beam]) -> bool {
    let bearing = |k: usize| f64::from(first) + f64::from(step) * k as f64;
    let mut beams = beams.iter().enumerate();
    beams.all(|(k, beam)| Bearing::from_radians(bearing(k) as f32) == beam.bearing)
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
