//! Counters of what a parser has seen on its line.

/// Counts of what a parser has seen since its start; every number wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Frames with measurements that passed every check.
    pub packets: u32,
    /// Other good frames: answers to commands, time frames.
    pub answers: u32,
    /// Complete frames that failed their check code.
    pub check_errors: u32,
    /// Bytes that belong to no accepted frame.
    pub skipped_bytes: u32,
    /// Revolutions begun.
    pub revolutions: u32,
}

impl Counters {
    /// All zero.
    pub(crate) const ZERO: Self = Self {
        packets: 0,
        answers: 0,
        check_errors: 0,
        skipped_bytes: 0,
        revolutions: 0,
    };
}
