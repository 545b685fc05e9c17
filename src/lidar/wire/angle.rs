//! Angles as fractions of 2³², which wrap by themselves: conversions from the sensors' units, and where revolutions begin.

/// Finds where revolutions begin in angles that grow steadily.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Revolutions {
    /// Last angle seen; 2³² is a turn.
    last: u32,
}

impl Revolutions {
    pub(crate) const fn new() -> Self {
        Self { last: 0 }
    }

    /// Number of the first of `count` angles, `step` apart, that is more than half a turn less than the one before.
    pub(crate) fn find(&mut self, first: u32, step: u32, count: u16) -> Option<u16> {
        const HALF: u32 = 1 << 31;
        if count == 0 {
            return None;
        }
        let before = self.last;
        let span = step.wrapping_mul(u32::from(count.saturating_sub(1)));
        self.last = first.wrapping_add(span);
        if before > first && before - first > HALF {
            return Some(0);
        }
        if self.last >= first {
            return None;
        }
        let mut angle = first;
        (1..count).find(|_| {
            let (next, wrapped) = angle.overflowing_add(step);
            angle = next;
            wrapped
        })
    }
}

/// Hundredths of a degree as a fraction of 2³²: a product instead of a quotient; at a full turn it is 3e-6 of it too
/// large.
pub(crate) const fn from_cdeg(cdeg: u32) -> u32 {
    cdeg.wrapping_mul(119_304)
        .wrapping_add((cdeg.wrapping_mul(165)) >> 8)
}

/// 1/64 degrees as a fraction of 2³².
pub(crate) const fn from_deg_q6(q6: u32) -> u32 {
    q6.wrapping_mul(186_413).wrapping_add(q6 >> 1)
}

/// `span`, a fraction of 2³², divided into `parts`; 0 for none.
pub(crate) const fn divided(span: u32, parts: u32) -> u32 {
    match span.checked_div(parts) {
        Some(part) => part,
        None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_convert_to_within_a_thousandth_of_a_degree() {
        for cdeg in 0..36_000u32 {
            let exact = f64::from(cdeg) / 36_000.0 * 4_294_967_296.0;
            assert!((f64::from(from_cdeg(cdeg)) - exact).abs() < 600.0, "{cdeg}");
        }
        for q6 in 0..23_040u32 {
            let exact = f64::from(q6) / 23_040.0 * 4_294_967_296.0;
            assert!((f64::from(from_deg_q6(q6)) - exact).abs() < 600.0, "{q6}");
        }
        assert_eq!(
            (from_cdeg(36_000) >> 8, from_deg_q6(23_040) >> 9),
            (0xffffff, 0x7fffff)
        );
    }

    #[test]
    fn revolutions_are_found_between_and_within_packets() {
        let mut revolutions = Revolutions::new();
        let degree = from_cdeg(100);
        for (first, count, expected) in [
            (1000, 5, None),
            (35_050, 20, Some(10)),
            (1000, 5, None),
            (30_000, 50, None),
            (0, 4, Some(0)),
            (9000, 4, None),
            (8000, 4, None),
        ] {
            let found = revolutions.find(from_cdeg(first), degree, count);
            assert_eq!(found, expected, "{first}");
        }
    }
}
