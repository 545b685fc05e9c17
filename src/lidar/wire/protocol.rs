//! What every lidar's parser does: bytes in, checked packets out, and counters of what was seen.

use super::packet::Packet;
use super::survey::Survey;

/// A lidar's serial protocol as a push parser.
///
/// The bytes may come in pieces of any size: the packets are the same.
pub trait Protocol {
    /// One frame that passed every check.
    type Packet: Packet;

    /// Takes the next byte of the line; gives the packet that it completes.
    fn push(&mut self, byte: u8) -> Option<Self::Packet>;

    /// Gives a packet that is already complete among the bytes held.
    ///
    /// Only needed at the end of a recording: a false start can hold back several true frames, and each
    /// [`Protocol::push`] gives one of them.
    fn pull(&mut self) -> Option<Self::Packet>;

    /// Says when (µs) the bytes pushed next came in.
    ///
    /// Times of sensors without a clock are counted back from there. Without it they run at the sensor's nominal pace.
    fn arrived(&mut self, now_us: u32);

    /// Bytes held of a frame that is not complete yet.
    fn pending_bytes(&self) -> usize;

    /// Counters since the parser's start.
    fn counters(&self) -> Counters;

    /// Counts how much of `bytes` are frames as this parser accepts them, and pushes none of them.
    ///
    /// Frames that chance explains do not count: a protocol without a check code counts none below a long row of them.
    fn survey(&self, bytes: &[u8]) -> Survey;
}

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
