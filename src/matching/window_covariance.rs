//! Covariance of a pose from the scores of the poses around it: Olson, ICRA 2009, section 3.3.
//!
//! A matcher that tries poses has no curvature, but it has scores. The poses of a window of 5 by 5 by 5 steps around the
//! best one, each weighted by its likelihood, have a mean and a spread: the spread is the covariance.

use super::degeneracy::Open;
use crate::{
    geometry::Pose,
    linalg::{Covariance, Sym3},
    math,
};

/// Steps from the best pose to the edge of the window.
pub(super) const REACH: i16 = 2;

/// A guess explains the scan as well as the best pose if its log-likelihood is at most this much lower (nat): two
/// standard deviations. A larger loss means that the scores, even over five steps, are uneven farther on: then the scan does tell, and
/// the guess is wrong.
pub(super) const AS_GOOD: f32 = -2.0;

/// Weighted poses so far.
pub(super) struct WindowCovariance {
    /// From one pose to the next (m).
    cell: f32,
    /// And from one heading to the next (rad).
    heading_step: f32,
    sum: f32,
    mean: [f32; 3],
    square: [f32; 6],
}

impl WindowCovariance {
    /// No poses yet, of a window with steps of `cell` (m) and `heading_step` (rad).
    pub const fn new(cell: f32, heading_step: f32) -> Self {
        Self {
            cell,
            heading_step,
            sum: 0.0,
            mean: [0.0; 3],
            square: [0.0; 6],
        }
    }

    /// Adds the pose that is so many steps from the best one along x, y and heading, with its log-likelihood less that of
    /// the best one (nat).
    pub fn add(&mut self, steps: [i16; 3], nats: f32) {
        let weight = math::weight_exp(math::min(nats, 0.0));
        let [x, y, t] = steps.map(f32::from);
        let [x, y, t] = [x * self.cell, y * self.cell, t * self.heading_step];
        self.sum += weight;
        for (total, part) in self.mean.iter_mut().zip([x, y, t]) {
            *total += weight * part;
        }
        let products = [x * x, x * y, x * t, y * y, y * t, t * t];
        for (total, part) in self.square.iter_mut().zip(products) {
            *total += weight * part;
        }
    }

    /// Covariance of the poses added, in a frame to which the window's axes are turned by `axes` (rad).
    pub fn covariance(&self, axes: f32) -> Covariance {
        let sum = math::max(self.sum, 1e-6);
        let [x, y, t] = self.mean.map(|m| m / sum);
        let [xx, xy, xt, yy, yt, tt] = self.square.map(|s| s / sum);
        // Steps are even in themselves: a twelfth of their square is always left.
        let even = |step: f32| step * step / 12.0;
        Covariance(Sym3 {
            xx: xx - x * x + even(self.cell),
            xy: xy - x * y,
            xt: xt - x * t,
            yy: yy - y * y + even(self.cell),
            yt: yt - y * t,
            tt: tt - t * t + even(self.heading_step),
        })
        .rotated(Pose {
            x: 0.0,
            y: 0.0,
            theta: axes,
        })
    }

    /// The direction along which the scores of the window are about even, if there is one.
    pub fn open(&self, covariance: &Covariance, lever: f32) -> Option<Open> {
        /// Variance (in steps) from which on nothing holds the pose along a direction: even scores over five steps have 2.08.
        const EVEN: f32 = 1.44;
        let [_, _, (largest, direction)] = covariance.0.theta_scaled(lever).eigen();
        let [x, y, t] = direction;
        let (cell, turned) = (self.cell * self.cell, lever * self.heading_step);
        let step = (x * x + y * y) * cell + t * t * turned * turned;
        (largest > EVEN * step).then_some(Open { direction, lever })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of poses whose log-likelihood falls by so many nats a step along x and y.
    fn spread(along_x: f32, along_y: f32) -> WindowCovariance {
        let mut window = WindowCovariance::new(0.1, 0.01);
        for x in -REACH..=REACH {
            for y in -REACH..=REACH {
                for t in -REACH..=REACH {
                    let [dx, dy, dt] = [x, y, t].map(|v| f32::from(v * v));
                    window.add([x, y, t], -along_x * dx - along_y * dy - 3.0 * dt);
                }
            }
        }
        window
    }

    #[test]
    fn even_scores_are_open_and_sharp_ones_leave_the_step_itself() {
        let flat = spread(0.0, 8.0);
        let covariance = flat.covariance(0.0);
        // 0.1² · (2 + 1/12): five even cells and the evenness of one.
        assert!((covariance.0.xx - 0.0208).abs() < 1e-4, "{covariance:?}");
        assert!((covariance.0.yy - 0.0008).abs() < 1e-4, "{covariance:?}");
        let open = flat.open(&covariance, 1.0).expect("open along x");
        assert!(open.direction[0].abs() > 0.999, "{open:?}");
        let turned = flat.covariance(core::f32::consts::FRAC_PI_2);
        assert!((turned.0.yy - covariance.0.xx).abs() < 1e-6, "{turned:?}");
        let sharp = spread(8.0, 8.0);
        assert_eq!(sharp.open(&sharp.covariance(0.0), 1.0), None);
    }
}
