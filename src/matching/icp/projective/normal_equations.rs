//! What passes know of the pose: the normal equations of a Gauss–Newton step, and how well the points fit.

use crate::{linalg::Sym3, matching::icp::projective::fixed_pose::FixedPose, math};

/// The normal equations, in the units of a pass: normals Q10, levers Q10 mm shifted down, residuals 1/16 mm.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// `Σ w a aᵀ`, `a` the row `(mx, my, lever)`.
    pub h: Sym3,
    /// `Σ w a e`.
    pub b: [f32; 3],
    /// Points nearer to their line than the gate.
    pub inliers: u16,
    /// `Σ w`, Q8.
    pub weight: f32,
    /// `Σ w e²` (mm², Q8).
    pub cost: f32,
    /// `Σ w e e′`, `e′` the residual of the point before (mm², Q8).
    pub cross: f32,
}

/// A Gauss–Newton step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// See [`FixedPose::moved`].
    pub by: [f32; 3],
    /// What it takes off the weighted sum of the squared residuals, were they linear (mm²): over the variance of a residual,
    /// the square of the step in standard deviations of the pose.
    pub gain: f32,
}

/// How much larger errors are than the residuals of one scan say: the reference's noise is as large as the scan's and
/// averaged over in its lines.
const INFLATION: f32 = 1.6;

/// Share of all that the points know which is added to each direction of a step.
const STILL: f32 = 0.001;
/// Normals are Q10.
const NORMAL: f32 = 1.0 / 1024.0;

impl Sums {
    /// What two passes over different points know together.
    pub fn plus(&self, other: &Self) -> Self {
        let ([ax, ay, at], [bx, by, bt]) = (self.b, other.b);
        Self {
            h: self.h.plus(&other.h),
            b: [ax + bx, ay + by, at + bt],
            inliers: self.inliers + other.inliers,
            weight: self.weight + other.weight,
            cost: self.cost + other.cost,
            cross: self.cross + other.cross,
        }
    }

    /// As a pass over the same points would tell it after a step, if that changes neither lines nor weights.
    pub fn after(&self, [x, y, turn]: [f32; 3], lever_shift: u32) -> Self {
        let by = [x * NORMAL, y * NORMAL, turn / per_lever(lever_shift)];
        let ([bx, by, bt], [ex, ey, et]) = (self.b, self.h.times(by));
        Self {
            b: [bx + ex, by + ey, bt + et],
            ..*self
        }
    }

    /// Sum of the weights.
    pub fn total_weight(&self) -> f32 {
        self.weight / 256.0
    }

    /// How alike the residuals of neighbouring points are, 0 to 0.9: where they share an error of the reference's
    /// surface, they are worth fewer points than there are.
    fn correlation(&self) -> f32 {
        if self.cost <= 0.0 {
            return 0.0;
        }
        math::max(0.0, math::min(0.9, self.cross / self.cost))
    }

    /// How much larger the variance of the pose is than independent residuals would make it.
    pub fn inflation(&self) -> f32 {
        let alike = self.correlation();
        INFLATION * (1.0 + alike) / (1.0 - alike)
    }

    /// Root of the weighted mean square residual (m).
    pub fn residual(&self) -> f32 {
        if self.weight <= 0.0 {
            return 0.0;
        }
        math::sqrt(self.cost / self.weight) * 1e-3
    }

    /// The Gauss–Newton step by the normal equations: see [`FixedPose::moved`]. `None` where they are singular.
    pub fn step(&self, lever_shift: u32) -> Option<Step> {
        // A direction that the points leave open, but for the noise of the normals, keeps still.
        let ridge = STILL * (self.h.xx + self.h.yy);
        let h = self
            .h
            .plus(&Sym3::diagonal(ridge, ridge, STILL * self.h.tt));
        let [dx, dy, turn] = h.solve(self.b)?;
        let [bx, by, bt] = self.b;
        Some(Step {
            by: [-dx / NORMAL, -dy / NORMAL, -turn * per_lever(lever_shift)],
            gain: (bx * dx + by * dy + bt * turn) * (1.0 / 256.0),
        })
    }

    /// `Σ w a aᵀ` over a motion of the lidar, which is at `at` (1, m, m²).
    pub fn curvature(&self, lever_shift: u32, at: FixedPose) -> Sym3 {
        let lever = (1u32 << (lever_shift & 31)) as f32 * 1e-3;
        let at = at.pose();
        self.h
            .scaled(NORMAL * NORMAL)
            .theta_scaled(lever)
            .about(at.x, at.y)
    }
}

/// Rad of a step in the unit of levers.
fn per_lever(lever_shift: u32) -> f32 {
    64.0 / (1u32 << (lever_shift & 31)) as f32
}
