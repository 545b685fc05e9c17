//! A log as CARMEN text.

use std::f64::consts::TAU;
use std::fmt::Write;

use beamfix_sim::TruePose;

use crate::formats::Log;

/// The first line of a log that is written here.
pub const WRITTEN: &str = "# ROBOTLASER1 lines as CARMEN writes them\n";

/// Longest range that is written (m); a beam without a return gets it.
const MAX_RANGE: f64 = 65.535;

/// The scans as `ROBOTLASER1` lines, their beams evenly spread over a full turn, counter-clockwise from the first one's bearing;
/// ranges to a millimetre.
#[must_use]
pub fn written(log: &Log) -> String {
    let mut text = String::from(WRITTEN);
    let mount: TruePose = log.mount.robot_from_lidar.into();
    for scan in &log.scans {
        let count = scan.beams.len();
        let step = TAU / count.max(1) as f64;
        let first = scan.beams.first().map_or(0, |beam| beam.bearing.0 as i16);
        let first = f64::from(first) / 65_536.0 * TAU;
        let _ = write!(
            text,
            "ROBOTLASER1 0 {first} {} {step} {MAX_RANGE} 0.01 0 {count}",
            TAU - step
        );
        for beam in &scan.beams {
            let metres = beam.range.mm().map_or(MAX_RANGE, |mm| f64::from(mm) * 1e-3);
            let _ = write!(text, " {metres:.3}");
        }
        let robot: TruePose = scan.wheels.unwrap_or_default().into();
        let _ = write!(text, " 0");
        for TruePose { x, y, theta } in [robot.then(mount), robot] {
            let _ = write!(text, " {x} {y} {theta}");
        }
        let _ = writeln!(
            text,
            " 0 0 0 0 0 {stamp} beamfix {stamp}",
            stamp = scan.stamp
        );
    }
    text
}
