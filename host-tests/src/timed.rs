//! Raw bytes with the times at which they came in: recorded on the spot, replayed later with the same beam times.
//!
//! `BYTES+T1`, then pieces: `u64` time (µs), `u32` length, the bytes; all little-endian. A file without this start is
//! bytes alone.

use std::borrow::Cow;
use std::io::{self, Write};

/// How such a file starts.
pub const MAGIC: &[u8; 8] = b"BYTES+T1";

/// Bytes that came in together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece<'a> {
    /// When (µs); `None` where nobody wrote it down.
    pub time_us: Option<u64>,
    /// What came.
    pub bytes: &'a [u8],
}

/// Records pieces as they come in.
#[derive(Debug)]
pub struct Recorder<W> {
    output: W,
}

impl<W: Write> Recorder<W> {
    /// Starts a recording.
    pub fn new(mut output: W) -> io::Result<Self> {
        output.write_all(MAGIC)?;
        Ok(Self { output })
    }

    /// Appends what came in at this time (µs).
    pub fn push(&mut self, time_us: u64, bytes: &[u8]) -> io::Result<()> {
        let length = u32::try_from(bytes.len()).map_err(io::Error::other)?;
        self.output.write_all(&time_us.to_le_bytes())?;
        self.output.write_all(&length.to_le_bytes())?;
        self.output.write_all(bytes)
    }

    /// Ends the recording.
    pub fn finish(mut self) -> io::Result<W> {
        self.output.flush()?;
        Ok(self.output)
    }
}

/// The pieces of a file with or without times; a last one that was cut off is as long as it is.
#[must_use]
pub fn pieces(file: &[u8]) -> Vec<Piece<'_>> {
    let Some(mut rest) = file.strip_prefix(MAGIC) else {
        return vec![Piece {
            time_us: None,
            bytes: file,
        }];
    };
    let mut pieces = Vec::new();
    while let Some((time, after)) = rest.split_first_chunk::<8>() {
        let Some((length, after)) = after.split_first_chunk::<4>() else {
            break;
        };
        let length = (u32::from_le_bytes(*length) as usize).min(after.len());
        let (bytes, after) = after.split_at(length);
        pieces.push(Piece {
            time_us: Some(u64::from_le_bytes(*time)),
            bytes,
        });
        rest = after;
    }
    pieces
}

/// The bytes of a file with or without times.
#[must_use]
pub fn plain(file: &[u8]) -> Cow<'_, [u8]> {
    match pieces(file)[..] {
        [Piece { bytes, .. }] => Cow::Borrowed(bytes),
        ref pieces => pieces
            .iter()
            .flat_map(|piece| piece.bytes)
            .copied()
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_recorded_comes_back() {
        let mut recorder = Recorder::new(Vec::new()).expect("memory");
        recorder.push(5, &[1, 2, 3]).expect("memory");
        recorder.push(1 << 40, &[]).expect("memory");
        recorder.push(9, &[4]).expect("memory");
        let file = recorder.finish().expect("memory");
        let times: Vec<_> = pieces(&file).iter().map(|piece| piece.time_us).collect();
        assert_eq!(times, [Some(5), Some(1 << 40), Some(9)]);
        assert_eq!(plain(&file)[..], [1, 2, 3, 4]);
        // Cut anywhere: what is left is a start of it.
        for end in 0..file.len() {
            let cut = plain(&file[..end]);
            assert!(
                end < MAGIC.len() || [1, 2, 3, 4].starts_with(&cut),
                "{end}: {cut:?}"
            );
        }
        assert_eq!(plain(&[7, 8])[..], [7, 8]);
    }
}
