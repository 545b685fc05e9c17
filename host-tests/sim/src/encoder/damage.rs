//! What a bad line does to a stream.

use rand::Rng;

/// Damages `line` at so many places: in nine of ten a byte is deleted, doubled, flipped or inserted, in one a gap of 5
/// to 60 bytes is torn.
pub fn hit(line: &mut Vec<u8>, faults: usize, rng: &mut impl Rng) {
    for _ in 0..faults {
        let at = rng.random_range(0..line.len() - 60);
        if rng.random_range(0..10) == 0 {
            drop(line.drain(at..at + rng.random_range(5..=60)));
            continue;
        }
        match rng.random_range(0..4) {
            0 => drop(line.remove(at)),
            1 => line.insert(at, line[at]),
            2 => line[at] ^= 1 << rng.random_range(0..8),
            _ => line.insert(at, rng.random()),
        }
    }
}

/// The line with a hundredth of its bytes lost, doubled or with a bit flipped, as many of each; the same every time.
#[must_use]
pub fn a_hundredth(line: &[u8]) -> Vec<u8> {
    let mut random = 1u64;
    let mut damaged = Vec::new();
    for &byte in line {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        match (random >> 33) % 300 {
            0 => {}
            1 => damaged.extend([byte, byte]),
            2 => damaged.push(byte ^ 1 << (random >> 60 & 7)),
            _ => damaged.push(byte),
        }
    }
    damaged
}
