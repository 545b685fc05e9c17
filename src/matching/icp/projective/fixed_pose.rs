//! A pose in whole numbers, and the steps that move it.

use crate::{geometry::Pose, math};

/// A pose in whole numbers: what a pass works with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FixedPose {
    /// 1/16 mm.
    pub x: i32,
    /// 1/16 mm.
    pub y: i32,
    /// 2⁻³² turn.
    pub turn: u32,
}

/// 1/16 mm in a metre.
const PER_METRE: f32 = 16_000.0;
/// 2⁻³² turns in a radian.
const PER_RADIAN: f32 = 4_294_967_296.0 / core::f32::consts::TAU;

impl FixedPose {
    /// Nearest fixed pose; `None` for one that is not finite or farther than 27 m away.
    pub fn new(pose: Pose) -> Option<Self> {
        let inside = |v: f32| v > -27.0 && v < 27.0;
        if !(inside(pose.x) && inside(pose.y) && pose.theta.is_finite()) {
            return None;
        }
        Some(Self {
            x: math::round_to_i32(pose.x * PER_METRE),
            y: math::round_to_i32(pose.y * PER_METRE),
            turn: math::round_to_i32(math::wrap_angle(pose.theta) * PER_RADIAN) as u32,
        })
    }

    /// Metres and radians again.
    pub fn pose(self) -> Pose {
        Pose::new(
            self.x as f32 / PER_METRE,
            self.y as f32 / PER_METRE,
            self.turn as i32 as f32 / PER_RADIAN,
        )
    }

    /// Started elsewhere.
    pub fn moved_far(self, by: [f32; 3]) -> Self {
        let (s, c) = math::sin_cos(self.turn as i32 as f32 / PER_RADIAN);
        let ahead = |v: f32| math::round_to_i32(v * PER_METRE);
        Self {
            x: self.x + ahead(c * by[0] - s * by[1]),
            y: self.y + ahead(s * by[0] + c * by[1]),
            turn: self
                .turn
                .wrapping_add(math::round_to_i32(math::wrap_angle(by[2]) * PER_RADIAN) as u32),
        }
    }

    /// Distance between the two places (m).
    pub fn distance_only(self, other: Self) -> f32 {
        let (dx, dy) = (
            (self.x - other.x) as f32 / PER_METRE,
            (self.y - other.y) as f32 / PER_METRE,
        );
        math::sqrt(dx * dx + dy * dy)
    }

    /// Distance between two poses (m), a turn counted at 3 m.
    pub fn distance(self, other: Self) -> f32 {
        let turn = math::abs(self.turn.wrapping_sub(other.turn) as i32 as f32 / PER_RADIAN);
        self.distance_only(other) + 3.0 * turn
    }

    /// Moved by a step: by `dx`, `dy` (1/16 mm) and by `turn` (rad) about the reference's origin, itself held within
    /// 0.5 m and 0.3 rad, and the pose within [`REACH_MM`] of where the search started.
    pub fn moved(self, [dx, dy, turn]: [f32; 3], home: Self) -> Self {
        let held = |v: f32, most: f32| math::max(math::min(v, most), -most);
        let turn = held(turn, 0.3);
        let step = |d: f32| math::round_to_i32(held(d, 0.5 * PER_METRE));
        let reach = |v: i32, home: i32| v.max(home - 16 * REACH_MM).min(home + 16 * REACH_MM);
        Self {
            x: reach(self.x + step(dx - turn * self.y as f32), home.x),
            y: reach(self.y + step(dy + turn * self.x as f32), home.y),
            turn: self
                .turn
                .wrapping_add(math::round_to_i32(turn * PER_RADIAN) as u32),
        }
    }
}

/// How far from its start a search may get (mm).
pub(super) const REACH_MM: i32 = 4000;

/// Length of a step of [`FixedPose::moved`] (m), a turn counted at 3 m.
pub(super) fn length(step: [f32; 3]) -> f32 {
    let [x, y, turn] = step.map(math::abs);
    (x + y) / PER_METRE + 3.0 * turn
}
