//! What the odometry makes of a scan, and what it counts.

use crate::{
    geometry::Pose,
    linalg::Covariance,
    matching::{Match, MatchError},
};

/// What [`Odometry::update`](super::Odometry::update) made of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// Robot at the scan's end, in the frame in which it started (m, rad).
    pub pose: Pose,
    /// Covariance of `pose` since the start, in the frame in which the robot started: it grows with every keyframe and
    /// every predicted motion (m², m·rad, rad²).
    pub covariance: Covariance,
    /// The match against the keyframe, or why `pose` is only predicted.
    pub outcome: Result<Match, Refusal>,
    /// This scan is the new keyframe.
    pub keyframe: bool,
}

/// Why a scan gave no pose of its own.
///
/// Exhaustive: telemetry names every reason, and a new one must not go unnamed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// There is nothing to match against yet.
    First,
    /// The matcher found no pose.
    NoMatch(MatchError),
    /// The match is too far from the guess to be believed, or contradicts wheels that were right up to now.
    TooFar {
        /// Distance between the two (m).
        distance: f32,
        /// Rotation between the two (rad).
        rotation: f32,
    },
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::First => f.write_str("the first scan has nothing to be matched against"),
            Self::NoMatch(error) => error.fmt(f),
            Self::TooFar { distance, rotation } => {
                write!(
                    f,
                    "the match is {distance} m and {rotation} rad from the guess"
                )
            }
        }
    }
}

impl core::error::Error for Refusal {}

/// Scans, refusals and keyframes since the start; every number wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Scans given.
    pub scans: u32,
    /// Scans whose pose is only predicted (the first does not count).
    pub refused: u32,
    /// Keyframes made.
    pub keyframes: u32,
    /// Keyframes given up because too many scans in a row were refused: the pose may have jumped.
    pub lost: u32,
    /// Scans at which the wheels said a motion that no robot makes: they started over, or their pose was corrected.
    pub wheel_jumps: u32,
    /// Scans whose match contradicted the prior and was believed.
    pub contradicted: u32,
}

impl Counters {
    pub(super) const ZERO: Self = Self {
        scans: 0,
        refused: 0,
        keyframes: 0,
        lost: 0,
        wheel_jumps: 0,
        contradicted: 0,
    };
}
