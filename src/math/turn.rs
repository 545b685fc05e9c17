//! Angles as a 65536th of a turn (`u16`): they wrap for free and need no float.

/// Full wave of the sine and a quarter more, so that the cosine is the same table 256 entries on.
///
/// 1280 entries of 2 bytes, 1024 a turn, Q15 with 1 held as 32767.
const SINE: [i16; 1280] = sine_table();

const fn sine_table() -> [i16; 1280] {
    let mut table = [0; 1280];
    let mut i = 0;
    while i <= 256 {
        let s = sine_q15(i as i64);
        table[i] = s;
        table[512 - i] = s;
        table[512 + i] = -s;
        table[1024 - i] = -s;
        i += 1;
    }
    i = 0;
    while i < 256 {
        table[1024 + i] = table[i];
        i += 1;
    }
    table[1024] = 0;
    table
}

/// A turn in radians, Q30.
const TURN_Q30: i64 = 6_746_518_852;

/// Sine of `i`/1024 turn for the first quarter, Q15: a Taylor series in Q30 integers.
const fn sine_q15(i: i64) -> i16 {
    const ONE: i64 = 1 << 30;
    let x = (i * TURN_Q30) >> 10;
    let square = (x * x) >> 30;
    let mut term = x;
    let mut sum = x;
    let mut k = 2;
    while k < 16 {
        term = -((term * square) >> 30) / (k * (k + 1));
        sum += term;
        k += 2;
    }
    let q15 = (sum * 32767 + ONE / 2) >> 30;
    if q15 > 32767 { 32767 } else { q15 as i16 }
}

/// Sine and cosine of `turn` (1/65536 turn), in this order, Q15 with 1 held as 32767.
///
/// The nearest of 1024 table entries, turned by the rest: `sin(a + δ) ≈ sin a + δ cos a` with `|δ| ≤ 1/2048`
/// turn, whose neglected square is 4.7e-6.
#[must_use]
pub const fn sin_cos_q15(turn: u16) -> (i32, i32) {
    /// 2π/65536 in Q21: times a rest of 32 and a Q15 value this stays below 2²⁸.
    const STEP_Q21: i32 = 201;
    let entry = (turn.wrapping_add(32) >> 6) as usize;
    let rest = (turn.wrapping_add(32) & 63) as i32 - 32;
    let (s, c) = (SINE[entry] as i32, SINE[entry + 256] as i32);
    let delta = rest * STEP_Q21;
    (
        s + ((delta * c + (1 << 20)) >> 21),
        c - ((delta * s + (1 << 20)) >> 21),
    )
}

/// Sine and cosine of `turn` (2⁻³² turn), in this order, Q15 with 1 held as 32768.
///
/// For one rotation that is applied to many points: the angle is used whole, and the factors are rounded once, so
/// that what is rotated is right to 2e-5 of its length.
#[must_use]
pub const fn sin_cos_q15_fine(turn: u32) -> (i32, i32) {
    let entry = (turn.wrapping_add(1 << 21) >> 22) as usize;
    // The rest is below 2²¹; 2π/2³² in Q45 is 51 472: radians in Q30 after a shift by 15.
    let rest = (turn.wrapping_add(1 << 21) & ((1 << 22) - 1)) as i64 - (1 << 21);
    let delta = (rest * 51_472) >> 15;
    let (s, c) = (SINE[entry] as i64, SINE[entry + 256] as i64);
    // The table's 32767 for 1 is stretched to 32768; second order, since here the angle may not shrink.
    let half_square = (delta * delta) >> 31;
    let turned_s = (s << 15) + ((delta * c) >> 15) - ((half_square * s) >> 15);
    let turned_c = (c << 15) - ((delta * s) >> 15) - ((half_square * c) >> 15);
    (stretch(turned_s), stretch(turned_c))
}

/// From Q30 with 1 held as 32767/32768 to Q15 with 1 held as 32768.
const fn stretch(v: i64) -> i32 {
    ((v + (v >> 15) + (1 << 14)) >> 15) as i32
}

/// Direction of `(x, y)` in 1/65536 turn; 0 for (0, 0).
///
/// Any common scale; magnitudes up to 2³⁰. One division and a table of 65 arcs with linear interpolation.
#[must_use]
pub const fn atan2_turn(y: i32, x: i32) -> u16 {
    let (ax, ay) = (x.unsigned_abs(), y.unsigned_abs());
    let (small, large) = if ay <= ax { (ay, ax) } else { (ax, ay) };
    // Both below 2¹⁶, so that the quotient fits in Q16.
    let shift = 32 - (large | 0xffff).leading_zeros() - 16;
    let divisor = large >> shift;
    if divisor == 0 {
        return 0;
    }
    let ratio = ((small >> shift) << 16) / divisor;
    // At most 64, since `small` is not the larger: said here so that the compiler knows it too.
    let entry = if ratio >> 10 > 64 {
        64
    } else {
        (ratio >> 10) as usize
    };
    let rest = (ratio & 1023) as i32;
    let (low, high) = (ARC[entry] as i32, ARC[entry + 1] as i32);
    // The table holds sixteenths of the unit: round once, here.
    let first = ((low << 10) + (high - low) * rest + (1 << 13)) >> 14;
    let octant = if ay <= ax { first } else { 16384 - first };
    let half = if x >= 0 { octant } else { 32768 - octant };
    (if y >= 0 { half } else { -half }) as u16
}

/// Arc tangent of `i`/64 in 1/16 of 1/65536 turn.
const ARC: [u32; 66] = arc_table();

const fn arc_table() -> [u32; 66] {
    let mut table = [0; 66];
    let mut i = 0;
    while i < 66 {
        table[i] = arc(i as i64);
        i += 1;
    }
    table
}

/// Arc tangent of `i`/64 in 2⁻²⁰ turn, by Euler's series, which converges for every argument.
const fn arc(i: i64) -> u32 {
    const ONE: i64 = 1 << 40;
    let (num, den) = (i * i, 64 * 64 + i * i);
    let mut term = ONE * 64 * i / den;
    let mut sum = term;
    let mut n = 1;
    while n < 60 {
        term = term / den * num / (2 * n + 1) * (2 * n);
        sum += term;
        n += 1;
    }
    // From Q40 radians: two halves of a turn are TURN_Q30.
    (((sum >> 10) * (1 << 20) + TURN_Q30 / 2) / TURN_Q30) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_are_exact() {
        for (turn, expected) in [
            (0, (0, 32767)),
            (16384, (32767, 0)),
            (32768, (0, -32767)),
            (49152, (-32767, 0)),
        ] {
            assert_eq!(sin_cos_q15(turn), expected, "{turn}");
        }
        for (y, x, expected) in [
            (0, 5, 0),
            (5, 5, 8192),
            (5, 0, 16384),
            (5, -5, 24576),
            (0, -5, 32768),
            (-5, -5, 40960),
            (-5, 0, 49152),
            (-5, 5, 57344),
            (0, 0, 0),
        ] {
            assert_eq!(atan2_turn(y, x), expected, "({x}, {y})");
        }
    }

    #[test]
    fn direction_undoes_sine_and_cosine() {
        for turn in 0..=u16::MAX {
            let (s, c) = sin_cos_q15(turn);
            for scale in [1, 7, 30_000] {
                let off = atan2_turn(s * scale, c * scale).wrapping_sub(turn) as i16;
                assert!(off.abs() <= 1, "{turn} at {scale}: off by {off}");
            }
        }
    }
}
