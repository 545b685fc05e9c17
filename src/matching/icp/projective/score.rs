//! How well a pose explains a scan, independent of how the pose was found.

use crate::{
    matching::icp::projective::{
        accumulate::Projection, fixed_pose::FixedPose, line::Line, range_noise::RangeNoise,
    },
    math::{reciprocal, rough_length},
    scan::ScanPoint,
};

/// What the points say of a pose.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Score {
    /// Points that met a line.
    pub overlap: u16,
    /// Sum of `1/(1 + (d/4σ)²)` over the points' distances d from their lines, 0 from 8σ on, Q6.
    pub agreement: u32,
    /// Points where the reference saw through to something farther.
    pub in_free_space: u16,
    /// Points nearer than 8σ to their line.
    pub close: u16,
}

/// `1/(1 + (d/4σ)²)` by the distance in steps of a quarter of σ up to 8σ, Q6.
const AGREEMENT: [u8; 32] = agreement();

const fn agreement() -> [u8; 32] {
    let mut table = [0; 32];
    let mut i = 0;
    while i < 32 {
        table[i] = ((64 * 256 + 128 + (i * i / 2) as u32) / (256 + (i * i) as u32)) as u8;
        i += 1;
    }
    table
}

/// Judges `at` by every `stride`-th point.
pub(super) fn judge(
    lines: &[Line],
    points: &[ScanPoint],
    at: FixedPose,
    stride: u16,
    noise: RangeNoise,
) -> Score {
    let mut projection = Projection::new(lines, at);
    // Q16; 1024 times 64 for all ranges alike, which most lidars' are.
    let usual = (1024 / u32::from(noise.sigma).max(1)) << 6;
    let mut score = Score::default();
    for point in points.iter().step_by(usize::from(stride).max(1)) {
        let placed = projection.place(point);
        let Some(line) = projection.line(point, placed) else {
            continue;
        };
        score.overlap += 1;
        let (qx, qy) = (i32::from(line.qx), i32::from(line.qy));
        let (dx, dy) = ((placed.x >> 4) - qx, (placed.y >> 4) - qy);
        let (mx, my) = (i32::from(line.mx), i32::from(line.my));
        // The weight is taken off again: the distance itself counts here (mm).
        let weighted = (mx.wrapping_mul(dx))
            .wrapping_add(my.wrapping_mul(dy))
            .unsigned_abs()
            >> 10;
        let distance = weighted.saturating_mul(reciprocal(rough_length(mx, my)) >> 4) >> 10;
        let per_mm = if noise.share == 0 {
            usual
        } else {
            (1 << 16) / noise.at(point.range).max(1)
        };
        let step = (distance.saturating_mul(per_mm) >> 14) as usize;
        if let Some(agreement) = AGREEMENT.get(step) {
            score.agreement += u32::from(*agreement);
            score.close += 1;
        } else if dx.wrapping_mul(qx).wrapping_add(dy.wrapping_mul(qy)) < 0 {
            score.in_free_space += 1;
        }
    }
    score
}

impl Score {
    /// From about 1 for a pose that explains all the points down to 0 and below.
    ///
    /// Divided by the overlap and `few` points more, so that two points that agree do not beat a hundred. Points behind
    /// the reference's surfaces count half: what a new place reveals may be new.
    pub fn value(&self, few: u16) -> f32 {
        let agreement = self.agreement as f32 / 64.0;
        let [overlap, close, through] =
            [self.overlap, self.close, self.in_free_space].map(f32::from);
        let behind = overlap - close - through;
        (agreement - 0.5 * through) / (overlap - 0.5 * behind + f32::from(few))
    }
}
