//! Answers of RPLIDAR and YDLIDAR sensors that stand between their measurements.

use super::framing::Verdict;

/// Answers to commands: a descriptor `A5 5A`, length and mode, type; behind it the answer, unless a stream follows.
pub(crate) fn judge(bytes: &[u8]) -> Verdict {
    let &[_, _, l0, l1, l2, l3, kind, ..] = bytes else {
        return Verdict::Need(7);
    };
    let (length, mode) = (u32::from_le_bytes([l0, l1, l2, l3 & 0x3f]), l3 >> 6);
    let whole = match (mode, kind, length) {
        (0, 0x04, 20 | 4) | (0, 0x06, 3) | (0, 0x15, 4) | (0, 0xff, 4) => 7 + length as usize,
        (1, 0x81, 5) | (1, 0x82 | 0x85, 84) | (1, 0x83, 781 | 132) => 7,
        (1, 0x84, 132) | (1, 0x86, 170) => 7,
        _ => return Verdict::No,
    };
    if bytes.len() < whole {
        Verdict::Need(whole)
    } else {
        Verdict::Answer(whole)
    }
}
