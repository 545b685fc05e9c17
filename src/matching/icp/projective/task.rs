//! What all parts of one match work on.

use crate::{
    geometry::Pose,
    matching::icp::projective::{
        config::IcpConfig, fixed_pose::FixedPose, line::Line, normal_equations::Sums,
        range_noise::RangeNoise,
    },
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
    /// Standard deviation of a range.
    pub noise: RangeNoise,
    /// See [`mean_square_weight`].
    pub mean_square: f32,
    /// Whether the guess decides between places near by.
    pub is_decided: bool,
    pub rivals: Rivals,
    pub config: &'a IcpConfig,
}

impl Task<'_> {
    /// Curvature below which a direction is not determined: a share of what all points together would have head on.
    pub fn least_curvature(&self, sums: &Sums) -> f32 {
        self.config.min_constraint_share * self.mean_square * sums.total_weight()
    }
}

/// Mean square of the weights that lines have by the noise of their ranges: 1 where that is the same at any range.
pub(super) fn mean_square_weight(points: &[ScanPoint], noise: RangeNoise) -> f32 {
    if noise.share == 0 {
        return 1.0;
    }
    let usual = f32::from(noise.sigma);
    let square = |point: &ScanPoint| {
        let weight = usual / noise.at(point.range) as f32;
        weight * weight
    };
    points.iter().map(square).sum::<f32>() / points.len() as f32
}
