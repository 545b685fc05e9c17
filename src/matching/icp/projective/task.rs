//! What all parts of one match work on.

use crate::{
    matching::icp::projective::{config::IcpConfig, fixed_pose::FixedPose, line::Line},
    scan::ScanPoint,
};

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
    pub config: &'a IcpConfig,
}
