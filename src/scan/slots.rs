//! A full revolution in equal slots, and which of them a bearing falls to.

/// So many equal slots; the k-th has its middle at `k / count` of a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slots {
    count: u32,
    /// Half a slot (1/65536 turn), so that a bearing falls to the slot with the nearest middle.
    half: u16,
}

impl Slots {
    /// At most 65 536 slots.
    pub const fn new(count: usize) -> Self {
        let count = count as u32;
        Self {
            count,
            half: (32_768 / if count == 0 { 1 } else { count }) as u16,
        }
    }

    /// The slot whose middle is nearest to a bearing (1/65536 turn).
    #[inline(always)]
    pub const fn of(self, bearing: u16) -> usize {
        ((bearing.wrapping_add(self.half) as u32 * self.count) >> 16) as usize
    }

    /// Bearing of a slot's middle (1/65536 turn).
    pub const fn middle(self, slot: usize) -> u16 {
        let count = if self.count == 0 { 1 } else { self.count };
        ((slot as u32).wrapping_mul(65_536) / count) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slots_middle_falls_to_it_and_so_does_what_is_near() {
        for count in [1usize, 7, 180, 360, 456, 1024] {
            let slots = Slots::new(count);
            for slot in 0..count {
                let middle = slots.middle(slot);
                assert_eq!(slots.of(middle), slot, "{count}: {slot}");
                let almost_half = (32_768 / count).saturating_sub(2) as u16;
                assert_eq!(slots.of(middle.wrapping_add(almost_half)), slot, "{count}");
            }
        }
    }
}
