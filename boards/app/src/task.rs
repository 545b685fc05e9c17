//! What a board finds its poses by: odometry, or localization in a map. One of them, by its type, is in an
//! [`Firmware`](crate::Firmware).

use beamfix::{
    geometry::{Pose, Twist},
    linalg::Covariance,
    localization::Verdict as Located,
    matching::icp::IcpConfig,
    odometry::{Odometry, Step},
    pipeline::{Estimate as _, Estimator, MapLocalizer},
    scan::Scan,
};

use crate::telemetry::{NOT_KNOWN, Quality, Task as Kind, Verdict};

/// An estimator whose steps can be told.
pub trait Task<const N: usize>: Estimator<N> {
    /// As [`Ready`](crate::telemetry::Ready) tells it.
    const KIND: Kind;

    /// Where the robot is, where it is known.
    fn pose(&self) -> Option<Pose>;

    /// The robot's velocity, where it is known.
    fn twist(&self) -> Option<Twist>;

    /// Scans that were not matched as they should; wraps.
    fn refused(&self) -> u32;

    /// Times that the pose may have jumped; wraps.
    fn lost(&self) -> u32;

    /// Takes the robot's place in the map, where there is one.
    fn start_at(&mut self, pose: Pose) {
        let _ = pose;
    }

    /// What a step says.
    fn told(step: &Self::Step) -> Told;

    /// Whether the scan had too few beams with a range to be matched.
    fn is_blind(step: &Self::Step, scan: &Scan<N>) -> bool;

    /// How good its match was, where that is told.
    fn quality(sequence: u16, step: &Self::Step) -> Option<Quality>;
}

/// What a step says, whatever found it: see [`telemetry::Pose`](crate::telemetry::Pose).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Told {
    /// Robot (m, rad); all zeros where it is not known.
    pub pose: Pose,
    /// Its covariance as it is sent.
    pub covariance: [f32; 6],
    /// What became of the match.
    pub verdict: Verdict,
    /// Correspondences that agree.
    pub inliers: u16,
    /// Beams with a return.
    pub beams: u16,
    /// Typical distance of an inlier from its line (m).
    pub residual: f32,
}

impl<const N: usize> Task<N> for Odometry<N> {
    const KIND: Kind = Kind::Odometry;

    fn pose(&self) -> Option<Pose> {
        Some(Self::pose(self))
    }

    fn twist(&self) -> Option<Twist> {
        Some(Self::twist(self))
    }

    fn refused(&self) -> u32 {
        self.counters().refused
    }

    fn lost(&self) -> u32 {
        self.counters().lost
    }

    fn told(step: &Step) -> Told {
        let (inliers, beams, residual) = match &step.outcome {
            Ok(found) => (found.inliers, found.beams, found.residual),
            Err(_) => (0, 0, 0.0),
        };
        Told {
            pose: step.pose,
            covariance: step.covariance.to_array(),
            verdict: Verdict::of(step),
            inliers,
            beams,
            residual,
        }
    }

    fn is_blind(step: &Step, _: &Scan<N>) -> bool {
        matches!(Verdict::of(step), Verdict::First | Verdict::TooFewBeams)
    }

    fn quality(sequence: u16, step: &Step) -> Option<Quality> {
        Some(Quality::of(sequence, step))
    }
}

impl<const N: usize, const M: usize> Task<N> for MapLocalizer<'_, N, M> {
    const KIND: Kind = Kind::Localization;

    fn pose(&self) -> Option<Pose> {
        Self::pose(self)
    }

    fn twist(&self) -> Option<Twist> {
        None
    }

    /// Nothing is refused in a map: what fits badly is searched for.
    fn refused(&self) -> u32 {
        0
    }

    fn lost(&self) -> u32 {
        self.localizer().counters().lost
    }

    fn start_at(&mut self, pose: Pose) {
        Self::start_at(self, pose);
    }

    fn told(step: &Self::Step) -> Told {
        let (verdict, found) = match &step.outcome {
            Located::Tracking(found, _) => (Verdict::Measured, Some(found)),
            Located::Doubtful(_) => (Verdict::Doubtful, None),
            Located::Searching => (Verdict::Searching, None),
            Located::Choosing { .. } => (Verdict::Choosing, None),
        };
        Told {
            pose: step.pose().unwrap_or(Pose::IDENTITY),
            covariance: step.covariance().map_or(NOT_KNOWN, Covariance::to_array),
            verdict,
            inliers: found.map_or(0, |found| found.inliers),
            beams: found.map_or(0, |found| found.beams),
            residual: found.map_or(0.0, |found| found.residual),
        }
    }

    /// With fewer than odometry needs.
    fn is_blind(_: &Self::Step, scan: &Scan<N>) -> bool {
        let needed = usize::from(IcpConfig::DEFAULT.min_inliers);
        let with_range = scan.beams().filter(|beam| beam.range.mm().is_ok());
        with_range.take(needed).count() < needed
    }

    fn quality(_: u16, _: &Self::Step) -> Option<Quality> {
        None
    }
}
