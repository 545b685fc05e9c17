//! Numbers and texts of a ROS message: CDR as ROS 2 writes it, and ROS 1's own layout.

use anyhow::{Context, Result, bail, ensure};

/// How a topic's messages are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Four bytes that tell the byte order, then every number at a multiple of its size.
    Cdr,
    /// Little-endian without gaps.
    Ros1,
}

/// Reads a message from front to back.
pub struct Decoder<'a> {
    body: &'a [u8],
    at: usize,
    layout: Layout,
    is_big_endian: bool,
}

impl<'a> Decoder<'a> {
    /// At the first field of `message`.
    pub fn new(message: &'a [u8], layout: Layout) -> Result<Self> {
        let mut decoder = Self {
            body: message,
            at: 0,
            layout,
            is_big_endian: false,
        };
        if layout == Layout::Cdr {
            let (kind, body) = message
                .split_at_checked(4)
                .context("a message of less than 4 bytes")?;
            match kind {
                [0, 0, ..] => decoder.is_big_endian = true,
                [0, 1, ..] => {}
                _ => bail!("not plain CDR: it begins with {kind:02x?}"),
            }
            decoder.body = body;
        }
        Ok(decoder)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        if self.layout == Layout::Cdr {
            self.at = self.at.next_multiple_of(N);
        }
        let bytes = self.body.get(self.at..self.at + N);
        self.at += N;
        let mut bytes: [u8; N] = bytes
            .and_then(|bytes| bytes.try_into().ok())
            .with_context(|| format!("the message ends after {} bytes", self.body.len()))?;
        if self.is_big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    /// The next unsigned number of 32 bits.
    pub fn u32(&mut self) -> Result<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// The next number of 32 bits.
    pub fn f32(&mut self) -> Result<f32> {
        self.take().map(f32::from_le_bytes)
    }

    /// So many numbers of 64 bits.
    pub fn f64s<const N: usize>(&mut self) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.take().map(f64::from_le_bytes)?;
        }
        Ok(numbers)
    }

    /// The next text.
    pub fn text(&mut self) -> Result<String> {
        let length = self.u32()? as usize;
        let rest = self.body.get(self.at..).unwrap_or_default();
        ensure!(
            length <= rest.len(),
            "a text of {length} bytes in a message of {}",
            self.body.len()
        );
        self.at += length;
        let text = String::from_utf8_lossy(&rest[..length]);
        Ok(text.trim_end_matches('\0').to_owned())
    }

    /// The length of a list whose items have at least `size` bytes.
    pub fn count(&mut self, size: usize) -> Result<usize> {
        let count = self.u32()? as usize;
        let rest = self.body.len().saturating_sub(self.at);
        ensure!(
            count.saturating_mul(size) <= rest,
            "a list of {count} in a message of {} bytes",
            self.body.len()
        );
        Ok(count)
    }
}
