//! Serial protocols of laser rangefinders: bytes in, checked packets out.
//!
//! ```text
//! push(byte) ─▶ Framer ─▶ frame that passed its checks ─▶ Packet ─▶ beams() ─▶ scan::Assembler
//! ```
//!
//! One file a protocol family, each with a `Parser` that implements [`Protocol`] and a `Packet` that implements
//! [`Packet`]. Parsers do no I/O; `io`, behind the features `embedded-io`, `embedded-io-async` and `embedded-hal-nb`,
//! connects them to a UART.

pub mod framing;
#[cfg(any(
    feature = "embedded-io",
    feature = "embedded-io-async",
    feature = "embedded-hal-nb"
))]
pub mod io;
pub mod ld06;

use crate::scan::Beam;

pub use framing::{Framer, Verdict};

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

    /// Bytes held of a frame that is not complete yet.
    fn pending_bytes(&self) -> usize;

    /// What has been seen so far.
    fn counters(&self) -> Counters;
}

/// The measurements of one packet.
pub trait Packet {
    /// In the order of measurement; angles counter-clockwise, times in the parser's clock.
    fn beams(&self) -> impl Iterator<Item = Beam> + '_;

    /// As the sensor itself gives them, in the same order.
    fn samples(&self) -> impl Iterator<Item = Sample> + '_;

    /// Number of the beam that is the first of a new turn, if one is among them.
    fn turn_start(&self) -> Option<usize>;
}

/// One measurement in the sensor's own terms: for decoding and comparison, not for matching.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sample {
    /// In the sensor's own sense, after its maker's corrections, in `[0, 360)` (degrees).
    pub angle_deg: f32,
    /// Distance (mm), if there is one.
    pub range_mm: Option<f32>,
    /// Strength of the return in the sensor's own unit, 0 where it gives none.
    pub quality: u16,
}

/// What a parser has seen since its start; every number wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Frames that passed every check.
    pub packets: u32,
    /// Complete frames that failed their check code.
    pub check_errors: u32,
    /// Bytes that belong to no accepted frame.
    pub skipped_bytes: u32,
    /// Turns begun.
    pub turns: u32,
}
