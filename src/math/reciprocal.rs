//! Division and length without a divider: a Cortex-M0 has none.

/// `2²² / (m + ½)` for the mantissas m = 128…255: the middle of each entry's interval.
const RECIPROCAL: [u16; 128] = table();

const fn table() -> [u16; 128] {
    let mut table = [0; 128];
    let mut i = 0;
    while i < 128 {
        table[i] = ((1 << 23) / (2 * (128 + i) + 1)) as u16;
        i += 1;
    }
    table
}

/// `2²⁴ / x` to within 0.5 %, for `x` from 128 to 32 767; smaller ones count as 128, larger ones as 32 767.
///
/// For weights and search starts. About 10 instructions on an M4F, 30 on a Cortex-M0, where a division takes more than
/// 100.
#[must_use]
pub const fn reciprocal(x: u32) -> u32 {
    if x < 128 {
        return 1 << 17;
    }
    let x = if x > 32_767 { 32_767 } else { x };
    // The mantissa has 8 bits, the first of them set.
    let shift = 24 - x.leading_zeros();
    ((RECIPROCAL[((x >> shift) & 127) as usize] as u32) << 2) >> shift
}

/// Length of `(x, y)` to within 3 %, for magnitudes up to 2²⁸.
///
/// The larger of two straight lines through the larger and the smaller of the two magnitudes.
#[must_use]
pub const fn rough_length(x: i32, y: i32) -> u32 {
    let (a, b) = (x.unsigned_abs(), y.unsigned_abs());
    let (large, small) = if a > b { (a, b) } else { (b, a) };
    let (flat, steep) = (large + (small >> 3), (large - (large >> 3)) + (small >> 1));
    if flat > steep { flat } else { steep }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reciprocals_are_within_their_error() {
        for x in 128..=32_767u32 {
            let off = f64::from(reciprocal(x)) * f64::from(x) / f64::from(1 << 24) - 1.0;
            assert!(off.abs() < 0.005, "{x}: {off}");
        }
        assert_eq!(reciprocal(0), reciprocal(127));
        assert_eq!(reciprocal(u32::MAX), reciprocal(32_767));
    }

    #[test]
    fn rough_lengths_are_within_their_error() {
        for turn in 0..=u16::MAX {
            let (s, c) = crate::math::sin_cos_q15(turn);
            let off = f64::from(rough_length(c, s)) / 32767.0 - 1.0;
            assert!(off.abs() < 0.031, "{turn}: {off}");
        }
    }
}
