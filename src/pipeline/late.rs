//! What is given when the program runs, so that the room for it is all zeros before.

use crate::lidar::{Counters, Protocol, Survey};

/// Something given when the program runs, or nothing yet. A lidar's parser that is not given takes bytes, and they lead to nothing.
// Numbered, so that `Missing` is zero whatever P is: `Option` would mark it within P where it finds a place.
#[derive(Debug, Clone, Copy)]
#[repr(u8)]
pub enum Late<P> {
    /// Not given yet.
    Missing,
    /// This one.
    Given(P),
}

impl<P> Late<P> {
    /// It, if it was given.
    pub(super) const fn as_ref(&self) -> Option<&P> {
        match self {
            Self::Missing => None,
            Self::Given(parser) => Some(parser),
        }
    }

    const fn as_mut(&mut self) -> Option<&mut P> {
        match self {
            Self::Missing => None,
            Self::Given(parser) => Some(parser),
        }
    }
}

impl<P: Protocol> Protocol for Late<P> {
    type Packet = P::Packet;

    fn push(&mut self, byte: u8) -> Option<P::Packet> {
        self.as_mut()?.push(byte)
    }

    fn pull(&mut self) -> Option<P::Packet> {
        self.as_mut()?.pull()
    }

    fn arrived(&mut self, now_us: u32) {
        if let Some(parser) = self.as_mut() {
            parser.arrived(now_us);
        }
    }

    #[cfg(feature = "internals")]
    fn set_zero(&mut self, zero_cdeg: u16) {
        if let Some(parser) = self.as_mut() {
            parser.set_zero(zero_cdeg);
        }
    }

    fn pending_bytes(&self) -> usize {
        self.as_ref().map_or(0, P::pending_bytes)
    }

    fn counters(&self) -> Counters {
        self.as_ref().map_or(Counters::default(), P::counters)
    }

    fn survey(&self, bytes: &[u8]) -> Survey {
        self.as_ref()
            .map_or(Survey::default(), |parser| parser.survey(bytes))
    }
}
