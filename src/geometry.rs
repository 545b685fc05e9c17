//! Points, poses and twists in the plane.

mod ego_motion;

pub use ego_motion::EgoMotion;

use core::ops::Mul;

use crate::math;

/// A place in the plane (m).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Point {
    /// Forward (m).
    pub x: f32,
    /// Left (m).
    pub y: f32,
}

impl Point {
    /// Point at `(x, y)` (m).
    #[must_use]
    pub const fn new(x: f32, y: f32) -> Self {
        Self { x, y }
    }

    /// Distance from the origin (m).
    #[must_use]
    pub fn norm(self) -> f32 {
        math::sqrt(self.x * self.x + self.y * self.y)
    }
}

/// Where something is and which way it looks: an element of SE(2).
///
/// Read `map_from_robot * robot_from_lidar` as "frames cancel". The product is composition,
/// `pose * point` the transform of a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    /// Forward (m).
    pub x: f32,
    /// Left (m).
    pub y: f32,
    /// Heading, counter-clockwise, in `[-π, π)` (rad).
    pub theta: f32,
}

impl Pose {
    /// No motion.
    pub const IDENTITY: Self = Self {
        x: 0.0,
        y: 0.0,
        theta: 0.0,
    };

    /// Pose at `(x, y)` (m) with heading `theta` (rad), which is wrapped into `[-π, π)`.
    #[must_use]
    pub fn new(x: f32, y: f32, theta: f32) -> Self {
        Self {
            x,
            y,
            theta: math::wrap_angle(theta),
        }
    }

    /// The pose that undoes this one: `a.inverse() * a` is the identity.
    #[must_use]
    #[inline(never)]
    pub fn inverse(self) -> Self {
        let (s, c) = math::sin_cos(self.theta);
        Self::new(
            -(c * self.x + s * self.y),
            s * self.x - c * self.y,
            -self.theta,
        )
    }

    /// `other` as seen from this pose: `self.inverse() * other` without the detour.
    #[must_use]
    #[inline(never)]
    pub fn between(self, other: Self) -> Self {
        let (s, c) = math::sin_cos(self.theta);
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        Self::new(c * dx + s * dy, c * dy - s * dx, other.theta - self.theta)
    }

    /// Distance of the position from the origin (m).
    #[must_use]
    pub fn distance(self) -> f32 {
        Point::new(self.x, self.y).norm()
    }

    /// Whether all three numbers are finite.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.theta.is_finite()
    }
}

impl Mul for Pose {
    type Output = Self;

    // Once in flash, as the other steps here are: thirty copies cost a board without an FPU 2 KB, and no loop over points
    // composes poses.
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        let (s, c) = math::sin_cos(self.theta);
        Self::new(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            self.theta + other.theta,
        )
    }
}

impl Mul<Point> for Pose {
    type Output = Point;

    fn mul(self, point: Point) -> Point {
        let (s, c) = math::sin_cos(self.theta);
        Point::new(
            self.x + c * point.x - s * point.y,
            self.y + s * point.x + c * point.y,
        )
    }
}

/// Velocity in the robot's own frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Twist {
    /// Forward (m/s).
    pub vx: f32,
    /// Left (m/s).
    pub vy: f32,
    /// Counter-clockwise (rad/s).
    pub omega: f32,
}

impl Twist {
    /// Standing still.
    pub const ZERO: Self = Self {
        vx: 0.0,
        vy: 0.0,
        omega: 0.0,
    };

    /// What this velocity has more than another one.
    #[must_use]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self {
            vx: self.vx - other.vx,
            vy: self.vy - other.vy,
            omega: self.omega - other.omega,
        }
    }

    /// Speed of the position (m/s).
    #[must_use]
    pub(crate) fn speed(self) -> f32 {
        Point::new(self.vx, self.vy).norm()
    }

    /// The constant velocity that leads along `motion` in `seconds`: the inverse of [`Twist::displacement`].
    ///
    /// Zero for a time that is not positive.
    #[must_use]
    #[inline(never)]
    pub fn from_motion(motion: Pose, seconds: f32) -> Self {
        if !(seconds > 0.0) {
            return Self::ZERO;
        }
        // The arc's chord is seen under half the angle: rotate it back and stretch it to the arc.
        let half = 0.5 * motion.theta;
        let (s, c) = math::sin_cos(half);
        let stretch = if math::abs(half) < 1e-3 {
            1.0 + half * half / 6.0
        } else {
            half / s
        };
        let k = stretch / seconds;
        Self {
            vx: k * (c * motion.x + s * motion.y),
            vy: k * (c * motion.y - s * motion.x),
            omega: motion.theta / seconds,
        }
    }

    /// Motion along the arc in `seconds` (the exponential map of SE(2)).
    #[must_use]
    #[inline(never)]
    pub fn displacement(self, seconds: f32) -> Pose {
        let theta = self.omega * seconds;
        let half = 0.5 * theta;
        let (s, c) = math::sin_cos(half);
        let shrink = if math::abs(half) < 1e-3 {
            1.0 - half * half / 6.0
        } else {
            s / half
        };
        let k = shrink * seconds;
        Pose::new(
            k * (c * self.vx - s * self.vy),
            k * (s * self.vx + c * self.vy),
            theta,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Pose, b: Pose) -> bool {
        (a.x - b.x).abs() < 2e-6
            && (a.y - b.y).abs() < 2e-6
            && math::wrap_angle(a.theta - b.theta).abs() < 2e-6
    }

    const POSES: [Pose; 4] = [
        Pose::IDENTITY,
        Pose {
            x: 1.0,
            y: -2.0,
            theta: 0.7,
        },
        Pose {
            x: -0.3,
            y: 0.4,
            theta: -3.1,
        },
        Pose {
            x: 2.5,
            y: 1.5,
            theta: 3.0,
        },
    ];

    #[test]
    fn inverse_and_between_cancel() {
        for a in POSES {
            assert!(close(a.inverse() * a, Pose::IDENTITY), "{a:?}");
            assert!(close(a * a.inverse(), Pose::IDENTITY), "{a:?}");
            for b in POSES {
                assert!(close(a * a.between(b), b), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn composition_moves_points_in_the_same_way() {
        let p = Point::new(0.6, -0.2);
        for a in POSES {
            for b in POSES {
                let (left, right) = ((a * b) * p, a * (b * p));
                assert!((left.x - right.x).abs() < 2e-6 && (left.y - right.y).abs() < 2e-6);
            }
        }
    }

    #[test]
    fn a_quarter_turn_looks_left() {
        let p = Pose::new(1.0, 2.0, core::f32::consts::FRAC_PI_2) * Point::new(1.0, 0.0);
        assert!(
            (p.x - 1.0).abs() < 1e-6 && (p.y - 3.0).abs() < 1e-6,
            "{p:?}"
        );
    }

    #[test]
    fn twist_and_motion_are_inverse() {
        for motion in POSES {
            let twist = Twist::from_motion(motion, 0.1);
            assert!(
                close(twist.displacement(0.1), motion),
                "{motion:?} {twist:?}"
            );
        }
        assert_eq!(Twist::from_motion(POSES[1], 0.0), Twist::ZERO);
        assert_eq!(Twist::from_motion(POSES[1], f32::NAN), Twist::ZERO);
    }
}
