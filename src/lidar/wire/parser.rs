//! The push parser that every framed protocol shares.

use super::framing::{Framer, Verdict};
use super::packet::Packet;
use super::survey::{self, Survey};
use super::timing::Pace;
use super::{counters::Counters, protocol::Protocol};

/// What tells one framed protocol from another.
pub trait Format {
    /// One frame's measurements.
    type Packet: Packet;

    /// Whether a frame begins with these bytes.
    fn judge(&self, bytes: &[u8]) -> Verdict;

    /// Measurements of a frame that [`Format::judge`] accepted; `None` where it only prepares the next one.
    ///
    /// `follows` says that nothing was skipped since the frame before.
    fn packet(&mut self, frame: &[u8], follows: bool, pace: &mut Pace) -> Option<Self::Packet>;

    /// What `Protocol::set_zero` says.
    #[cfg(feature = "internals")]
    fn set_zero(&mut self, zero_cdeg: u16) {
        let _ = zero_cdeg;
    }

    /// Frames among `bytes`, as [`Protocol::survey`] counts them.
    fn survey(&self, bytes: &[u8]) -> Survey {
        survey::count(bytes, |bytes| self.judge(bytes))
    }
}

/// A [`Format`] and a buffer of its longest frame, L bytes. L + 80 bytes and the format's own state.
#[derive(Debug, Clone)]
pub struct Parser<F, const L: usize> {
    framer: Framer<L>,
    format: F,
    pace: Pace,
    /// Bytes skipped before the last frame.
    skipped: u32,
    revolutions: u32,
}

impl<F: Format, const L: usize> Parser<F, L> {
    /// Nothing received yet on a line of `baud` bits per second.
    #[must_use]
    pub const fn with_format(format: F, baud: u32) -> Self {
        Self {
            framer: Framer::new(),
            format,
            pace: Pace::new(baud),
            skipped: 0,
            revolutions: 0,
        }
    }

    /// The protocol's own state.
    pub fn format(&self) -> &F {
        &self.format
    }
}

impl<F: Format, const L: usize> Protocol for Parser<F, L> {
    type Packet = F::Packet;

    fn push(&mut self, byte: u8) -> Option<F::Packet> {
        let Self { framer, format, .. } = self;
        let frame = framer.push(byte, |bytes| format.judge(bytes))?;
        let follows = frame.skipped_bytes == self.skipped;
        self.skipped = frame.skipped_bytes;
        let packet = self.format.packet(frame.bytes, follows, &mut self.pace)?;
        self.revolutions = self
            .revolutions
            .wrapping_add(u32::from(packet.view().revolution_start.is_some()));
        Some(packet)
    }

    fn pull(&mut self) -> Option<F::Packet> {
        loop {
            let Self { framer, format, .. } = self;
            let frame = framer.pull(|bytes| format.judge(bytes))?;
            let follows = frame.skipped_bytes == self.skipped;
            self.skipped = frame.skipped_bytes;
            let Some(packet) = self.format.packet(frame.bytes, follows, &mut self.pace) else {
                continue;
            };
            self.revolutions = self
                .revolutions
                .wrapping_add(u32::from(packet.view().revolution_start.is_some()));
            return Some(packet);
        }
    }

    fn arrived(&mut self, now_us: u32) {
        self.pace.arrived(now_us);
    }

    #[cfg(feature = "internals")]
    fn set_zero(&mut self, zero_cdeg: u16) {
        self.format.set_zero(zero_cdeg);
    }

    fn pending_bytes(&self) -> usize {
        self.framer.pending_bytes()
    }

    fn counters(&self) -> Counters {
        Counters {
            revolutions: self.revolutions,
            ..self.framer.counters()
        }
    }

    fn survey(&self, bytes: &[u8]) -> Survey {
        self.format.survey(bytes)
    }
}
