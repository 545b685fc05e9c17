//! A scan's points as a localizer in a map takes them.

use crate::{
    geometry::{EgoMotion, Pose, Twist},
    scan::{Mount, Points, PointsConfig, Scan, ScanPoint},
};

/// The points of the last scan, deskewed. 8·N bytes.
#[derive(Debug)]
pub(super) struct Seen<const N: usize> {
    config: PointsConfig,
    points: Points<N>,
    end_us: u32,
}

impl<const N: usize> Seen<N> {
    pub const fn new(config: PointsConfig) -> Self {
        Self {
            config,
            points: Points::new(),
            end_us: 0,
        }
    }

    pub const fn mount(&self) -> &Mount {
        &self.config.mount
    }

    pub fn points(&self) -> &[ScanPoint] {
        self.points.as_slice()
    }

    /// Takes a scan; gives the robot's motion since the one before, as far as it is known, and the time (s) since then.
    pub fn take(&mut self, scan: &Scan<N>, ego: EgoMotion) -> (Pose, f32) {
        let motion = ego.motion().unwrap_or(Pose {
            theta: ego.credible_rotation().unwrap_or(0.0),
            ..Pose::IDENTITY
        });
        // After a pause longer than any revolution the motion is taken to be the scan's own; for the first scan too, unless the
        // clock has begun less than two seconds before.
        let micros = scan.end_us().wrapping_sub(self.end_us);
        self.end_us = scan.end_us();
        let seconds = if micros < 2_000_000 {
            micros as f32 * 1e-6
        } else {
            scan.duration()
        };
        let twist = Twist::from_motion(motion, seconds);
        self.points.assign(scan, twist, &self.config);
        (motion, seconds)
    }
}
