//! Finding the motion between two scans, or between a scan and a map.
//!
//! | matcher | from | to | use |
//! | --- | --- | --- | --- |
//! | [`icp::align`] | a guess | a scan | odometry: fast, in integers |
//! | `icp::modular::align` | a guess | a scan | comparing and teaching: every stage a choice |
//! | [`field::align`] | a guess | a likelihood field | tracking in a map |
//! | [`correlative::Correlator::align`] | a window | a likelihood field | where the guess is too far off for the others |
//! | `map::align` | a window | a grid | two maps, to check a closed loop |
//!
//! Each takes what is matched against, the points (or the second grid), a guess and settings, and gives a [`Match`]
//! (`map::MapMatch`) or a [`MatchError`]; those with working memory also take that: the correlative matcher is a method of
//! its memory, the modular ICP takes a workspace. `Ok` means usable: how far it can be trusted is in the covariance, and a
//! direction that nothing determines is named and keeps the guess.

pub mod correlative;
mod degeneracy;
pub mod field;
pub mod icp;
#[cfg(not(feature = "internals"))]
pub(crate) mod map;
#[cfg(feature = "internals")]
pub mod map;
#[cfg(not(feature = "internals"))]
pub(crate) mod virtual_scan;
#[cfg(feature = "internals")]
pub mod virtual_scan;
mod window_covariance;

use core::fmt;

use crate::{
    config::ConfigError,
    geometry::Pose,
    linalg::{Covariance, Information},
};

/// A pose found, and how far it can be trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Match {
    /// Pose of the current lidar in the reference's frame.
    pub pose: Pose,
    /// How far off `pose` may be: position in the reference's frame, heading (m², m·rad, rad²).
    pub covariance: Covariance,
    /// What the scan alone says about the pose: the curvature of the cost, without any prior (1/m², 1/rad²).
    pub information: Information,
    /// Beams that agree with the reference.
    pub inliers: u16,
    /// Beams that met a part of the reference that could have answered: a surface in their direction, an explored cell of a map.
    /// ICP estimates their number from at most 120 beams, evenly spread.
    pub overlap: u16,
    /// Beams given.
    pub beams: u16,
    /// How well the pose explains the scan: about 1 where every beam agrees, 0 where none does, negative where the
    /// reference saw through what the scan hit. Each matcher has its own measure: compare scores of one matcher only.
    pub score: f32,
    /// Root of the weighted mean square distance of the points from the reference's lines (m); where noise grows with the range,
    /// distances are scaled to what they would be at a usual range.
    pub residual: f32,
    /// The direction that the scene hardly determines, if there is one.
    pub degenerate_direction: Option<DegenerateDirection>,
    /// Passes over the beams, of all starts; 0 where every pose of a window was tried instead.
    pub iterations: u8,
    /// What other starts found, where the matcher tries several.
    pub starts: Option<Starts>,
}

/// What a matcher that starts from several poses knows of the competition.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Starts {
    /// Starts tried: 1 where the guess was good enough.
    pub tried: u8,
    /// Score of the best pose found elsewhere, as a share of this one's: 0 where none was found, near 1 where the scene
    /// looks the same from two places.
    pub rival: f32,
}

/// A direction of motion that leaves the match as good as before: along a corridor, about a round room's centre.
///
/// Along it [`Match::pose`] keeps the guess, and is as uncertain as a guess may be.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DegenerateDirection {
    /// Unit vector over (x, y, heading · lever), in the reference's frame.
    pub direction: [f32; 3],
    /// What makes a heading comparable with a distance: the points' mean distance (m).
    pub lever: f32,
    /// Standard deviation of the pose along it, as in the match's covariance (m).
    pub sigma: f32,
}

/// Why there is no pose.
///
/// Exhaustive: telemetry names every reason, and a new one must not go unnamed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MatchError {
    /// The scan has too few beams with a range.
    TooFewBeams {
        /// How many it has.
        found: u16,
        /// How many a match needs.
        needed: u16,
    },
    /// The reference has too few surfaces that lines could be laid through.
    TooFewLines {
        /// How many it has.
        found: u16,
        /// How many a match needs.
        needed: u16,
    },
    /// Too few beams agree with the reference.
    TooFewCorrespondences {
        /// How many agree.
        found: u16,
        /// How many a match needs.
        needed: u16,
    },
    /// The guess is not a number, or farther away than the matcher can reckon.
    BadGuess,
    /// A setting is out of its range.
    BadConfig(ConfigError),
    /// No pose that was tried reaches the least score.
    NothingFound {
        /// The score that was asked for.
        min_score: f32,
    },
    /// No direction is determined well enough to say anything.
    Degenerate,
    /// The best pose explains the scan badly.
    Unlikely {
        /// Its score: see [`Match::score`].
        score: f32,
    },
    /// The last step was still too long.
    NotConverged {
        /// Length of the last step (m).
        step: f32,
    },
    /// Two different poses explain the scan about equally well.
    Ambiguous {
        /// Score of the second one over that of the first, 0…1.
        ratio: f32,
    },
}

impl fmt::Display for MatchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewBeams { found, needed } => {
                write!(f, "only {found} beams have a range, a match needs {needed}")
            }
            Self::TooFewLines { found, needed } => {
                write!(
                    f,
                    "only {found} beams of the reference lie on a surface, a match needs {needed}"
                )
            }
            Self::TooFewCorrespondences { found, needed } => {
                write!(
                    f,
                    "only {found} beams agree with the reference, a match needs {needed}"
                )
            }
            Self::BadGuess => f.write_str("the guess is not finite or too far away"),
            Self::BadConfig(error) => write!(f, "a setting cannot be used: {error}"),
            Self::NothingFound { min_score } => {
                write!(f, "no pose of the window scores {min_score}")
            }
            Self::Degenerate => f.write_str("the scene determines no direction well enough"),
            Self::Unlikely { score } => {
                write!(f, "the best pose explains the scan badly: score {score}")
            }
            Self::NotConverged { step } => write!(f, "not converged: the last step was {step} m"),
            Self::Ambiguous { ratio } => {
                write!(f, "ambiguous: another pose scores {ratio} of the best")
            }
        }
    }
}

impl core::error::Error for MatchError {}
