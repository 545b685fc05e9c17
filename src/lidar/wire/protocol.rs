//! What every lidar's parser does: bytes in, checked packets out.

use super::counters::Counters;
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

    /// Takes the sensor's own angle (0.01°, `0..36000`) that looks forward from here on, in place of its model's: for a parser
    /// that was made before [`Startup::zero_cdeg`](crate::lidar::startup::Startup::zero_cdeg) knew it.
    ///
    /// A parser whose sensors keep no such angle ignores it: all but YDLIDAR's.
    #[cfg(feature = "internals")]
    fn set_zero(&mut self, zero_cdeg: u16) {
        let _ = zero_cdeg;
    }

    /// Bytes held of a frame that is not complete yet.
    fn pending_bytes(&self) -> usize;

    /// Counters since the parser's start.
    fn counters(&self) -> Counters;

    /// Counts how much of `bytes` are frames as this parser accepts them, and pushes none of them.
    ///
    /// Frames that chance explains do not count: a protocol without a check code counts none below a long row of them.
    fn survey(&self, bytes: &[u8]) -> Survey;
}
