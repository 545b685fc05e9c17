//! Symmetric 3×3 matrices over `(x, y, θ)`: information, covariance, eigenvalues.

mod sym3;

use crate::{geometry::Pose, math};
pub use sym3::{Root, Sym3};

/// What a match knows about a pose: the inverse of a [`Covariance`] (1/m², 1/(m·rad), 1/rad²).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Information(pub Sym3);

/// How far off a pose may be: variances and their products (m², m·rad, rad²).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Covariance(pub Sym3);

impl Information {
    /// The covariance it stands for; `None` where a direction is not determined.
    #[must_use]
    pub fn covariance(&self) -> Option<Covariance> {
        self.0.inverse().map(Covariance)
    }
}

impl Covariance {
    /// The entries xx, xy, yy (m²), xθ, yθ (m·rad), θθ (rad²): the order of every table and message of this project.
    ///
    /// x and y are those of the frame in which the pose is given, not the robot's own.
    #[must_use]
    pub const fn to_array(self) -> [f32; 6] {
        let Sym3 {
            xx,
            xy,
            xt,
            yy,
            yt,
            tt,
        } = self.0;
        [xx, xy, yy, xt, yt, tt]
    }

    /// The information it stands for; `None` unless it is positive definite.
    #[must_use]
    pub fn information(&self) -> Option<Information> {
        self.0.inverse().map(Information)
    }

    /// Sum of two independent errors.
    #[must_use]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(self.0.plus(&other.0))
    }

    /// The same error seen `(dx, dy)` (m) farther on, where an error of heading also is one of position.
    #[must_use]
    pub(crate) fn transported(&self, dx: f32, dy: f32) -> Self {
        let m = &self.0;
        Self(Sym3 {
            xx: m.xx - 2.0 * dy * m.xt + dy * dy * m.tt,
            xy: m.xy + dx * m.xt - dy * m.yt - dx * dy * m.tt,
            xt: m.xt - dy * m.tt,
            yy: m.yy + 2.0 * dx * m.yt + dx * dx * m.tt,
            yt: m.yt + dx * m.tt,
            tt: m.tt,
        })
    }

    /// Turned with the frame: the covariance of a pose given in a frame that `pose` places in another one.
    ///
    /// Only the rotation counts: errors of position turn with it, the error of the heading stays.
    #[must_use]
    pub(crate) fn rotated(&self, pose: Pose) -> Self {
        let (s, c) = math::sin_cos(pose.theta);
        let m = &self.0;
        Self(Sym3 {
            xx: c * c * m.xx - 2.0 * c * s * m.xy + s * s * m.yy,
            xy: c * s * (m.xx - m.yy) + (c * c - s * s) * m.xy,
            xt: c * m.xt - s * m.yt,
            yy: s * s * m.xx + 2.0 * c * s * m.xy + c * c * m.yy,
            yt: s * m.xt + c * m.yt,
            tt: m.tt,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const M: Sym3 = Sym3 {
        xx: 4.0,
        xy: 1.0,
        xt: -0.5,
        yy: 3.0,
        yt: 0.25,
        tt: 2.0,
    };

    #[test]
    fn inverse_times_matrix_is_one() {
        let inverse = M.inverse().expect("positive definite");
        for (i, unit) in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .into_iter()
            .enumerate()
        {
            let back = inverse.times(M.times(unit));
            for (k, value) in back.into_iter().enumerate() {
                let expected = if k == i { 1.0 } else { 0.0 };
                assert!((value - expected).abs() < 1e-6, "{i} {k}: {value}");
            }
        }
    }

    #[test]
    fn a_root_times_its_transpose_is_the_matrix() {
        let root = M.root().expect("positive definite");
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| root.times(e));
        let back = columns
            .map(Sym3::outer)
            .iter()
            .fold(Sym3::default(), |sum, outer| sum.plus(outer));
        for (a, b) in Covariance(back)
            .to_array()
            .into_iter()
            .zip(Covariance(M).to_array())
        {
            assert!((a - b).abs() < 1e-5, "{back:?}");
        }
        let inverse = M.inverse().and_then(|inverse| inverse.root());
        let product = root.determinant() * inverse.expect("so is its inverse").determinant();
        assert!((product - 1.0).abs() < 1e-5, "{product}");
        assert_eq!(Sym3::diagonal(1.0, 0.0, 1.0).root(), None);
    }

    #[test]
    fn singular_indefinite_and_nan_are_refused() {
        for m in [
            Sym3::diagonal(1.0, 0.0, 1.0),
            Sym3::diagonal(1.0, -1.0, 1.0),
            Sym3::diagonal(f32::NAN, 1.0, 1.0),
            Sym3::diagonal(1.0, 1.0, f32::INFINITY),
            Sym3 {
                xy: 1.0,
                ..Sym3::diagonal(1.0, 1.0, 1.0)
            },
        ] {
            assert_eq!(m.inverse(), None, "{m:?}");
        }
    }

    #[test]
    fn eigenvectors_are_stretched_by_their_eigenvalues() {
        let pairs = M.eigen();
        assert!(pairs[0].0 <= pairs[1].0 && pairs[1].0 <= pairs[2].0);
        for (value, vector) in pairs {
            let image = M.times(vector);
            let norm: f32 = vector.iter().map(|v| v * v).sum();
            assert!((norm - 1.0).abs() < 1e-5, "{vector:?}");
            for k in 0..3 {
                assert!(
                    (image[k] - value * vector[k]).abs() < 1e-5,
                    "{value} {vector:?}"
                );
            }
        }
        let trace: f32 = pairs.iter().map(|p| p.0).sum();
        assert!((trace - 9.0).abs() < 1e-5);
    }

    #[test]
    fn sandwich_with_the_inverse_is_the_inverse() {
        let inverse = M.inverse().expect("positive definite");
        let congruent = M.congruent(&inverse);
        assert!((congruent.xx - inverse.xx).abs() < 1e-6);
        assert!((congruent.yt - inverse.yt).abs() < 1e-6);
    }

    #[test]
    fn a_turn_about_another_point_is_a_turn_and_a_shift() {
        let (x, y) = (0.7, -0.4);
        let moved = M.about(x, y);
        for v in [[0.0, 0.0, 1.0], [0.3, -0.2, 0.5], [1.0, 2.0, -1.0]] {
            let [a, b, t] = v;
            let about_origin = M.quadratic([a + t * y, b - t * x, t]);
            assert!((moved.quadratic(v) - about_origin).abs() < 1e-5, "{v:?}");
        }
    }

    #[test]
    fn an_error_of_heading_becomes_one_of_position_farther_on() {
        let carried = Covariance(Sym3::diagonal(0.0, 0.0, 0.01)).transported(2.0, 0.0);
        assert!((carried.0.yy - 0.04).abs() < 1e-7 && carried.0.xx.abs() < 1e-7);
        assert!((carried.0.yt - 0.02).abs() < 1e-7);
        let there_and_back = Covariance(M).transported(0.3, -0.7).transported(-0.3, 0.7);
        assert!(
            (there_and_back.0.xx - M.xx).abs() < 1e-5 && (there_and_back.0.xy - M.xy).abs() < 1e-5
        );
    }

    #[test]
    fn a_quarter_turn_swaps_the_axes_of_a_covariance() {
        let turned = Covariance(Sym3::diagonal(4.0, 1.0, 0.5)).rotated(Pose::new(
            9.0,
            9.0,
            core::f32::consts::FRAC_PI_2,
        ));
        assert!((turned.0.xx - 1.0).abs() < 1e-5 && (turned.0.yy - 4.0).abs() < 1e-5);
        assert!(turned.0.xy.abs() < 1e-5 && (turned.0.tt - 0.5).abs() < 1e-6);
    }
}
