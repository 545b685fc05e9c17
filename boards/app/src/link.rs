//! Messages on a wire: postcard, then a CRC-16, then COBS, then a zero byte.
//!
//! A zero byte never occurs inside a frame, so a reader that joins late or has lost bytes is right again
//! after the next one.

use cobs::{CobsEncoder, DecodeResult, DecoderState};
use crc::{CRC_16_IBM_3740, Crc, NoTable};
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Most bytes of a message before framing.
pub const MESSAGE: usize = 200;
/// Most bytes of a frame: COBS adds one and the end another.
pub const FRAME: usize = MESSAGE + 2;

/// No table: half a kilobyte of flash is worth more here than 60 bytes' worth of speed.
const CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_3740);

/// Appends `message` as a frame; `false`, with `out` as it was, where there is no room for it.
#[must_use]
pub fn append<const N: usize>(message: &impl Serialize, out: &mut Vec<u8, N>) -> bool {
    let mut plain = [0; MESSAGE];
    let Ok(used) = postcard::to_slice(message, &mut plain) else {
        return false;
    };
    let check = CRC.checksum(used).to_le_bytes();
    let mut frame = [0; FRAME];
    let mut encoder = CobsEncoder::new(&mut frame);
    if encoder.push(used).is_err() || encoder.push(&check).is_err() {
        return false;
    }
    let length = encoder.finalize();
    // The byte after the last is still the zero that ends the frame.
    match frame.get(..length + 1) {
        Some(frame) => out.extend_from_slice(frame).is_ok(),
        None => false,
    }
}

/// Takes frames apart, byte by byte.
#[derive(Debug)]
pub struct Receiver {
    state: DecoderState,
    plain: Vec<u8, MESSAGE>,
    /// Whether the frame in progress was too long or ill-formed already.
    spoilt: bool,
    /// Whether `plain` was handed out and has to be emptied.
    done: bool,
    counters: Counters,
}

/// What a [`Receiver`] has seen; wrapping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Frames with a valid check code.
    pub frames: u32,
    /// Frames that were too long, ill-formed or failed their check code.
    pub errors: u32,
}

impl Receiver {
    /// Waits for the start of a frame.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            state: DecoderState::Idle,
            plain: Vec::new(),
            spoilt: false,
            done: false,
            counters: Counters {
                frames: 0,
                errors: 0,
            },
        }
    }

    /// What has been seen so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Takes the next byte; gives the message that it completes.
    ///
    /// A frame whose check code holds but that is not an `M` counts as a frame and gives nothing: it is
    /// from another version.
    pub fn push<'a, M: Deserialize<'a>>(&'a mut self, byte: u8) -> Option<M> {
        if self.done {
            self.plain.clear();
            self.done = false;
        }
        let ended = match self.state.feed(byte) {
            Ok(DecodeResult::NoData | DecodeResult::DataStart) => false,
            Ok(DecodeResult::DataContinue(plain)) => {
                self.spoilt |= self.plain.push(plain).is_err();
                false
            }
            Ok(DecodeResult::DataComplete) => true,
            Err(_) => {
                self.spoilt = true;
                true
            }
        };
        if !ended {
            return None;
        }
        self.done = true;
        let spoilt = core::mem::take(&mut self.spoilt);
        let message = match self.plain.split_last_chunk() {
            Some((message, check)) if !spoilt && CRC.checksum(message).to_le_bytes() == *check => {
                message
            }
            _ => {
                self.counters.errors = self.counters.errors.wrapping_add(1);
                return None;
            }
        };
        self.counters.frames = self.counters.frames.wrapping_add(1);
        postcard::from_bytes(message).ok()
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}
