//! The makers' corrections for the distance between laser and receiver.

use crate::math::{atan2_turn, isqrt};

/// `atan((0.11923 d - 18.975571) / (d + 5.9))`, d in mm, as a fraction of a turn; without a range the `previous` one.
pub(super) fn ld14_shift(previous: u32, mm: u16) -> u32 {
    if mm == 0 {
        return previous;
    }
    // Both sides times 4096: 488.366 and 77 723.9 and 24 166.4.
    let d = i32::from(mm);
    let y = d * 488 + ((d * 3) >> 3) - 77_724;
    u32::from(atan2_turn(y, d * 4096 + 24_166)) << 16
}

/// Shift of the angle, and the range from the middle of the sensor (mm/4).
pub(super) fn lds02_parallax(mm: u16) -> (u32, u32) {
    if mm == 0 {
        return (0, 0);
    }
    // x = d + 5.9, y = 0.11923 d - 20.14, in mm/1024.
    let d = i32::from(mm);
    let x = d * 1024 + 6042;
    let y = d * 122 + ((d * 3) >> 5) - 20_623;
    let shift = u32::from(atan2_turn(y, x)) << 16;
    // Squares of eighths of a millimetre fit up to 8.1 m, which is as far as the sensor sees.
    let half = |n: i32| (n.unsigned_abs() + 64) >> 7;
    let sum = half(x)
        .saturating_mul(half(x))
        .saturating_add(half(y).saturating_mul(half(y)));
    (shift, (isqrt(sum) + 1) >> 1)
}
