//! Bytes on their way from an interrupt to the main loop.

use core::cell::RefCell;

use critical_section::Mutex;
use heapless::Deque;

/// Up to B bytes: what arrives while a match is computed. An LD06 sends 23 a millisecond at most.
pub struct Ring<const B: usize>(Mutex<RefCell<Inner<B>>>);

struct Inner<const B: usize> {
    bytes: Deque<u8, B>,
    lost: u32,
}

impl<const B: usize> Ring<B> {
    /// Empty.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Inner {
            bytes: Deque::new(),
            lost: 0,
        })))
    }

    /// Keeps a byte, or counts it as lost.
    pub fn push(&self, byte: u8) {
        self.with(|ring| {
            if ring.bytes.push_back(byte).is_err() {
                ring.lost = ring.lost.wrapping_add(1);
            }
        });
    }

    /// Keeps bytes, as many as have room, and counts the others as lost: in one critical section, whose length grows with them.
    pub fn extend(&self, bytes: &[u8]) {
        self.with(|ring| {
            let free = ring.bytes.capacity() - ring.bytes.len();
            let (kept, lost) = bytes.split_at(bytes.len().min(free));
            for &byte in kept {
                let _ = ring.bytes.push_back(byte);
            }
            ring.lost = ring.lost.wrapping_add(lost.len() as u32);
        });
    }

    /// Counts bytes that were lost before they came here: overruns of the UART.
    pub fn lose(&self, bytes: u32) {
        self.with(|ring| ring.lost = ring.lost.wrapping_add(bytes));
    }

    /// Moves the oldest bytes to `to`, as many as there are and have room there; gives their number.
    pub fn read(&self, to: &mut [u8]) -> usize {
        let read = |ring: &mut Inner<B>| {
            let mut count = 0;
            for (slot, byte) in to
                .iter_mut()
                .zip(core::iter::from_fn(|| ring.bytes.pop_front()))
            {
                *slot = byte;
                count += 1;
            }
            count
        };
        self.with(read).unwrap_or(0)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.with(|ring| ring.bytes.is_empty()).unwrap_or(true)
    }

    /// Whether the next byte would be lost.
    pub fn is_full(&self) -> bool {
        self.with(|ring| ring.bytes.is_full()).unwrap_or(true)
    }

    /// Bytes that found no room since the start; wrapping.
    pub fn lost(&self) -> u32 {
        self.with(|ring| ring.lost).unwrap_or(0)
    }

    /// Never `None`: with interrupts masked nobody else can hold the cell.
    fn with<R>(&self, f: impl FnOnce(&mut Inner<B>) -> R) -> Option<R> {
        critical_section::with(|cs| Some(f(&mut *self.0.borrow(cs).try_borrow_mut().ok()?)))
    }
}
