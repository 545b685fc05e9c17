//! Serial protocols of laser rangefinders: bytes in, checked packets out.
//!
//! ```text
//! push(byte) ─▶ Framer ─▶ frame that passed its checks ─▶ Packet ─▶ beams() ─▶ scan::Assembler
//! ```
//!
//! One file a protocol family, each with a `Parser` that implements [`Protocol`] and a `Packet` that implements
//! [`Packet`]. A [`Model`] is a row of data on a family. Parsers do no I/O; `io`, behind the features `embedded-io`,
//! `embedded-io-async` and `embedded-hal-nb`, connects them to a UART.

pub mod camsense;
pub mod coin_d4;
pub mod delta;
pub mod framing;
pub mod identify;
#[cfg(any(
    feature = "embedded-io",
    feature = "embedded-io-async",
    feature = "embedded-hal-nb"
))]
pub mod io;
pub mod ld06;
pub mod lds01;
pub mod model;
pub mod motor;
pub mod packet;
pub mod parser;
pub mod ring;
pub mod rplidar;
pub mod scip;
pub mod sick;
pub mod startup;
pub mod timing;
pub mod xv11;
pub mod ydlidar;

pub use framing::{Framer, Verdict};
pub use model::{Family, Model};
pub use packet::{Packet, Reading, Sample, View};
pub use parser::{Format, Parser};

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

    /// What has been seen so far.
    fn counters(&self) -> Counters;
}

/// What a parser has seen since its start; every number wraps.
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
    /// Turns begun.
    pub turns: u32,
}
