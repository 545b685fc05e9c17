//! The motion of the lidar while it scans, undone beam by beam.

use super::point::MAX_RANGE_MM;
use crate::{
    geometry::Twist,
    math,
    scan::{Bearing, ScanPoint},
};

/// Motion of the lidar during the sweep, undone beam by beam.
pub(super) struct Deskew {
    /// Turn per 2¹⁶ µs (2⁻³² turn).
    turn: i32,
    /// Translation per 2¹⁶ µs, in the frame at the scan's end (1/1024 mm).
    x: i32,
    y: i32,
    /// The one that the last beam was in: beams mostly come in the order of their times.
    stretch: Stretch,
}

/// Log2 of the length of a [`Stretch`] (16 µs): 8 ms, in which the fastest robot turns by 19°.
const STRETCH_BITS: u32 = 9;

/// A part of the sweep over which the lidar is taken to have moved straight and evenly.
#[derive(Clone, Copy)]
struct Stretch {
    /// How many lie between it and the scan's end.
    number: u32,
    /// Where it ends, and how much there is from there to where it begins.
    end: Place,
    more: Place,
}

/// Where the lidar was, seen from the scan's end.
#[derive(Clone, Copy)]
struct Place {
    /// 2⁻³² turn.
    turn: i32,
    /// 1/1024 mm.
    x: i32,
    y: i32,
}

impl Deskew {
    /// `None` where the motion over the sweep (s) is too small to matter (0.1 mm, 0.001°), or faster than any robot (40 rad/s,
    /// 100 m/s as seen from the scan's end).
    pub fn new(twist: Twist, duration: f32) -> Option<Self> {
        const TICK: f32 = 0.065_536;
        let motion = twist.displacement(duration);
        let still = motion.distance() < 1e-4 && math::abs(motion.theta) < 2e-5;
        // Seen from the scan's end, a turn since then makes the lidar faster than it was.
        let speed = (math::abs(twist.vx) + math::abs(twist.vy))
            * (1.0 + 0.5 * math::abs(twist.omega) * duration);
        // The negated form refuses NaN too.
        if still || !(math::abs(twist.omega) < 40.0 && speed < 100.0) {
            return None;
        }
        let none = Place {
            turn: 0,
            x: 0,
            y: 0,
        };
        Some(Self {
            turn: math::round_to_i32(
                twist.omega * TICK * (4_294_967_296.0 / core::f32::consts::TAU),
            ),
            x: math::round_to_i32(twist.vx * TICK * 1_024_000.0),
            y: math::round_to_i32(twist.vy * TICK * 1_024_000.0),
            stretch: Stretch {
                number: u32::MAX,
                end: none,
                more: none,
            },
        })
    }

    /// Where the lidar was `age` (16 µs) before the scan's end. To second order the translation of an arc is that of the
    /// chord at half its turn.
    fn place(&self, age: u32) -> Place {
        let times = |per_tick: i32| -((i64::from(per_tick) * i64::from(age)) >> 12);
        let turn = times(self.turn);
        let (s, c) = math::sin_cos_q15((turn >> 17) as u16);
        let (s, c) = (i64::from(s), i64::from(c));
        let (x, y) = (times(self.x), times(self.y));
        Place {
            turn: turn as i32,
            x: ((x * c - y * s) >> 15) as i32,
            y: ((x * s + y * c) >> 15) as i32,
        }
    }

    /// Apart, so that the loop over the beams keeps its registers.
    #[cold]
    #[inline(never)]
    fn enter(&mut self, number: u32) {
        let end = self.place(number << STRETCH_BITS);
        let start = self.place((number + 1) << STRETCH_BITS);
        self.stretch = Stretch {
            number,
            end,
            more: Place {
                turn: start.turn.wrapping_sub(end.turn),
                x: start.x.wrapping_sub(end.x),
                y: start.y.wrapping_sub(end.y),
            },
        };
    }

    /// The place that a beam hit `age` (16 µs) before the scan's end, as seen from there; `None` where it leaves the
    /// numbers' range.
    pub fn apply(&mut self, bearing: u16, range: u16, age: u16) -> Option<ScanPoint> {
        let number = u32::from(age) >> STRETCH_BITS;
        if number != self.stretch.number {
            self.enter(number);
        }
        let Stretch { end, more, .. } = self.stretch;
        let part = i32::from(age) & ((1 << STRETCH_BITS) - 1);
        // In 8 ms a robot moves less than a metre and turns by less than 20°: these stay in 32 bits.
        let turn = end.turn.wrapping_add((more.turn >> STRETCH_BITS) * part);
        let x = end.x + ((more.x * part) >> STRETCH_BITS);
        let y = end.y + ((more.y * part) >> STRETCH_BITS);
        let bearing = bearing.wrapping_add((turn.wrapping_add(1 << 15) >> 16) as u16);
        let (s, c) = math::sin_cos_q15(bearing);
        let r = i32::from(range);
        let (px, py) = (((r * c) >> 5) + x, ((r * s) >> 5) + y);
        let (px, py) = ((px + 512) >> 10, (py + 512) >> 10);
        // The translation along the beam and across it (1/64 mm).
        let (tx, ty) = (x >> 4, y >> 4);
        let (far_x, far_y) = (tx + (1 << 15), ty + (1 << 15));
        if (far_x | far_y) as u32 >> 16 != 0 {
            return seen(px, py);
        }
        let along = (tx * c + ty * s) >> 15;
        let across = (ty * c - tx * s) >> 15;
        let distance = (r << 6) + along;
        if distance < 1 << 13 || across.abs() > distance >> 4 {
            return seen(px, py);
        }
        // A small angle is its own tangent (2⁻¹⁸ rad here); the distance grows by half of its square.
        let angle = (across * math::reciprocal(distance as u32 >> 6) as i32) >> 12;
        let range = (distance + ((across * angle) >> 19) + 32) >> 6;
        if range > i32::from(MAX_RANGE_MM) {
            return None;
        }
        Some(ScanPoint {
            x: px as i16,
            y: py as i16,
            // 2¹⁶/2π of the bearing's units are a radian, which `angle` counts in 2⁻¹⁸: 163/2¹² of one each.
            bearing: Bearing(bearing.wrapping_add(((angle * 163 + (1 << 11)) >> 12) as u16)),
            range: range as u16,
        })
    }
}

/// The point at a place (mm); `None` where it is too far away.
// Seldom needed: beside the lidar, or where it moves half a metre in a revolution.
#[cold]
#[inline(never)]
fn seen(x: i32, y: i32) -> Option<ScanPoint> {
    let limit = i32::from(MAX_RANGE_MM);
    if !(-limit..=limit).contains(&x) || !(-limit..=limit).contains(&y) {
        return None;
    }
    let range = math::isqrt((x * x + y * y) as u32);
    (range <= u32::from(MAX_RANGE_MM)).then_some(ScanPoint {
        x: x as i16,
        y: y as i16,
        bearing: Bearing(math::atan2_turn(y, x)),
        range: range as u16,
    })
}
