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
    /// End of the last scan, once there was one.
    end_us: Option<u32>,
}

impl<const N: usize> Seen<N> {
    pub const fn new(config: PointsConfig) -> Self {
        Self {
            config,
            points: Points::new(),
            end_us: None,
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
        // For the first scan, and after a pause longer than any revolution, the motion is taken to be the scan's own.
        let end_us = scan.end_us();
        let micros = (self.end_us.replace(end_us)).map(|last_us| end_us.wrapping_sub(last_us));
        let seconds = match micros {
            Some(micros) if micros < 2_000_000 => micros as f32 * 1e-6,
            _ => scan.duration(),
        };
        let twist = Twist::from_motion(motion, seconds);
        self.points.assign(scan, twist, &self.config);
        (motion, seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Beam, Bearing, Range};

    /// Two beams, 100 ms apart.
    fn scan(end_us: u32) -> Scan<4> {
        let mut scan = Scan::new();
        for (bearing, before_us) in [(0, 100_000), (20_000, 0)] {
            let beam = Beam {
                bearing: Bearing(bearing),
                range: Range::from_mm(1000),
                time_us: end_us.wrapping_sub(before_us),
                quality: 0,
            };
            assert_eq!(scan.push(beam), Ok(()));
        }
        scan
    }

    #[test]
    fn the_first_scan_and_one_after_a_pause_last_as_long_as_themselves() {
        let mut seen = Seen::<4>::new(PointsConfig::DEFAULT);
        // A lidar that has spun up for as long as the clock runs; 200 ms later; three seconds later.
        for (end_us, wanted) in [(1_900_000, 0.1), (2_100_000, 0.2), (5_100_000, 0.1)] {
            let scan = scan(end_us);
            let (_, seconds) = seen.take(&scan, EgoMotion::UNKNOWN);
            assert!((seconds - wanted).abs() < 1e-6, "{end_us}: {seconds} s");
        }
    }
}
