//! Errors of a trajectory against relations: pairs of moments with the true motion between them.
//!
//! As `../shared/tools/relations_eval.py` has it, after Kümmerle et al., *On measuring the accuracy of SLAM algorithms*, 2009.

use std::{fs, path::Path};

use anyhow::{Context as _, Result, ensure};
use beamfix_sim::TruePose;

/// A moment (s) and where the robot was.
pub type Placed = (f64, TruePose);

/// Mean errors over the relations that were used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Mean distance (m).
    pub metres: f64,
    /// Mean rotation (degrees).
    pub degrees: f64,
    /// Relations both of whose moments have a pose.
    pub used: usize,
}

/// Farthest that a stamp may be from a relation's moment (s): stamps are written with fewer digits here and there.
const SAME_MOMENT: f64 = 5e-4;

/// Errors of a trajectory over the relations of a file that are at most `longest` seconds apart.
pub fn errors(mut track: Vec<Placed>, relations: &Path, longest: f64) -> Result<Errors> {
    track.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The nearest: some scans are half a millisecond apart.
    let at = |time: f64| {
        let k = track.partition_point(|placed| placed.0 < time);
        let around = track.get(k.saturating_sub(1)..).unwrap_or_default();
        let off = |placed: &Placed| (placed.0 - time).abs();
        let near = around.iter().take(2).copied();
        near.min_by(|a, b| off(a).total_cmp(&off(b)))
            .filter(|placed| off(placed) <= SAME_MOMENT)
    };
    let name = || relations.display().to_string();
    let text = fs::read_to_string(relations).with_context(name)?;
    let (mut metres, mut degrees, mut used) = (0.0, 0.0, 0);
    for (number, line) in text.lines().enumerate() {
        if line.starts_with('#') || line.trim().is_empty() {
            continue;
        }
        let words: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let Ok([from, to, x, y, _, _, _, yaw]) = words.as_deref() else {
            anyhow::bail!("{}:{}: eight numbers are wanted", name(), number + 1);
        };
        if (to - from).abs() > longest {
            continue;
        }
        let (Some((_, from)), Some((_, to))) = (at(*from), at(*to)) else {
            continue;
        };
        let off = TruePose::new(*x, *y, *yaw).between(from.between(to));
        metres += off.distance();
        degrees += off.theta.to_degrees().abs();
        used += 1;
    }
    ensure!(used > 0, "{}: no relation is within the trajectory", name());
    let count = f64::from(used as u32);
    Ok(Errors {
        metres: metres / count,
        degrees: degrees / count,
        used,
    })
}

/// The moment and pose of a line `timestamp x y theta` of a trajectory.
#[must_use]
pub fn placed(line: &str) -> Option<Placed> {
    let numbers = line
        .split_whitespace()
        .take(4)
        .map(|word| word.parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    match numbers[..] {
        [time, x, y, theta] => Some((time, TruePose::new(x, y, theta))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_is_that_of_the_nearest_scan() {
        let file = std::env::temp_dir().join(format!("relations-{}", std::process::id()));
        fs::write(&file, "1.0 2.0 1.0 0 0 0 0 0\n").expect("the test's file");
        // One scan 0.4 ms before each moment, one 0.1 ms after.
        let track = [
            (0.9996, 0.5),
            (1.0001, 0.0),
            (1.9996, 7.0),
            (2.0001, 1.25),
            (3.0, 9.0),
        ];
        let track = track.map(|(time, x)| (time, TruePose::new(x, 0.0, 0.0)));
        let found = errors(track.to_vec(), &file, f64::INFINITY).expect("relations");
        assert_eq!((found.metres, found.degrees, found.used), (0.25, 0.0, 1));
        // None within half a millisecond.
        assert!(errors(track[4..].to_vec(), &file, f64::INFINITY).is_err());
        fs::remove_file(&file).expect("the test's file");
    }
}
