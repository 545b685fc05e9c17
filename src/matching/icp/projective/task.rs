//! What all parts of one match work on.

use crate::{
    geometry::Pose,
    matching::icp::projective::{config::IcpConfig, fixed_pose::FixedPose, line::Line},
    scan::ScanPoint,
};

/// Where a search begins, whether that decides between places that look alike, and which other starts it may have.
#[derive(Clone, Copy)]
pub(crate) struct Guess {
    pub pose: Pose,
    /// Whether the guess decides between places near by that explain the scan equally well.
    pub is_decided: bool,
    pub rivals: Rivals,
}

/// Starts that compete with the guess where that one leads to nothing sure.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Rivals {
    /// None; and where the guess leads to is looked at closely only if it may be worth this much.
    None(f32),
    /// A few within 20°, and some along the direction that is known least. In a global search as `All`.
    Near,
    /// All that the kind of search has.
    All,
}

/// What stays the same over one match.
pub(super) struct Task<'a> {
    pub lines: &'a [Line],
    pub points: &'a [ScanPoint],
    pub start: FixedPose,
    pub lever_shift: u32,
    /// Standard deviation of a range (mm).
    pub sigma: u32,
    /// Whether the guess decides between places near by.
    pub is_decided: bool,
    pub rivals: Rivals,
    pub config: &'a IcpConfig,
}
