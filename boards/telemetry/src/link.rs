//! Messages on a wire: postcard, then a CRC-16, then COBS, then a zero byte.
//!
//! A zero byte never occurs inside a frame, so a reader that joins late or has lost bytes is right again
//! after the next one.

use cobs::{DecodeResult, DecoderState, EncoderState, PushResult};
use crc::{CRC_16_IBM_3740, Crc, Digest, NoTable};
use heapless::Vec;
use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

/// Most bytes of a message before framing.
pub const MESSAGE: usize = 110;
/// Most bytes of a frame: the check code adds two, COBS one, the end one.
pub const FRAME: usize = MESSAGE + 4;

/// No table: half a kilobyte of flash is worth more here than speed.
static CRC: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_3740);

/// Appends `message` as a frame; `false`, with `out` as it was, where there is no room for it.
#[must_use]
pub fn append<const N: usize>(message: &impl Serialize, out: &mut Vec<u8, N>) -> bool {
    let start = out.len();
    let framing = Framing {
        start,
        state: EncoderState::default(),
        digest: CRC.digest(),
        out,
    };
    let written = framing
        .begin()
        .and_then(|framing| postcard::serialize_with_flavor(message, framing));
    if written.is_err() {
        out.truncate(start);
    }
    written.is_ok()
}

/// Frames a message while postcard writes it: no buffer but the one it goes to.
struct Framing<'a, const N: usize> {
    out: &'a mut Vec<u8, N>,
    /// Where the frame starts.
    start: usize,
    state: EncoderState,
    digest: Digest<'static, u16, NoTable>,
}

impl<const N: usize> Framing<'_, N> {
    /// Makes room for the first of COBS's distances.
    fn begin(self) -> postcard::Result<Self> {
        append_byte(self.out, 0)?;
        Ok(self)
    }

    /// Apart: it is called for every byte of every field of every message.
    #[inline(never)]
    fn encode(&mut self, byte: u8) -> postcard::Result<()> {
        match self.state.push(byte) {
            PushResult::AddSingle(byte) => append_byte(self.out, byte),
            PushResult::ModifyFromStartAndSkip((at, distance)) => {
                self.set(at, distance)?;
                append_byte(self.out, 0)
            }
            PushResult::ModifyFromStartAndPushAndSkip((at, distance, byte)) => {
                self.set(at, distance)?;
                append_byte(self.out, byte)?;
                append_byte(self.out, 0)
            }
        }
    }

    #[inline(never)]
    fn check_and_encode(&mut self, byte: u8) -> postcard::Result<()> {
        self.digest.update(&[byte]);
        self.encode(byte)
    }

    fn set(&mut self, at: usize, distance: u8) -> postcard::Result<()> {
        let slot = self.out.get_mut(self.start + at);
        *slot.ok_or(postcard::Error::SerializeBufferFull)? = distance;
        Ok(())
    }
}

impl<const N: usize> Flavor for Framing<'_, N> {
    type Output = ();

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.check_and_encode(byte)
    }

    fn finalize(mut self) -> postcard::Result<()> {
        for byte in self.digest.clone().finalize().to_le_bytes() {
            self.encode(byte)?;
        }
        let (at, distance) = self.state.clone().finalize();
        self.set(at, distance)?;
        append_byte(self.out, 0)
    }
}

fn append_byte<const N: usize>(out: &mut Vec<u8, N>, byte: u8) -> postcard::Result<()> {
    out.push(byte)
        .map_err(|_| postcard::Error::SerializeBufferFull)
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
