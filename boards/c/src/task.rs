//! What a pipeline's estimator does, whichever it is: one call a revolution through a table of functions, so that a program has
//! the code of its own task alone, and each lidar's code is there once.

use beamfix_core::{
    Covariance, EgoMotion, MatchError, Odometry, Pose, Refusal, Scan,
    localization::Verdict as Located,
    pipeline::{Estimate, Estimator, Verdict as Found},
};

use crate::{
    place::{Localization, Mapping},
    types::{BEAMFIX_BEAMS, Reason, Verdict},
};

/// Points of a scan that localization uses where all are not needed: as the firmware does.
pub(crate) const POINTS: usize = 96;

/// What is known after a revolution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    pub pose: Option<Pose>,
    pub covariance: Option<Covariance>,
    pub verdict: Found,
    pub reason: Reason,
    pub lost: u32,
}

/// A task, with its revolutions' capacity.
pub(crate) trait Task<const N: usize>: Common {
    /// Takes the next scan, as [`Estimator::update`].
    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Known;
}

/// A task, whatever its capacity.
pub(crate) trait Common {
    /// As [`Estimator::work`].
    fn work(&mut self, budget: u32) -> bool;

    /// Tells where the robot is in the map; `false` where there is no map.
    fn start_at(&mut self, pose: Pose) -> bool;

    /// Times that the reference was given up.
    fn lost(&self) -> u32;

    /// The map that is made, where one is.
    fn map(&mut self) -> Option<&mut Mapping> {
        None
    }
}

impl<const N: usize> Task<N> for Odometry<N> {
    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Known {
        let step = Estimator::update(self, scan, ego);
        Known {
            pose: step.pose(),
            covariance: step.covariance(),
            verdict: step.verdict(),
            reason: step.outcome.as_ref().err().map_or(Reason::None, why),
            lost: self.lost(),
        }
    }
}

impl<const N: usize> Common for Odometry<N> {
    fn work(&mut self, budget: u32) -> bool {
        Estimator::work(self, budget)
    }

    fn start_at(&mut self, _: Pose) -> bool {
        false
    }

    fn lost(&self) -> u32 {
        self.counters().lost
    }
}

impl<const N: usize> Task<N> for Localization<N> {
    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Known {
        let step = Estimator::update(self, scan, ego);
        Known {
            pose: step.pose(),
            covariance: step.covariance(),
            verdict: step.verdict(),
            reason: match step.outcome {
                Located::Tracking(..) => Reason::None,
                Located::Doubtful(_) => Reason::Doubtful,
                Located::Searching => Reason::Searching,
                Located::Choosing { .. } => Reason::Choosing,
            },
            lost: self.lost(),
        }
    }
}

impl<const N: usize> Common for Localization<N> {
    fn work(&mut self, budget: u32) -> bool {
        Estimator::work(self, budget)
    }

    fn start_at(&mut self, pose: Pose) -> bool {
        Self::start_at(self, pose);
        true
    }

    fn lost(&self) -> u32 {
        self.localizer().counters().lost
    }
}

impl Task<BEAMFIX_BEAMS> for Mapping {
    fn update(&mut self, scan: &Scan<BEAMFIX_BEAMS>, ego: EgoMotion) -> Known {
        let step = Estimator::update(self, scan, ego);
        Known {
            pose: step.pose(),
            covariance: step.covariance(),
            verdict: step.verdict(),
            reason: match &step.odometry.outcome {
                _ if !step.is_located => Reason::Searching,
                outcome => outcome.as_ref().err().map_or(Reason::None, why),
            },
            lost: self.lost(),
        }
    }
}

impl Common for Mapping {
    fn work(&mut self, budget: u32) -> bool {
        Estimator::work(self, budget)
    }

    fn start_at(&mut self, _: Pose) -> bool {
        false
    }

    /// Maps begun anew, maps joined and loops closed: the pose jumps.
    fn lost(&self) -> u32 {
        let counters = self.slam().counters();
        counters
            .carried
            .wrapping_add(counters.joined)
            .wrapping_add(counters.loops)
    }

    fn map(&mut self) -> Option<&mut Mapping> {
        Some(self)
    }
}

impl Estimate for Known {
    fn pose(&self) -> Option<Pose> {
        self.pose
    }

    fn covariance(&self) -> Option<Covariance> {
        self.covariance
    }

    fn verdict(&self) -> Found {
        self.verdict
    }
}

/// How a pose was found, in C's words.
pub(crate) const fn verdict(found: Found) -> Verdict {
    match found {
        Found::Measured => Verdict::Measured,
        Found::Predicted => Verdict::Predicted,
        Found::Unknown => Verdict::Unknown,
    }
}

const fn why(refusal: &Refusal) -> Reason {
    match refusal {
        Refusal::First => Reason::FirstScan,
        Refusal::TooFar { .. } => Reason::TooFar,
        Refusal::NoMatch(error) => match error {
            MatchError::TooFewBeams { .. } => Reason::TooFewBeams,
            MatchError::TooFewLines { .. } => Reason::TooFewLines,
            MatchError::TooFewCorrespondences { .. } => Reason::TooFewCorrespondences,
            MatchError::Degenerate => Reason::Degenerate,
            MatchError::NotConverged { .. } => Reason::NotConverged,
            MatchError::Ambiguous { .. } => Reason::Ambiguous,
            MatchError::NothingFound { .. } => Reason::NothingFound,
            MatchError::Unlikely { .. } => Reason::Unlikely,
            // The settings were checked when the object was made.
            MatchError::BadGuess | MatchError::BadConfig(_) => Reason::BadGuess,
        },
    }
}
