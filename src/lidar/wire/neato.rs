//! Neato's check code and distance word, which Camsense and others took over.

use super::packet::Reading;
use crate::scan::NoReturn;

/// Whether a frame's last two bytes are the check code of all before.
pub(crate) fn ends_in_fold(frame: &[u8]) -> bool {
    let parts = frame.split_last_chunk::<2>();
    parts.is_some_and(|(body, code)| fold(body) == u16::from_le_bytes(*code))
}

/// Fold of 16-bit words: each is added to twice the sum, and what runs over 15 bits is added again.
fn fold(body: &[u8]) -> u16 {
    let sum = body.chunks_exact(2).fold(0u32, |sum, word| match *word {
        [low, high] => (sum << 1).wrapping_add(u16::from_le_bytes([low, high]).into()),
        _ => sum,
    });
    ((sum & 0x7fff).wrapping_add(sum >> 15) & 0x7fff) as u16
}

/// Range of a point by its distance word, in mm/4.
pub(crate) fn range(word: [u8; 2]) -> Result<u32, NoReturn> {
    let word = u16::from_le_bytes(word);
    if word & 0x8000 != 0 {
        Err(NoReturn::Sensor(word as u8))
    } else {
        Reading::range_q2(u32::from(word & 0x3fff) << 2)
    }
}
