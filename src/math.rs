//! The crate's only elementary functions: the same bits on every machine, with the error stated.
//!
//! Call them as functions. A method such as `x.sin()` is std's on the host and has other bits there; clippy's
//! `disallowed_methods` refuses it. Each error below is measured against `f64` in `host-tests/house/src/math.rs`.
//!
//! | function | domain | largest error | cost on an M4F |
//! | --- | --- | --- | --- |
//! | [`sqrt`] | all | correctly rounded | 54 instructions |
//! | [`sin_cos`] | ±100 rad | 1.5e-7 | about 50 |
//! | [`atan2`] | all finite | 4e-7 rad | 65 |
//! | [`exp`] | −87…88 | 1.5e-7 relative | 57 |
//! | [`ln`] | normal, positive | 1e-7 relative to max(1, ‖ln x‖) | about 60 |
//! | [`weight_exp`] | −80…0 | 2.5e-3 relative | about 15 |
//! | [`sin_cos_q15`] | all bearings | 1.3 units in the last place (4e-5) | about 15 |
//! | [`sin_cos_q15_fine`] | all angles | 1.7 units in the last place (5e-5) | about 40 |
//! | [`atan2_turn`] | all but (0, 0) | 1.1 of 1/65536 turn (0.006°) | about 30 |
//! | [`reciprocal()`] | 128…32 767 | 0.5 % | about 12 |
//! | [`rough_length`] | magnitudes to 2²⁸ | 3 % | about 12 |
//! | [`isqrt`] | all `u32` | exact floor | about 120 |

pub mod random;
pub mod reciprocal;
pub mod turn;

pub use reciprocal::{reciprocal, rough_length};
pub use turn::{atan2_turn, sin_cos_q15, sin_cos_q15_fine};

use core::f32::consts::{FRAC_2_PI, PI};

/// Magnitude of `x`.
#[must_use]
pub fn abs(x: f32) -> f32 {
    if x < 0.0 { -x } else { x }
}

/// Smaller of two; the second if either is NaN.
#[must_use]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Larger of two; the second if either is NaN.
#[must_use]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Square root, correctly rounded; NaN for negative numbers.
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Nearest whole number, halves away from zero; saturates at the limits of `i32`, 0 for NaN.
#[must_use]
pub fn round_to_i32(x: f32) -> i32 {
    (if x < 0.0 { x - 0.5 } else { x + 0.5 }) as i32
}

/// Whole millimetres in a length (m): 0 for one that is negative or not a number, 65 535 for 65.535 m and more.
#[must_use]
pub fn to_mm(metres: f32) -> u16 {
    let mm = round_to_i32(metres * 1000.0);
    if mm < 0 {
        0
    } else if mm > 0xffff {
        0xffff
    } else {
        mm as u16
    }
}

/// `angle` (rad) brought into `[-π, π)`.
///
/// Meant for angles of a few turns; an angle that is not finite is returned as it is.
#[must_use]
#[inline(never)]
pub fn wrap_angle(angle: f32) -> f32 {
    const TURN: f32 = 2.0 * PI;
    if (-PI..PI).contains(&angle) || !angle.is_finite() {
        return angle;
    }
    let mut wrapped = angle - TURN * (round_to_i32(angle / TURN) as f32);
    if wrapped < -PI {
        wrapped += TURN;
    }
    if wrapped >= PI {
        wrapped -= TURN;
    }
    // Rounding can leave the last bit on the wrong side of an end.
    if (-PI..PI).contains(&wrapped) {
        wrapped
    } else {
        -PI
    }
}

/// Sine and cosine of `x` (rad), in this order.
///
/// Minimax polynomials of the Cephes library on an eighth of a turn. The error grows with `|x|` beyond 100
/// rad, where `f32` itself no longer tells angles apart well.
#[must_use]
// Once in flash, as `wrap_angle` and the steps of `geometry` are: dozens of copies of 100 to 350 bytes cost more than the
// calls, none of which is in a hot loop.
#[inline(never)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    // π/2 in three parts, the first two with zeros at the end: k times each is exact.
    const P1: f32 = 1.570_312_5;
    const P2: f32 = 4.837_512_969_970_703e-4;
    const P3: f32 = 7.549_789_948_768_648e-8;
    let quadrant = round_to_i32(x * FRAC_2_PI);
    let k = quadrant as f32;
    let r = ((x - k * P1) - k * P2) - k * P3;
    let z = r * r;
    let s = r + r * z * (-1.666_665_5e-1 + z * (8.332_161e-3 - z * 1.951_529_6e-4));
    let c = 1.0 - 0.5 * z + z * z * (4.166_664_6e-2 + z * (-1.388_731_6e-3 + z * 2.443_315_7e-5));
    match quadrant & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Direction of `(x, y)` in `[-π, π]` (rad), 0 for (0, 0).
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// e to the power of `x`.
#[must_use]
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// Natural logarithm; −∞ for 0, NaN for negative numbers.
#[must_use]
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// e to the power of `x ≤ 0`, roughly: micromath's approximation, for weights and displays only.
///
/// A weight that is off by a few thousandths moves no optimum that matters; nothing geometric may use this.
#[must_use]
pub fn weight_exp(x: f32) -> f32 {
    if x < -80.0 {
        return 0.0;
    }
    micromath::F32Ext::exp(x)
}

/// Whole square root, rounded down.
#[must_use]
pub const fn isqrt(n: u32) -> u32 {
    let mut remainder = n;
    let mut root = 0;
    let mut bit = 1 << 30;
    while bit != 0 {
        if remainder >= root + bit {
            remainder -= root + bit;
            root = (root >> 1) + bit;
        } else {
            root >>= 1;
        }
        bit >>= 2;
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_wrap_into_the_half_open_turn() {
        for (angle, expected) in [
            (0.0, 0.0),
            (PI, -PI),
            (-PI, -PI),
            (3.0 * PI, -PI),
            (4.0, 4.0 - 2.0 * PI),
            (-4.0, 2.0 * PI - 4.0),
        ] {
            let wrapped = wrap_angle(angle);
            let off = (wrapped - expected).abs();
            assert!(
                off < 1e-6 || (off - 2.0 * PI).abs() < 1e-6,
                "{angle}: {wrapped}"
            );
            assert!((-PI..PI).contains(&wrapped), "{angle}: {wrapped}");
        }
        assert!(wrap_angle(f32::NAN).is_nan());
        assert!(wrap_angle(f32::INFINITY).is_infinite());
    }

    #[test]
    fn lengths_end_at_the_ends_of_their_numbers() {
        for (metres, mm) in [
            (-0.1, 0),
            (-1e9, 0),
            (0.0, 0),
            (f32::NAN, 0),
            (0.0126, 13),
            (65.535, 65_535),
            (1e9, 65_535),
        ] {
            assert_eq!(to_mm(metres), mm, "{metres}");
        }
    }

    #[test]
    fn weights_fall_to_nothing() {
        let weights = [0.0, -0.5, -3.0, -20.0, -79.0].map(weight_exp);
        assert!(weights.is_sorted_by(|a, b| a > b), "{weights:?}");
        assert!((weights[0] - 1.0).abs() < 0.01 && weights[4] >= 0.0);
        for x in [-81.0, -100.0, -1e9, f32::NEG_INFINITY] {
            assert_eq!(weight_exp(x), 0.0, "{x}");
        }
    }

    #[test]
    fn isqrt_is_the_floor() {
        for n in (0..70_000).chain([u32::MAX, u32::MAX - 1, 0xfffe_0001, 0xfffe_0000]) {
            let r = u64::from(isqrt(n));
            assert!(
                r * r <= u64::from(n) && (r + 1) * (r + 1) > u64::from(n),
                "{n}"
            );
        }
    }
}
