//! One match after the other, without odometry: what `bench` measures.

use beamfix::{
    geometry::{Pose, Twist},
    matching::{
        Match, MatchError,
        icp::{self, IcpConfig, Reference},
    },
    scan::{Points, PointsConfig, Scan},
};

/// Lines of the reference: one for two degrees.
pub const LINES: usize = 180;

/// Neighbouring beams averaged until about so many points are left: a third of the time for a sixth of the accuracy.
const POINTS: PointsConfig = PointsConfig {
    enough: 130,
    ..PointsConfig::DEFAULT
};

/// A matcher with its memory.
pub struct Pairs<const N: usize> {
    points: Points<N>,
    reference: Reference<LINES>,
}

impl<const N: usize> Pairs<N> {
    /// Nothing to match yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            points: Points::new(),
            reference: Reference::new(),
        }
    }

    /// Preparation, first half: the scan to be matched against, from its beams.
    pub fn set_reference(&mut self, scan: &Scan<N>) {
        self.points.assign(scan, Twist::ZERO, &POINTS);
        self.reference.assign(self.points.as_slice());
    }

    /// Preparation, second half: the scan to be matched.
    pub fn set_current(&mut self, scan: &Scan<N>) {
        self.points.assign(scan, Twist::ZERO, &POINTS);
    }

    /// The match itself.
    ///
    /// # Errors
    /// As [`icp::align`].
    pub fn align(&self, guess: Pose) -> Result<Match, MatchError> {
        icp::align(
            &self.reference,
            self.points.as_slice(),
            guess,
            &IcpConfig::DEFAULT,
        )
    }
}

impl<const N: usize> Default for Pairs<N> {
    fn default() -> Self {
        Self::new()
    }
}
