//! Bytes to be sent to a sensor: a short value of its own size, no heap.

use core::ops::Deref;

/// Most bytes of a request.
pub const MAX_BYTES: usize = 24;

/// Bytes to be sent to a sensor, at most `MAX_BYTES`. 25 bytes.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    bytes: [u8; MAX_BYTES],
    len: u8,
}

impl Request {
    /// No bytes.
    #[must_use]
    pub(crate) const fn new() -> Self {
        Self {
            bytes: [0; MAX_BYTES],
            len: 0,
        }
    }

    /// These pieces one after the other; what goes beyond `MAX_BYTES` is left out.
    #[must_use]
    pub(crate) fn of(pieces: &[&[u8]]) -> Self {
        let mut request = Self::new();
        for byte in pieces.iter().copied().flatten() {
            request.push(*byte);
        }
        request
    }

    /// Appends a byte; without effect where there is no room.
    pub(crate) fn push(&mut self, byte: u8) {
        if let Some(slot) = self.bytes.get_mut(usize::from(self.len)) {
            *slot = byte;
            self.len += 1;
        }
    }

    /// The bytes in the order in which they are to be sent.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&[])
    }
}

impl Deref for Request {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.as_slice()
    }
}

impl core::fmt::Debug for Request {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:02x?}", self.as_slice())
    }
}
