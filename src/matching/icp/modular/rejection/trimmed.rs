//! Trimmed ICP with the overlap estimated: Chetverikov, Stepanov, Krsek, IVC 23 (2005).

use crate::{
    matching::icp::modular::{normals::Cloud, pair::Pair, rejection::Reject},
    math,
};

/// The share of pairs that explains itself best, and no more: the default, where the overlap is not known.
///
/// The ξ·n pairs with the smallest residuals stay, with the ξ that makes `ψ(ξ) = (MSE(ξ) + σ²)/ξ³` least; the paper has
/// no σ, and then takes the better half of pure noise for the overlap. A histogram of 64 bins gives all ξ in one pass,
/// without sorting. 148 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trimmed {
    /// Least share that is kept. Default 0.4: below it ψ rewards leaving out.
    pub least: f32,
    /// A pair this long (m) is not explained, however near to its line. Default 0.2: strangers often lie in line with a
    /// wall, and at 10 m two beams of 1° end 0.18 m apart.
    pub reach: f32,
    /// Width of a bin (m); all beyond the 64th are its. Default 0.01.
    pub bin: f32,
    /// σ: residuals below it are not told apart (m). Default 0.02: twice the noise of a cheap lidar.
    pub noise: f32,
    /// The share found in the last pass: the overlap.
    pub overlap: f32,
    counts: [u16; BINS],
}

/// Bins of the histogram of residuals that the share is read from.
const BINS: usize = 64;

impl Default for Trimmed {
    fn default() -> Self {
        Self {
            least: 0.4,
            reach: 0.2,
            bin: 0.01,
            noise: 0.02,
            overlap: 1.0,
            counts: [0; BINS],
        }
    }
}

impl Trimmed {
    /// Bin of a pair's residual.
    fn bin_of(&self, pair: &Pair) -> usize {
        if pair.distance > self.reach {
            return BINS - 1;
        }
        ((math::abs(pair.residual) / self.bin) as usize).min(BINS - 1)
    }

    /// The last bin that is kept, and the share of pairs up to it.
    fn trim(&self, total: u16) -> (usize, f32) {
        let (mut count, mut squares) = (0u16, 0.0);
        let mut best = (BINS - 1, 1.0, f32::INFINITY);
        for (k, &here) in self.counts.iter().enumerate() {
            let middle = (k as f32 + 0.5) * self.bin;
            count = count.saturating_add(here);
            squares += f32::from(here) * middle * middle;
            let share = f32::from(count) / f32::from(total);
            // An empty bin changes nothing; ψ of none is no number.
            if share >= self.least && here > 0 {
                let mean = squares / f32::from(count) + self.noise * self.noise;
                let psi = mean / (share * share * share);
                if psi < best.2 {
                    best = (k, share, psi);
                }
            }
        }
        (best.0, best.1)
    }
}

impl Reject for Trimmed {
    fn reject(&mut self, pairs: &mut [Pair], _: Cloud<'_>) {
        self.counts = [0; BINS];
        let mut total = 0u16;
        for pair in pairs.iter().filter(|pair| pair.weight > 0.0) {
            let k = self.bin_of(pair);
            if let Some(count) = self.counts.get_mut(k) {
                *count = count.saturating_add(1);
                total = total.saturating_add(1);
            }
        }
        if total == 0 {
            return;
        }
        let (last, share) = self.trim(total);
        self.overlap = share;
        for pair in pairs.iter_mut() {
            if self.bin_of(pair) > last {
                pair.weight = 0.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn the_share_that_agrees_stays() {
        for agree in [50usize, 60, 75, 90, 100] {
            let mut pairs: [Pair; 100] = core::array::from_fn(|k| {
                // Those that agree have up to 2 cm; the others 8 cm to 1 m.
                let residual = if k < agree {
                    0.02 * k as f32 / agree as f32
                } else {
                    0.08 + 0.02 * (k - agree) as f32
                };
                Pair {
                    place: Point::new(0.0, 0.0),
                    normal: [0.0; 2],
                    point: 0,
                    reference: 0,
                    distance: residual,
                    across: residual,
                    residual,
                    weight: 1.0,
                }
            });
            let mut trimmed = Trimmed::default();
            let cloud = Cloud {
                points: &[],
                surfaces: &[],
            };
            trimmed.reject(&mut pairs, cloud);
            let share = agree as f32 / 100.0;
            assert!(
                (trimmed.overlap - share).abs() < 0.05,
                "{agree}: {}",
                trimmed.overlap
            );
            let left = pairs.iter().filter(|pair| pair.weight > 0.0).count();
            assert!(left.abs_diff(agree) < 5, "{agree}: {left}");
        }
    }
}
