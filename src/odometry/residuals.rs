//! What the residuals of matches usually are, and what larger ones tell.

use crate::math;

/// Mean square that residuals of matches usually have, learned from them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Residuals {
    /// m²; 0 before the first match.
    usual: f32,
}

impl Residuals {
    pub const NONE: Self = Self { usual: 0.0 };

    /// By how much (rad) the end of a scan whose places are `range` (m) away seems to be turned against its middle: the
    /// match's `residual` (m) is larger than usual. Learns what is usual.
    ///
    /// A rotation that sets in during the scan leaves places that are turned by 0.45 of what the end is (root mean square of
    /// t² about its mean), and half of that is across the walls, which stand at any angle.
    pub fn bent(&mut self, residual: f32, range: f32) -> f32 {
        /// What residuals differ by anyway, squared.
        const LARGER: f32 = 1.44;
        /// Share of one match in what is usual.
        const SHARE: f32 = 0.06;
        /// One match counts for this many times what is usual at most.
        const MOST: f32 = 2.0;
        /// What of the end's rotation is seen across walls.
        const ACROSS: f32 = 0.22;
        let square = residual * residual;
        if self.usual <= 0.0 {
            self.usual = square;
        }
        let more = math::max(square - LARGER * self.usual, 0.0);
        self.usual += SHARE * (math::min(square, MOST * self.usual) - self.usual);
        math::sqrt(more) / (ACROSS * math::max(range, 0.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_that_is_larger_than_usual_tells_that_the_scan_is_bent() {
        let mut residuals = Residuals::NONE;
        for k in 0..30u8 {
            // 8 mm, a tenth more or less: noise.
            let noise = if k % 2 == 0 { 0.0088 } else { 0.0072 };
            assert_eq!(residuals.bent(noise, 2.0), 0.0, "{k}");
        }
        // A turn that begins at 10 rad/s² in the middle of a tenth of a second leaves 14 mm and is off by 2°.
        let bent = residuals.bent(0.014, 2.0);
        assert!((0.017..0.07).contains(&bent), "{bent}");
        // What is twice as far off shows as well with half of the rotation.
        assert!(residuals.bent(0.014, 4.0) < 0.6 * bent);
    }
}
