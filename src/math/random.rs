//! Random numbers that are the same on every machine: integers inside, no state but a word that the caller keeps.

use super::{ln, sin_cos, sqrt};

/// The state after this one, which is the next number too: Marsaglia's xorshift (J. Stat. Softw. 8, 2003) with shifts 13, 17,
/// 5. 0 counts as 1; the higher bits are the better ones. 6 instructions.
#[must_use]
pub const fn xorshift(state: u32) -> u32 {
    let mut x = if state == 0 { 1 } else { state };
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    x
}

/// A stream of random numbers, repeated by its seed. 4 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Random(u32);

impl Random {
    /// The stream of a seed. Seeds that differ by one bit give streams that do not resemble each other.
    #[must_use]
    pub const fn new(seed: u32) -> Self {
        // The finaliser of MurmurHash3 (Appleby, public domain): each bit of the seed changes half of the state's.
        let mut x = seed ^ 0x9e37_79b9;
        x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
        x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
        Self(x ^ (x >> 16))
    }

    /// Even in 0 to 1, neither included: 2²³ values.
    pub fn unit(&mut self) -> f32 {
        self.0 = xorshift(self.0);
        // Odd multiples of 2⁻²⁴ are floats.
        ((self.0 >> 8) | 1) as f32 / 16_777_216.0
    }

    /// Even in `0..count`; 0 for a count of 0.
    pub fn below(&mut self, count: u32) -> u32 {
        self.0 = xorshift(self.0);
        ((u64::from(self.0) * u64::from(count)) >> 32) as u32
    }

    /// Two independent normal numbers of mean 0 and variance 1, at most 5.8 from 0: Box and Muller. 250 instructions on an
    /// M4F.
    pub fn normals(&mut self) -> [f32; 2] {
        let radius = sqrt(-2.0 * ln(self.unit()));
        let (s, c) = sin_cos(core::f32::consts::TAU * self.unit());
        [radius * c, radius * s]
    }

    /// Three of them.
    pub fn normal3(&mut self) -> [f32; 3] {
        let ([x, y], [t, _]) = (self.normals(), self.normals());
        [x, y, t]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_even_and_normal_and_neighbouring_seeds_do_not_resemble_each_other() {
        let mut cells = [0u32; 16];
        let (mut sum, mut squares, mut fourth, mut mixed) = (0.0f64, 0.0, 0.0, 0.0);
        for seed in 0..200 {
            let mut random = Random::new(seed);
            // The first numbers of each stream, where seeds would show.
            for _ in 0..50 {
                let unit = random.unit();
                assert!(unit > 0.0 && unit < 1.0);
                cells[(unit * 16.0) as usize] += 1;
                assert!(random.below(7) < 7);
                let [a, b] = random.normals().map(f64::from);
                sum += a + b;
                squares += a * a + b * b;
                fourth += a.powi(4) + b.powi(4);
                mixed += a * b;
            }
        }
        // 10 000 numbers in 16 cells: 625 each, give or take five times √586.
        assert!(cells.iter().all(|n| n.abs_diff(625) < 121), "{cells:?}");
        // 20 000 normal numbers: five standard errors each.
        assert!(sum.abs() / 20_000.0 < 0.035, "{sum}");
        assert!((squares / 20_000.0 - 1.0).abs() < 0.05, "{squares}");
        assert!((fourth / 20_000.0 - 3.0).abs() < 0.35, "{fourth}");
        assert!(mixed.abs() / 10_000.0 < 0.05, "{mixed}");
        assert_eq!(Random::new(7).unit(), Random::new(7).unit());
        assert_eq!(Random::new(1).below(0), 0);
    }
}
