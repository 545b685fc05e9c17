//! Poses in `f64`: the truth.

use beamfix::geometry::Pose;

/// Where something really is (m, rad).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TruePose {
    /// Forward (m).
    pub x: f64,
    /// Left (m).
    pub y: f64,
    /// Heading, counter-clockwise (rad).
    pub theta: f64,
}

/// `angle` (rad) in `[-π, π)`.
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    use core::f64::consts::{PI, TAU};
    let wrapped = angle - TAU * libm::floor((angle + PI) / TAU);
    if wrapped < PI { wrapped } else { -PI }
}

impl TruePose {
    /// Pose at `(x, y)` (m) with heading `theta` (rad).
    #[must_use]
    pub const fn new(x: f64, y: f64, theta: f64) -> Self {
        Self { x, y, theta }
    }

    /// This pose, then `other` in its frame.
    #[must_use]
    pub fn then(self, other: Self) -> Self {
        let (s, c) = (libm::sin(self.theta), libm::cos(self.theta));
        Self {
            x: self.x + c * other.x - s * other.y,
            y: self.y + s * other.x + c * other.y,
            theta: wrap(self.theta + other.theta),
        }
    }

    /// `other` as seen from this pose.
    #[must_use]
    pub fn between(self, other: Self) -> Self {
        let (s, c) = (libm::sin(self.theta), libm::cos(self.theta));
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        Self {
            x: c * dx + s * dy,
            y: c * dy - s * dx,
            theta: wrap(other.theta - self.theta),
        }
    }

    /// After `forward` metres along an arc that turns by `turn` (rad).
    #[must_use]
    pub fn along_arc(self, forward: f64, turn: f64) -> Self {
        let half = 0.5 * turn;
        let chord = if half.abs() < 1e-6 {
            forward
        } else {
            forward * libm::sin(half) / half
        };
        let direction = self.theta + half;
        Self {
            x: self.x + chord * libm::cos(direction),
            y: self.y + chord * libm::sin(direction),
            theta: wrap(self.theta + turn),
        }
    }

    /// The share `share` of this motion, along a straight line.
    #[must_use]
    pub fn part(self, share: f64) -> Self {
        Self {
            x: share * self.x,
            y: share * self.y,
            theta: share * self.theta,
        }
    }

    /// This pose in a mirror that lies along the x axis.
    #[must_use]
    pub fn mirrored(self) -> Self {
        Self {
            x: self.x,
            y: -self.y,
            theta: -self.theta,
        }
    }

    /// Distance of the position from the origin (m).
    #[must_use]
    pub fn distance(self) -> f64 {
        libm::sqrt(self.x * self.x + self.y * self.y)
    }
}

impl From<TruePose> for Pose {
    fn from(pose: TruePose) -> Self {
        Pose::new(pose.x as f32, pose.y as f32, pose.theta as f32)
    }
}

impl From<Pose> for TruePose {
    fn from(pose: Pose) -> Self {
        Self::new(f64::from(pose.x), f64::from(pose.y), f64::from(pose.theta))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_of_a_circle_ends_beside_its_centre() {
        let quarter = core::f64::consts::FRAC_PI_2;
        let end = TruePose::default().along_arc(2.0 * quarter, quarter);
        let off = TruePose::new(2.0, 2.0, quarter).between(end);
        assert!(off.distance() < 1e-12 && off.theta.abs() < 1e-12, "{end:?}");
        let straight = TruePose::new(1.0, 2.0, quarter).along_arc(3.0, 0.0);
        assert!((straight.y - 5.0).abs() < 1e-12, "{straight:?}");
    }

    #[test]
    fn between_undoes_then() {
        let (a, b) = (TruePose::new(1.0, -2.0, 3.0), TruePose::new(0.5, 0.25, 2.0));
        let off = b.between(a.between(a.then(b)));
        assert!(off.distance() < 1e-12 && off.theta.abs() < 1e-12);
    }
}
