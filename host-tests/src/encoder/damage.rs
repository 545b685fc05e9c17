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
