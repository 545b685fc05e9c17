//! One match after the other, without odometry: what `bench` measures.

use beamfix::{
    geometry::{Pose, Twist},
    matching::{
        Match, MatchError,
        icp::{
            self, IcpConfig, Reference,
            modular::{
                self, Stages, Workspace, correspondence::Closest, minimisation::PointToLine,
                rejection::Trimmed, selection::All, weighting::Constant,
            },
        },
    },
    scan::{Points, PointsConfig, Scan},
};

/// Lines of the reference: one for two degrees.
pub const LINES: usize = 180;

/// Neighbouring beams averaged until about so many points are left: a third of the time for a sixth of the accuracy.
const POINTS: PointsConfig = PointsConfig {
    max_points: 130,
    ..PointsConfig::DEFAULT
};

/// What is measured: two halves of a preparation, and a match.
pub trait Matcher<const N: usize> {
    /// Preparation, first half: the scan to be matched against, from its beams.
    fn set_reference(&mut self, scan: &Scan<N>);
    /// Preparation, second half: the scan to be matched.
    fn set_current(&mut self, scan: &Scan<N>);
    /// The match itself.
    ///
    /// # Errors
    /// As [`icp::align`].
    fn align(&mut self, guess: Pose) -> Result<Match, MatchError>;
}

/// The matcher of the odometry, with its memory.
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
}

impl<const N: usize> Matcher<N> for Pairs<N> {
    fn set_reference(&mut self, scan: &Scan<N>) {
        self.points.assign(scan, Twist::ZERO, &POINTS);
        self.reference.assign(self.points.as_slice());
    }

    fn set_current(&mut self, scan: &Scan<N>) {
        self.points.assign(scan, Twist::ZERO, &POINTS);
    }

    fn align(&mut self, guess: Pose) -> Result<Match, MatchError> {
        icp::align(
            &self.reference,
            self.points.as_slice(),
            guess,
            &IcpConfig::DEFAULT,
        )
    }
}

/// The matcher whose stages are choices, each the default one, with its memory.
pub struct Staged<const N: usize> {
    reference: Points<N>,
    points: Points<N>,
    workspace: Workspace<N>,
}

impl<const N: usize> Staged<N> {
    /// Nothing to match yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            reference: Points::new(),
            points: Points::new(),
            workspace: Workspace::new(),
        }
    }
}

impl<const N: usize> Matcher<N> for Staged<N> {
    fn set_reference(&mut self, scan: &Scan<N>) {
        self.reference
            .assign(scan, Twist::ZERO, &PointsConfig::DEFAULT);
    }

    fn set_current(&mut self, scan: &Scan<N>) {
        self.points
            .assign(scan, Twist::ZERO, &PointsConfig::DEFAULT);
    }

    fn align(&mut self, guess: Pose) -> Result<Match, MatchError> {
        let mut stages: Stages<All, Closest, Constant, Trimmed, PointToLine> = Stages::default();
        modular::align(
            self.reference.as_slice(),
            self.points.as_slice(),
            guess,
            &mut stages,
            &mut self.workspace,
        )
    }
}

impl<const N: usize> Default for Pairs<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Default for Staged<N> {
    fn default() -> Self {
        Self::new()
    }
}
