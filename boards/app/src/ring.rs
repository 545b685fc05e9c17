//! Bytes on their way from an interrupt to the main loop.

use core::cell::RefCell;

use critical_section::Mutex;

/// Up to B bytes: what arrives while a match is computed. An LD06 sends 23 a millisecond at most.
pub struct Ring<const B: usize>(Mutex<RefCell<Inner<B>>>);

struct Inner<const B: usize> {
    bytes: [u8; B],
    /// Where the oldest byte is; less than B.
    start: usize,
    count: usize,
    lost: u32,
}

impl<const B: usize> Ring<B> {
    /// Empty.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Inner {
            bytes: [0; B],
            start: 0,
            count: 0,
            lost: 0,
        })))
    }

    /// Keeps a byte, or counts it as lost.
    pub fn push(&self, byte: u8) {
        self.with(|ring| ring.push(byte));
    }

    /// Keeps bytes, as many as have room, and counts the others as lost: in one critical section, whose length grows with them.
    pub fn extend(&self, bytes: &[u8]) {
        self.with(|ring| ring.extend(bytes));
    }

    /// Counts bytes that were lost before they came here: overruns of the UART.
    pub fn lose(&self, bytes: u32) {
        self.with(|ring| ring.lost = ring.lost.wrapping_add(bytes));
    }

    /// Moves the oldest bytes to `to`, as many as there are and have room there; gives their number.
    pub fn read(&self, to: &mut [u8]) -> usize {
        self.with(|ring| ring.read(to)).unwrap_or(0)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.with(|ring| ring.count == 0).unwrap_or(true)
    }

    /// Whether the next byte would be lost.
    pub fn is_full(&self) -> bool {
        self.with(|ring| ring.count == B).unwrap_or(true)
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

impl<const B: usize> Inner<B> {
    fn push(&mut self, byte: u8) {
        let end = Self::wrapped(self.start + self.count);
        match self.bytes.get_mut(end).filter(|_| self.count < B) {
            Some(slot) => {
                *slot = byte;
                self.count += 1;
            }
            None => self.lost = self.lost.wrapping_add(1),
        }
    }

    fn extend(&mut self, bytes: &[u8]) {
        let (kept, lost) = bytes.split_at(bytes.len().min(B - self.count));
        // Up to the buffer's end, and from its start on.
        let (start, end) = self
            .bytes
            .split_at_mut(Self::wrapped(self.start + self.count));
        let (first, second) = kept.split_at(kept.len().min(end.len()));
        copy(first, end);
        copy(second, start);
        self.count += kept.len();
        self.lost = self.lost.wrapping_add(lost.len() as u32);
    }

    fn read(&mut self, to: &mut [u8]) -> usize {
        let count = to.len().min(self.count);
        if count == 0 {
            return 0;
        }
        let (to, _) = to.split_at_mut(count);
        let (start, end) = self.bytes.split_at(Self::wrapped(self.start));
        let (first, second) = to.split_at_mut(count.min(end.len()));
        copy(end, first);
        copy(start, second);
        self.start = Self::wrapped(self.start + count);
        self.count -= count;
        count
    }

    /// Where the byte `at` is in the buffer; `at` is less than twice its length.
    fn wrapped(at: usize) -> usize {
        let at = if at < B { at } else { at - B };
        at.min(B)
    }
}

/// As many bytes as the shorter of the two has.
fn copy(from: &[u8], to: &mut [u8]) {
    // Most often nothing is left for the buffer's other end.
    if from.is_empty() || to.is_empty() {
        return;
    }
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}
