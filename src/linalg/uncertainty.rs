//! What is known of a pose and how far off it may be: each the inverse of the other.

use super::Sym3;
use crate::{geometry::Pose, math};

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
    pub fn plus(&self, other: &Self) -> Self {
        Self(self.0.plus(&other.0))
    }

    /// The same error seen `(dx, dy)` (m) farther on, where an error of heading also is one of position.
    #[must_use]
    pub fn transported(&self, dx: f32, dy: f32) -> Self {
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
    pub fn rotated(&self, pose: Pose) -> Self {
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
