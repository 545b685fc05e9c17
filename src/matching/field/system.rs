//! Slopes and curvatures summed over a scan's beams, and the Newton step and the match that follow from them.

use super::{
    config::FieldConfig,
    pass::{CHUNK, Part, Pass, TOGETHER},
};
use crate::{
    geometry::{Point, Pose},
    grid::Shape,
    linalg::{Covariance, Sym3},
    matching::{Match, MatchError, degeneracy},
    math,
    scan::ScanPoint,
    sensor_model::likelihood_field::{Field, placement::Placement},
};

/// Slopes and curvatures summed over the beams, in bytes, cells and levers of `2^lever_shift` cells.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// 64ths of a byte per cell, and per lever.
    slope: [i64; 3],
    /// Bytes per cell²: xx, xy, yy, xt, yt, tt.
    curvature: [i64; 6],
    /// Over the inliers.
    bytes: u32,
    pub inliers: u16,
    overlap: u16,
    stride: u16,
    /// Cells in a lever.
    lever: f32,
    axes: Axes,
}

/// The curvature, ready to be solved.
#[derive(Debug, Clone, Copy, Default)]
struct Axes {
    /// Cells that make a turn comparable with a shift.
    lever: f32,
    /// The curvature so scaled.
    scaled: Sym3,
    /// Damping on the diagonal: inside walls that are some cells thick the field is flat, and the Hessian underestimates
    /// the curvature.
    damping: f32,
    /// Its eigenvalues and vectors, where some direction may be degenerate.
    pairs: Option<[(f32, [f32; 3]); 3]>,
}

impl Sums {
    /// `None` for a pose out of the field's reach.
    pub fn over<F: Field + ?Sized>(
        field: &F,
        points: &[ScanPoint],
        pose: Pose,
        stride: usize,
        gate: u8,
        min_curvature_share: f32,
        known: Option<&Self>,
    ) -> Option<Self> {
        let placement = Placement::new(field.shape(), pose)?;
        let shape = field.shape();
        let millimetres = math::round_to_i32(1000.0 * shape.resolution()).max(1) as u32;
        // 32 m make at most 256 levers.
        let lever_shift = u32::BITS - (128 / millimetres).leading_zeros();
        let mut sums = Self {
            stride: stride as u16,
            lever: (1u32 << lever_shift) as f32,
            ..Self::default()
        };
        let pass = Pass {
            skip: stride.saturating_sub(1),
            together: if stride == 1 {
                (TOGETHER * millimetres).next_power_of_two()
            } else {
                1
            },
            fine: (placement.shift - 6) & 31,
            lever_shift: (lever_shift + placement.shift) & 31,
            gate: i32::from(gate),
            unexplored: i32::from(field.scale().unexplored),
            // Half a 64th of a cell, so that cutting the rest off rounds.
            placement: Placement {
                x: placement.x.wrapping_add(1 << ((placement.shift - 7) & 31)),
                y: placement.y.wrapping_add(1 << ((placement.shift - 7) & 31)),
                ..placement
            },
        };
        for chunk in points.chunks(CHUNK * stride) {
            let part = match known {
                Some(_) => pass.slopes(field, chunk),
                None => pass.curves(field, chunk),
            };
            sums.add(&part);
        }
        if let Some(known) = known {
            (sums.curvature, sums.overlap) = (known.curvature, known.overlap);
        }
        sums.axes = match known {
            Some(known) => known.axes,
            None => {
                let curvature = sums.curvature();
                let lever = sums.mean_lever(&curvature);
                let scaled = curvature.theta_scaled(1.0 / lever);
                let pairs =
                    (!well_determined(&scaled, min_curvature_share)).then(|| scaled.eigen());
                // Half of what thin walls would have.
                let expected = 0.5 * Self::wall(field) * f32::from(sums.inliers);
                let damping = 0.5 * math::max(expected - (scaled.xx + scaled.yy), 0.0);
                Axes {
                    lever,
                    scaled,
                    damping,
                    pairs,
                }
            }
        };
        Some(sums)
    }

    fn add(&mut self, part: &Part) {
        for (total, part) in self.slope.iter_mut().zip(part.slope) {
            *total += i64::from(part.0);
        }
        for (total, part) in self.curvature.iter_mut().zip(part.curvature) {
            *total += i64::from(part.0);
        }
        self.bytes += part.bytes;
        self.inliers += part.inliers as u16;
        self.overlap += part.overlap as u16;
    }

    pub fn needed(&self, config: &FieldConfig, beams: usize) -> u16 {
        let share = math::round_to_i32(config.min_inlier_share * beams as f32) as u16;
        config.min_inliers.max(share) / self.stride.max(1)
    }

    /// Minus the second derivative of the sum of bytes, over (x, y, heading): bytes/cell², bytes/(cell·rad), bytes/rad².
    fn curvature(&self) -> Sym3 {
        let [xx, xy, yy, xt, yt, tt] = self.curvature.map(|sum| -(sum as f32));
        Sym3 {
            xx,
            xy,
            xt,
            yy,
            yt,
            tt,
        }
        .theta_scaled(self.lever)
    }

    /// Curvature of one beam that meets a wall head-on: what its parabola loses one cell away.
    fn wall<F: Field + ?Sized>(field: &F) -> f32 {
        let cells = field.shape().resolution() / field.scale().sigma;
        cells * cells / field.scale().step
    }

    /// Newton step (cells, cells, rad).
    pub fn step(&self, config: &FieldConfig) -> Option<[f32; 3]> {
        let [gx, gy, gt] = self.slope.map(|sum| sum as f32 / 64.0);
        let slope = [gx, gy, gt * self.lever];
        let Axes {
            lever,
            scaled,
            damping,
            pairs,
        } = self.axes;
        let slope = [slope[0], slope[1], slope[2] / lever];
        let mut step = match pairs {
            None => scaled
                .plus(&Sym3::diagonal(damping, damping, damping))
                .solve(slope)?,
            Some(pairs) => along_strong(&pairs, slope, damping, config.min_curvature_share)?,
        };
        step[2] /= lever;
        // Ten cells and a third of a radian at most: the parabolas end long before.
        let (square, turn) = (step[0] * step[0] + step[1] * step[1], math::abs(step[2]));
        if square <= 100.0 && turn <= 0.3 {
            return Some(step);
        }
        let factor = math::min(
            10.0 / math::max(math::sqrt(square), 10.0),
            0.3 / math::max(turn, 0.3),
        );
        Some(step.map(|s| s * factor))
    }

    /// Cells that make a turn comparable with a shift.
    fn mean_lever(&self, curvature: &Sym3) -> f32 {
        let shift = curvature.xx + curvature.yy;
        if shift > 0.0 && curvature.tt > 0.0 {
            math::max(math::sqrt(2.0 * curvature.tt / shift), 1.0)
        } else {
            self.lever
        }
    }

    /// `pose` moved by a step along the grid's axes, which turns about the lidar.
    pub fn moved(shape: &Shape, pose_in_map: Pose, step: [f32; 3]) -> Pose {
        let mut shift = Point::new(step[0], step[1]);
        // Most grids lie along the map's axes, and a sine in floats is dear without an FPU.
        if shape.origin().theta != 0.0 {
            let axes = Pose {
                x: 0.0,
                y: 0.0,
                ..shape.origin()
            };
            shift = axes * shift;
        }
        Pose::new(
            pose_in_map.x + shift.x * shape.resolution(),
            pose_in_map.y + shift.y * shape.resolution(),
            pose_in_map.theta + step[2],
        )
    }

    /// Height of the beams' bytes above an unexplored cell's, as a share of the peak's.
    fn score(&self, beams: usize, unexplored: u8) -> f32 {
        let above = self.bytes as f32 - f32::from(self.inliers) * f32::from(unexplored);
        above / (math::max(beams as f32, 1.0) * (255.0 - f32::from(unexplored)))
    }

    pub fn summary<F: Field + ?Sized>(
        &self,
        field: &F,
        beams: usize,
        pose: Pose,
        iterations: u8,
        config: &FieldConfig,
    ) -> Result<Match, MatchError> {
        let needed = self.needed(config, beams);
        if self.inliers < needed {
            return Err(MatchError::TooFewCorrespondences {
                found: self.inliers,
                needed,
            });
        }
        let (resolution, scale) = (field.shape().resolution(), field.scale());
        let inliers = f32::from(self.inliers);
        // A byte below the peak is a squared distance: d² = 2σ²·(255 − b)·step.
        let lost = math::max(255.0 - self.bytes as f32 / inliers, 0.0) * scale.step;
        let residual = scale.sigma * math::sqrt(2.0 * lost);
        let sigma = math::max(residual, config.min_range_sigma);
        // In beams: a wall's share of one beam is its normal squared. Then per metre and by the noise.
        let per_beam = 1.0 / Self::wall(field);
        let metres = 1.0 / resolution;
        let cells = self.curvature();
        let geometry = Sym3 {
            xx: cells.xx * metres * metres,
            xy: cells.xy * metres * metres,
            yy: cells.yy * metres * metres,
            xt: cells.xt * metres,
            yt: cells.yt * metres,
            tt: cells.tt,
        }
        .scaled(per_beam * resolution * resolution);
        // Along the map's axes instead of the grid's.
        let geometry = if field.shape().origin().theta == 0.0 {
            geometry
        } else {
            Covariance(geometry).rotated(field.shape().origin()).0
        };
        let lever = math::max(self.axes.lever * resolution, 1e-3);
        let open = match self.axes.pairs {
            None => None,
            Some(_) => {
                let pairs = geometry.theta_scaled(1.0 / lever).eigen();
                let [_, _, (strongest, _)] = pairs;
                let threshold = config.min_curvature_share * strongest;
                degeneracy::find_among(&pairs, lever, threshold)?
            }
        };
        let (information, covariance) =
            degeneracy::uncertainty(&geometry, sigma * sigma, open.as_ref())?;
        Ok(Match {
            pose,
            covariance,
            information,
            inliers: self.inliers,
            overlap: self.overlap,
            beams: beams as u16,
            residual,
            score: self.score(beams, scale.unexplored),
            degenerate_direction: open.map(|open| open.told(&covariance)),
            iterations,
            starts: None,
        })
    }
}

/// Whether for certain no direction is degenerate: an eigenvalue is at least 4·det/tr², since the other two multiply to no
/// more than tr²/4, and none is above tr.
fn well_determined(m: &Sym3, min_curvature_share: f32) -> bool {
    let trace = m.xx + m.yy + m.tt;
    let minor = m.xx * m.yy - m.xy * m.xy;
    let determinant =
        m.tt * minor - m.xx * m.yt * m.yt - m.yy * m.xt * m.xt + 2.0 * m.xy * m.xt * m.yt;
    // All three positive, not two of them negative.
    m.xx > 0.0 && minor > 0.0 && 4.0 * determinant > min_curvature_share * trace * trace * trace
}

/// Newton step along each eigenvector for itself: a degenerate one keeps the guess. `None` where all are.
fn along_strong(
    pairs: &[(f32, [f32; 3]); 3],
    slope: [f32; 3],
    damping: f32,
    min_curvature_share: f32,
) -> Option<[f32; 3]> {
    let strongest = pairs[2].0;
    if !(strongest > 0.0) {
        return None;
    }
    let mut step = [0.0f32; 3];
    for (value, axis) in pairs {
        if *value < min_curvature_share * strongest {
            continue;
        }
        let along =
            (axis[0] * slope[0] + axis[1] * slope[1] + axis[2] * slope[2]) / (value + damping);
        for k in 0..3 {
            step[k] += along * axis[k];
        }
    }
    Some(step)
}
