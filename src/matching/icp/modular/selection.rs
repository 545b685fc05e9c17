//! First stage: which points take part.

use crate::{
    matching::icp::modular::normals::{Cloud, Surface},
    math,
    scan::ScanPoint,
};

/// Chooses points of the current scan, once a match.
pub trait Select {
    /// Sets `chosen` for the points that take part; all are false before.
    fn select(&mut self, current: Cloud<'_>, chosen: &mut [bool]);
}

/// Every point: the most accurate where time allows. The default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct All;

impl Select for All {
    fn select(&mut self, _: Cloud<'_>, chosen: &mut [bool]) {
        chosen.fill(true);
    }
}

/// Every k-th point: for less time. Twice the accuracy costs four times the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EveryNth(
    /// k. Default 4; 0 counts as 1.
    pub u16,
);

impl Default for EveryNth {
    fn default() -> Self {
        Self(4)
    }
}

impl Select for EveryNth {
    fn select(&mut self, _: Cloud<'_>, chosen: &mut [bool]) {
        for slot in chosen.iter_mut().step_by(usize::from(self.0.max(1))) {
            *slot = true;
        }
    }
}

/// A random share, another at each match: where a regular pattern would fall in step with the scene.
///
/// Marsaglia's xorshift; the same seed gives the same points everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Random {
    /// Points of 256 that are taken. Default 64.
    pub share: u8,
    /// State of the generator. Default 1; 0 counts as 1.
    pub seed: u32,
}

impl Default for Random {
    fn default() -> Self {
        Self { share: 64, seed: 1 }
    }
}

impl Random {
    fn next(&mut self) -> u32 {
        self.seed = math::random::xorshift(self.seed);
        self.seed
    }
}

impl Select for Random {
    fn select(&mut self, _: Cloud<'_>, chosen: &mut [bool]) {
        for slot in chosen {
            // The high bits are the better ones.
            *slot = self.next() >> 24 < u32::from(self.share);
        }
    }
}

/// Corners and the ends of surfaces, with their next neighbours: few points that fix all directions.
///
/// For maps of corners and for scenes with many; noise makes ends, so it is the least accurate choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Features {
    /// A corner's two arms differ by at least this (cosine of their angle). Default 0.77: 40 degrees.
    pub cos_bend: f32,
    /// Points to each side, along which the arms are laid and which come along. Default 5.
    pub arm: u8,
}

impl Default for Features {
    fn default() -> Self {
        Self {
            cos_bend: 0.77,
            arm: 5,
        }
    }
}

impl Features {
    /// Whether the scan bends at the middle one of three points.
    fn bends(&self, [a, b, c]: [&ScanPoint; 3]) -> bool {
        let arm = |from: &ScanPoint, to: &ScanPoint| {
            [
                f32::from(to.x) - f32::from(from.x),
                f32::from(to.y) - f32::from(from.y),
            ]
        };
        let ([ax, ay], [bx, by]) = (arm(a, b), arm(b, c));
        let norms = math::sqrt((ax * ax + ay * ay) * (bx * bx + by * by));
        ax * bx + ay * by < self.cos_bend * norms
    }
}

impl Select for Features {
    fn select(&mut self, current: Cloud<'_>, chosen: &mut [bool]) {
        let arm = usize::from(self.arm.max(1));
        let points = current.points;
        for (i, (point, surface)) in points.iter().zip(current.surfaces).enumerate() {
            let arms = (points.get(i.wrapping_sub(arm)), points.get(i + arm));
            let corner = match arms {
                (Some(before), Some(after)) => self.bends([before, point, after]),
                _ => false,
            };
            if corner || surface.edge {
                let from = i.saturating_sub(arm);
                let to = (i + arm + 1).min(chosen.len());
                if let Some(around) = chosen.get_mut(from..to) {
                    around.fill(true);
                }
            }
        }
    }
}

/// As many points of each direction of surface as there are: the few that stop a slide along a corridor stay in.
///
/// Rusinkiewicz and Levoy's normal-space sampling: 16 bins over half a turn, one point of each in turn until the
/// budget is met. The best choice for few points among long walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NormalSpace {
    /// Points taken. Default 90.
    pub budget: u16,
}

impl Default for NormalSpace {
    fn default() -> Self {
        Self { budget: 90 }
    }
}

/// Directions of surfaces that are told apart: half a turn in bins of 11.25 degrees.
const BINS: usize = 16;

/// Bin of a surface's direction, `None` where there is no surface.
fn bin(surface: &Surface) -> Option<usize> {
    if !surface.is_some() {
        return None;
    }
    let [nx, ny] = surface.normal;
    let turn = math::atan2_turn(
        math::round_to_i32(ny * 32768.0),
        math::round_to_i32(nx * 32768.0),
    );
    // Half a turn is 32 768: opposite walls hold the same direction. Centred, so that noise does not split a wall.
    Some((usize::from(turn.wrapping_add(1024) & 0x7fff) * BINS) >> 15)
}

impl NormalSpace {
    /// Points to take of each bin: round after round, one of each that has some left.
    fn shares(&self, counts: [u16; BINS]) -> [u16; BINS] {
        let mut shares = [0; BINS];
        let mut left = self.budget;
        while left > 0 {
            let before = left;
            for (share, count) in shares.iter_mut().zip(counts) {
                if *share < count && left > 0 {
                    *share += 1;
                    left -= 1;
                }
            }
            if left == before {
                break;
            }
        }
        shares
    }
}

impl Select for NormalSpace {
    fn select(&mut self, current: Cloud<'_>, chosen: &mut [bool]) {
        let mut counts = [0u16; BINS];
        for k in current.surfaces.iter().filter_map(bin) {
            if let Some(count) = counts.get_mut(k) {
                *count = count.saturating_add(1);
            }
        }
        let shares = self.shares(counts);
        let mut seen = [0u16; BINS];
        for (surface, slot) in current.surfaces.iter().zip(chosen) {
            let Some(k) = bin(surface) else { continue };
            let (Some(count), Some(share), Some(seen)) =
                (counts.get(k), shares.get(k), seen.get_mut(k))
            else {
                continue;
            };
            // Spread evenly over the bin's points: the i-th is taken where i·share/count steps on.
            let steps = |i: u16| u32::from(i) * u32::from(*share) / u32::from((*count).max(1));
            *slot = steps(seen.saturating_add(1)) > steps(*seen);
            *seen = seen.saturating_add(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{matching::icp::modular::normals, scan::Bearing};

    /// A corridor 2 m wide and 16 m long, with ends.
    fn corridor() -> [ScanPoint; 360] {
        core::array::from_fn(|k| {
            let bearing = Bearing::from_radians((k as f32).to_radians());
            let (s, c) = math::sin_cos(bearing.radians());
            let range = math::min(
                1.0 / math::max(s.abs(), 1e-3),
                8.0 / math::max(c.abs(), 1e-3),
            );
            ScanPoint::at(bearing, (1000.0 * range) as u16)
        })
    }

    fn chosen(select: &mut impl Select) -> [bool; 360] {
        let points = corridor();
        let mut surfaces = [Surface::NONE; 360];
        let cloud = normals::lay(&points, 4, &mut surfaces);
        let mut chosen = [false; 360];
        select.select(cloud, &mut chosen);
        chosen
    }

    fn count(chosen: &[bool]) -> usize {
        chosen.iter().filter(|c| **c).count()
    }

    #[test]
    fn each_choice_takes_its_share() {
        assert_eq!(count(&chosen(&mut All)), 360);
        assert_eq!(count(&chosen(&mut EveryNth(4))), 90);
        assert_eq!(count(&chosen(&mut EveryNth(0))), 360);
        let mut random = Random::default();
        let (first, second) = (chosen(&mut random), chosen(&mut random));
        // A quarter of 360 is 90, give or take four times √(360·¼·¾).
        assert!((58..122).contains(&count(&first)), "{}", count(&first));
        assert_ne!(first, second);
        assert_eq!(first, chosen(&mut Random::default()), "not repeatable");
    }

    #[test]
    fn normal_space_takes_the_ends_of_a_corridor_in_full() {
        let chosen = chosen(&mut NormalSpace { budget: 60 });
        // The ends are seen within atan(1/8) = 7.1 degrees of the axis.
        let end = |k: usize| [k.abs_diff(0), k.abs_diff(180), k.abs_diff(360)];
        let ends = (0..360).filter(|k| end(*k).into_iter().any(|d| d <= 5));
        let all = ends.clone().count();
        let taken = ends.filter(|k| chosen[*k]).count();
        // Half of the 60 are theirs, more than there are.
        assert!(taken + 2 >= all.min(30), "{taken} of {all}");
        assert!((50..=60).contains(&count(&chosen)), "{}", count(&chosen));
    }

    #[test]
    fn features_are_the_corners() {
        let chosen = chosen(&mut Features::default());
        for corner in [7, 173, 187, 353] {
            assert!(chosen[corner], "{corner}");
        }
        assert!(!chosen[90] && !chosen[270] && !chosen[60]);
        assert!(count(&chosen) < 180);
    }
}
