//! What turns revolutions into poses.

use crate::{
    geometry::{EgoMotion, Pose},
    linalg::Covariance,
    odometry::{Odometry, SparseOdometry, Step},
    scan::Scan,
};

/// Finds the robot's pose scan by scan.
pub trait Estimator<const N: usize> {
    /// What it says about a scan.
    type Step: Estimate;

    /// Takes the next scan, and the robot's motion since the one before as far as wheels and gyroscope told it.
    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Self::Step;

    /// Does a bounded part of what can wait; true where nothing is left to do before the next scan. The budget's unit is
    /// the estimator's: see its own page.
    fn work(&mut self, budget: u32) -> bool {
        let _ = budget;
        true
    }
}

/// What an estimator knows after a scan, whichever it is.
pub trait Estimate {
    /// Robot at the scan's end in the estimator's frame (m, rad), where it is known.
    fn pose(&self) -> Option<Pose>;

    /// Covariance of the pose in the same frame (m², m·rad, rad²), where it is known.
    fn covariance(&self) -> Option<Covariance>;

    /// How the pose was found.
    fn verdict(&self) -> Verdict;
}

/// How a pose was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// By matching the scan.
    Measured,
    /// By the motion since the last measured one: the scan did not fit.
    Predicted,
    /// Not at all.
    Unknown,
}

impl<const N: usize> Estimator<N> for Odometry<N> {
    type Step = Step;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        Self::update(self, scan, ego)
    }
}

impl<const N: usize, const K: usize> Estimator<N> for SparseOdometry<N, K> {
    type Step = Step;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Step {
        Self::update(self, scan, ego)
    }
}

impl Estimate for Step {
    fn pose(&self) -> Option<Pose> {
        Some(self.pose)
    }

    fn covariance(&self) -> Option<Covariance> {
        Some(self.covariance)
    }

    fn verdict(&self) -> Verdict {
        match self.outcome {
            Ok(_) => Verdict::Measured,
            Err(_) => Verdict::Predicted,
        }
    }
}
