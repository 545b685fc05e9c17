//! How likely a scan is at a pose.

use crate::{
    geometry::Pose,
    grid::cast,
    math,
    scan::ScanPoint,
    sensor_model::{
        beam_model::BeamTable,
        likelihood_field::{Field as _, LikelihoodField},
    },
};

/// Which sensor model weighs the scans.
#[derive(Debug, Clone, Copy, Default)]
pub enum Weighting<'a> {
    /// By where beams end: one byte of the map a beam.
    #[default]
    LikelihoodField,
    /// By what is on their way: a ray through the map a beam. It tells rooms apart whose walls are the same and whose free
    /// space is not, and costs some fifty times as much.
    BeamModel(&'a BeamTable),
}

/// A scan and what weighs it.
pub(super) struct Evidence<'a> {
    pub field: &'a LikelihoodField<&'a [u8]>,
    weighting: Weighting<'a>,
    pub points: &'a [ScanPoint],
    /// Share of its logarithm with which a beam counts.
    share: f32,
}

impl<'a> Evidence<'a> {
    /// No more than so many beams count as independent.
    pub fn new(
        field: &'a LikelihoodField<&'a [u8]>,
        weighting: Weighting<'a>,
        points: &'a [ScanPoint],
        independent: f32,
    ) -> Self {
        let beams = math::max(points.len() as f32, 1.0);
        Self {
            field,
            weighting,
            points,
            share: math::min(independent / beams, 1.0),
        }
    }

    /// Log-likelihood of the scan (nat).
    pub fn log(&self, map_from_lidar: Pose) -> f32 {
        let nats = match self.weighting {
            Weighting::LikelihoodField => {
                let score = self.field.score(self.points, map_from_lidar);
                score.nats(self.field.scale())
            }
            Weighting::BeamModel(table) => self.along(table, map_from_lidar) as f32 / 256.0,
        };
        self.share * nats
    }

    /// Log-likelihood by the beam model: 256ths of a nat.
    fn along(&self, table: &BeamTable, map_from_lidar: Pose) -> i32 {
        let most = table.range_max_mm();
        // As for beams that go through walls: what they meet, not what they come near.
        let surface = self.field.scale().byte_at(0.25);
        let likelihood = |point: &ScanPoint| {
            let hit = cast::exact(
                self.field.grid(),
                map_from_lidar,
                point.bearing,
                most,
                |byte| byte >= surface,
            );
            let expected = hit.map_or(most, |hit| math::to_mm(hit.range).min(most));
            table.log_likelihood(Some(point.range), expected)
        };
        // At most 25 nat a beam, and 65 535 beams.
        self.points
            .iter()
            .map(likelihood)
            .fold(0, i32::wrapping_add)
    }

    /// What the curvature of a match's cost is in that of the logarithm: a beam `distance` from its surface loses
    /// distance² / 2σ², and σ is the model's, not the noise of the match.
    pub fn curvature(&self, match_sigma: f32) -> f32 {
        let sigma = match self.weighting {
            Weighting::LikelihoodField => self.field.scale().sigma,
            Weighting::BeamModel(table) => table.sigma(),
        };
        let ratio = match_sigma / sigma;
        self.share * ratio * ratio
    }
}
