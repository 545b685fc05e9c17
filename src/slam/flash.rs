//! A map in flash over `embedded-storage`: two banks, so that one is whole whenever the power is cut.
//!
//! Saving erases the bank with the older map, writes the new one behind a page that stays empty, and fills that page last:
//! a header with the number of the saving, the length and CRC-32 of the map, and its own CRC-32. Loading takes the newest
//! bank whose both sums are right.

use core::ops::Range;

use crc::{CRC_32_ISO_HDLC, Crc, Digest, NoTable};
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::{
    Slam,
    stored::{Counts, Read, Write},
};

/// Written and read at a time (bytes): the largest unit of any flash there is.
const PAGE: usize = 256;
/// What a header begins with.
const MAGIC: [u8; 4] = *b"BFSM";
/// Of the image: another one is refused.
const VERSION: u16 = 2;
/// Bytes of a header in its page.
const HEADER: usize = 36;

const CRC: &Crc<u32, NoTable> = &Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Why a map is not saved or loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StorageError<E> {
    /// The flash says so.
    Flash(E),
    /// A bank, half of the range, has too few bytes.
    TooSmall {
        /// Wanted.
        needed: u32,
        /// There are.
        passed: u32,
    },
    /// The range is not two banks of whole erase units, or the flash has units of more than 256 bytes.
    Unaligned,
    /// No bank holds a whole map of a slam of this size.
    NoMap,
}

/// What stands in a bank's first page.
#[derive(Debug, Clone, Copy)]
struct Header {
    /// Number of the saving; wraps.
    saving: u32,
    counts: Counts,
    directions: u16,
    sum: u32,
}

impl Header {
    fn bytes(&self) -> [u8; PAGE] {
        let mut page = [0xff; PAGE];
        let mut sink = Sink(&mut page);
        sink.put(&MAGIC);
        sink.put(&VERSION.to_le_bytes());
        sink.put(&self.directions.to_le_bytes());
        sink.put(&self.counts.nodes.to_le_bytes());
        sink.put(&self.counts.edges.to_le_bytes());
        sink.put(&self.counts.next_id.to_le_bytes());
        sink.put(&self.saving.to_le_bytes());
        sink.put(&self.sum.to_le_bytes());
        let sum = CRC.checksum(page.get(..HEADER - 12).unwrap_or_default());
        let mut sink = Sink(page.get_mut(HEADER - 12..).unwrap_or_default());
        sink.put(&sum.to_le_bytes());
        page
    }

    fn parse(page: &[u8; PAGE]) -> Option<Self> {
        let (head, rest) = page.split_first_chunk::<{ HEADER - 12 }>()?;
        let sum = u32::from_le_bytes(*rest.first_chunk()?);
        let [
            m0,
            m1,
            m2,
            m3,
            v0,
            v1,
            d0,
            d1,
            n0,
            n1,
            e0,
            e1,
            i0,
            i1,
            i2,
            i3,
            s0,
            s1,
            s2,
            s3,
            c0,
            c1,
            c2,
            c3,
        ] = *head;
        let known = [m0, m1, m2, m3] == MAGIC && u16::from_le_bytes([v0, v1]) == VERSION;
        (known && CRC.checksum(head) == sum).then(|| Self {
            saving: u32::from_le_bytes([s0, s1, s2, s3]),
            counts: Counts {
                nodes: u16::from_le_bytes([n0, n1]),
                edges: u16::from_le_bytes([e0, e1]),
                next_id: u32::from_le_bytes([i0, i1, i2, i3]),
            },
            directions: u16::from_le_bytes([d0, d1]),
            sum: u32::from_le_bytes([c0, c1, c2, c3]),
        })
    }
}

/// The rest of a slice that is filled from its start.
struct Sink<'a>(&'a mut [u8]);

impl Sink<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let rest = core::mem::take(&mut self.0);
        if let Some((head, rest)) = rest.split_at_mut_checked(bytes.len()) {
            for (to, from) in head.iter_mut().zip(bytes) {
                *to = *from;
            }
            self.0 = rest;
        }
    }
}

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Bytes that [`Slam::save`] needs in flash for the largest map, without rounding up to erase units: two banks.
    pub const FLASH_BYTES: u32 = 2
        * (PAGE as u32
            + Counts {
                nodes: K as u16,
                edges: E as u16,
                next_id: 0,
            }
            .bytes(B)
            .next_multiple_of(PAGE as u32));

    /// Saves the map in a range of the flash, both ends multiples of twice its erase unit. Blocks as long as the flash
    /// takes to erase and write half of it.
    ///
    /// # Errors
    /// The flash's, and a range that is too small or unaligned. The map saved before stays whole.
    pub fn save<F: NorFlash>(
        &self,
        flash: &mut F,
        range: Range<u32>,
    ) -> Result<(), StorageError<F::Error>> {
        let banks = banks::<F>(&range)?;
        let aligned = banks
            .iter()
            .all(|bank| (bank.start as usize).is_multiple_of(F::ERASE_SIZE))
            && (range.end as usize).is_multiple_of(F::ERASE_SIZE);
        if !aligned || F::WRITE_SIZE > PAGE || !PAGE.is_multiple_of(F::WRITE_SIZE) {
            return Err(StorageError::Unaligned);
        }
        let counts = self.counts();
        let needed = PAGE as u32 + counts.bytes(B).next_multiple_of(PAGE as u32);
        let [first, second] = banks;
        let passed = first.end - first.start;
        if needed > passed {
            return Err(StorageError::TooSmall { needed, passed });
        }
        let found = [header(flash, &first)?, header(flash, &second)?];
        let (bank, saving) = match found.map(|header| header.map(|header| header.saving)) {
            [Some(a), Some(b)] if b.wrapping_sub(a).cast_signed() > 0 => (first, b.wrapping_add(1)),
            [Some(a), _] => (second, a.wrapping_add(1)),
            [None, Some(b)] => (first, b.wrapping_add(1)),
            [None, None] => (first, 0),
        };
        flash
            .erase(bank.start, bank.end)
            .map_err(StorageError::Flash)?;
        let mut pages = Pages {
            flash,
            at: bank.start + PAGE as u32,
            page: [0xff; PAGE],
            filled: 0,
            sum: CRC.digest(),
        };
        self.write(&mut pages).map_err(StorageError::Flash)?;
        let sum = pages.finish().map_err(StorageError::Flash)?;
        let header = Header {
            saving,
            counts,
            directions: B as u16,
            sum,
        };
        flash
            .write(bank.start, &header.bytes())
            .map_err(StorageError::Flash)
    }

    /// Loads the map saved last in place of this one. The next scan's keyframe is taken to be where the newest one of the
    /// map is, to a metre and 30°: the robot starts again about where it was.
    ///
    /// # Errors
    /// The flash's, and where no whole map of a slam of this size is there; the map is then empty, unless nothing was
    /// found at all.
    pub fn load<F: ReadNorFlash>(
        &mut self,
        flash: &mut F,
        range: Range<u32>,
    ) -> Result<(), StorageError<F::Error>> {
        let [first, second] = banks::<F>(&range)?;
        let mut found = [
            (header(flash, &first)?, first),
            (header(flash, &second)?, second),
        ];
        if let [(Some(a), _), (Some(b), _)] = &found
            && b.saving.wrapping_sub(a.saving).cast_signed() > 0
        {
            found.reverse();
        }
        for (header, bank) in found {
            let Some(header) = header else { continue };
            let fits = usize::from(header.counts.nodes) <= K
                && usize::from(header.counts.edges) <= E
                && usize::from(header.directions) == B
                && header.counts.bytes(B) <= bank.end - bank.start - PAGE as u32;
            if !fits || !is_whole(flash, &bank, &header)? {
                continue;
            }
            *self = Self::new(self.config);
            if self.read(header.counts, &mut Source::new(flash, &bank))? {
                return Ok(());
            }
        }
        Err(StorageError::NoMap)
    }
}

/// The two halves of a range.
fn banks<F: ReadNorFlash>(range: &Range<u32>) -> Result<[Range<u32>; 2], StorageError<F::Error>> {
    let size = range.end.saturating_sub(range.start) / 2;
    let middle = range.start + size;
    let aligned = PAGE.is_multiple_of(F::READ_SIZE) && (size as usize).is_multiple_of(PAGE);
    match aligned && size as usize > PAGE {
        true => Ok([range.start..middle, middle..range.end]),
        false => Err(StorageError::Unaligned),
    }
}

/// The header of a bank, if there is one.
fn header<F: ReadNorFlash>(
    flash: &mut F,
    bank: &Range<u32>,
) -> Result<Option<Header>, StorageError<F::Error>> {
    let mut page = [0; PAGE];
    flash
        .read(bank.start, &mut page)
        .map_err(StorageError::Flash)?;
    Ok(Header::parse(&page))
}

/// Whether a bank holds what its header tells.
fn is_whole<F: ReadNorFlash>(
    flash: &mut F,
    bank: &Range<u32>,
    header: &Header,
) -> Result<bool, StorageError<F::Error>> {
    let mut left = header.counts.bytes(usize::from(header.directions)) as usize;
    let (mut at, mut page, mut sum) = (bank.start + PAGE as u32, [0; PAGE], CRC.digest());
    while left > 0 {
        flash.read(at, &mut page).map_err(StorageError::Flash)?;
        sum.update(page.get(..left.min(PAGE)).unwrap_or_default());
        left = left.saturating_sub(PAGE);
        at += PAGE as u32;
    }
    Ok(sum.finalize() == header.sum)
}

/// Pages written one after the other.
struct Pages<'a, F> {
    flash: &'a mut F,
    at: u32,
    page: [u8; PAGE],
    filled: usize,
    sum: Digest<'static, u32, NoTable>,
}

impl<F: NorFlash> Pages<'_, F> {
    fn flush(&mut self) -> Result<(), F::Error> {
        if self.filled > 0 {
            self.flash.write(self.at, &self.page)?;
            self.at += PAGE as u32;
            (self.page, self.filled) = ([0xff; PAGE], 0);
        }
        Ok(())
    }

    /// Writes what is left; gives the sum over all.
    fn finish(mut self) -> Result<u32, F::Error> {
        self.flush()?;
        Ok(self.sum.finalize())
    }
}

impl<F: NorFlash> Write for Pages<'_, F> {
    type Error = F::Error;

    fn put(&mut self, bytes: &[u8]) -> Result<(), F::Error> {
        self.sum.update(bytes);
        for &byte in bytes {
            if let Some(entry) = self.page.get_mut(self.filled) {
                *entry = byte;
                self.filled += 1;
            }
            if self.filled >= PAGE {
                self.flush()?;
            }
        }
        Ok(())
    }
}

/// A bank's bytes behind its header.
struct Source<'a, F> {
    flash: &'a mut F,
    at: u32,
    page: [u8; PAGE],
    taken: usize,
}

impl<'a, F> Source<'a, F> {
    fn new(flash: &'a mut F, bank: &Range<u32>) -> Self {
        Self {
            flash,
            at: bank.start + PAGE as u32,
            page: [0; PAGE],
            taken: PAGE,
        }
    }
}

impl<F: ReadNorFlash> Read for Source<'_, F> {
    type Error = StorageError<F::Error>;

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Self::Error> {
        let mut bytes = [0; N];
        for byte in &mut bytes {
            if self.taken >= PAGE {
                self.flash
                    .read(self.at, &mut self.page)
                    .map_err(StorageError::Flash)?;
                (self.at, self.taken) = (self.at + PAGE as u32, 0);
            }
            *byte = self.page.get(self.taken).copied().unwrap_or_default();
            self.taken += 1;
        }
        Ok(bytes)
    }
}
