//! Reading a lidar from memory that DMA fills round and round: the way above 230 400 baud.

use super::protocol::Protocol;

/// A parser behind a ring that a DMA channel fills. 12 bytes and the parser.
#[derive(Debug)]
pub struct Ring<P> {
    parser: P,
    /// Bytes taken out since the start; wraps.
    taken: u32,
    overrun_bytes: u32,
}

impl<P: Protocol> Ring<P> {
    /// Nothing taken out yet.
    pub const fn new(parser: P) -> Self {
        Self {
            parser,
            taken: 0,
            overrun_bytes: 0,
        }
    }

    /// Parses what has come in since the last call; each packet goes to `each`.
    ///
    /// `ring` is the whole ring, its length best a power of two (any other misreads once in 4 GB); `written` is how many
    /// bytes DMA has written since the start, wrapping: full rounds times the length, and the place in the present
    /// round. What was overwritten before it was read is counted and survived.
    pub fn drain(&mut self, ring: &[u8], written: u32, mut each: impl FnMut(P::Packet)) {
        let length = ring.len() as u32;
        let waiting = written.wrapping_sub(self.taken);
        if waiting > length {
            let lost = waiting - length;
            self.overrun_bytes = self.overrun_bytes.wrapping_add(lost);
            self.taken = self.taken.wrapping_add(lost);
        }
        let start = self.taken.checked_rem(length).unwrap_or(0) as usize;
        let count = written.wrapping_sub(self.taken) as usize;
        self.taken = written;
        let (before, after) = ring.split_at_checked(start).unwrap_or((ring, &[]));
        for &byte in after.iter().chain(before).take(count) {
            if let Some(packet) = self.parser.push(byte) {
                each(packet);
            }
        }
    }

    /// Bytes that were overwritten before they were read; wraps.
    pub fn overrun_bytes(&self) -> u32 {
        self.overrun_bytes
    }

    /// The parser, for its counters.
    pub fn parser(&self) -> &P {
        &self.parser
    }

    /// The parser, to tell it when the next bytes arrived.
    pub fn parser_mut(&mut self) -> &mut P {
        &mut self.parser
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::wire::toy::{self, FRAME};

    /// Writes so many bytes of an endless stream of frames, as DMA would.
    fn write(ring: &mut [u8; 64], written: &mut u32, count: u32) {
        for _ in 0..count {
            ring[*written as usize % 64] = FRAME[*written as usize % 47];
            *written = written.wrapping_add(1);
        }
    }

    #[test]
    fn every_byte_of_the_ring_is_read_once() {
        let (mut ring, mut written, mut packets) = ([0; 64], 0, 0);
        let mut reader = Ring::new(toy::parser());
        for count in [0, 10, 54, 64, 1, 63, 40, 3].repeat_until(47 * 20) {
            write(&mut ring, &mut written, count);
            reader.drain(&ring, written, |_| packets += 1);
        }
        assert_eq!((packets, reader.overrun_bytes()), (written / 47, 0));
        assert_eq!(reader.parser().counters().skipped_bytes, 0);
    }

    #[test]
    fn an_overrun_is_counted_and_survived() {
        let (mut ring, mut written, mut packets) = ([0; 64], 0, 0);
        let mut reader = Ring::new(toy::parser());
        write(&mut ring, &mut written, 100);
        reader.drain(&ring, written, |_| packets += 1);
        assert_eq!((packets, reader.overrun_bytes()), (1, 36));
        write(&mut ring, &mut written, 41);
        reader.drain(&ring, written, |_| packets += 1);
        assert_eq!((packets, reader.overrun_bytes()), (2, 36));
    }

    /// Round and round until the sum is reached.
    trait RepeatUntil {
        fn repeat_until(self, sum: u32) -> impl Iterator<Item = u32>;
    }

    impl<const N: usize> RepeatUntil for [u32; N] {
        fn repeat_until(self, sum: u32) -> impl Iterator<Item = u32> {
            let mut total = 0;
            self.into_iter().cycle().take_while(move |count| {
                total += count;
                total <= sum
            })
        }
    }
}
