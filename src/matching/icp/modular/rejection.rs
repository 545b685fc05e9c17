//! Fourth stage: which pairs do not count. A rejected pair has weight 0.
//!
//! Two choices make one as a pair: the second sees what the first left.

pub mod trimmed;

use crate::{
    matching::icp::modular::{normals::Cloud, pair::Pair},
    math,
};
pub use trimmed::Trimmed;

/// Takes the weight from pairs that are likely wrong.
pub trait Reject {
    /// Looks at the pairs, in the order of their points.
    fn reject(&mut self, pairs: &mut [Pair], reference: Cloud<'_>);
}

impl<A: Reject, B: Reject> Reject for (A, B) {
    fn reject(&mut self, pairs: &mut [Pair], reference: Cloud<'_>) {
        self.0.reject(pairs, reference);
        self.1.reject(pairs, reference);
    }
}

/// None: with a kernel that lets go of outliers by itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Nothing;

impl Reject for Nothing {
    fn reject(&mut self, _: &mut [Pair], _: Cloud<'_>) {}
}

/// Pairs that still count.
fn counting(pairs: &mut [Pair]) -> impl Iterator<Item = &mut Pair> {
    pairs.iter_mut().filter(|pair| pair.weight > 0.0)
}

/// Rejects what `wrong` says.
fn drop_if(pairs: &mut [Pair], mut wrong: impl FnMut(&Pair) -> bool) {
    for pair in counting(pairs) {
        if wrong(pair) {
            pair.weight = 0.0;
        }
    }
}

/// The residual that `share` of the counting pairs do not exceed (m), exact: bisection over the bits of a float, at
/// most 31 looks at each pair and no sorting.
fn quantile(pairs: &[Pair], share: f32) -> f32 {
    let residuals = || {
        let counting = pairs.iter().filter(|pair| pair.weight > 0.0);
        counting.map(|pair| math::abs(pair.residual))
    };
    let total = residuals().count();
    let wanted = math::round_to_i32(share * total as f32).max(1) as usize;
    // Positive floats are in the order of their bits.
    let (mut low, mut high) = (0, f32::INFINITY.to_bits());
    while low < high {
        let middle = low + (high - low) / 2;
        let limit = f32::from_bits(middle);
        if residuals().filter(|r| *r <= limit).count() >= wanted {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    f32::from_bits(low)
}

/// Longer than a fixed gate: with a guess whose error is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Longest pair (m). Default 0.3: at 1 m/s and 5 turns a second the scene moves 0.2 m.
    pub most: f32,
}

impl Default for Distance {
    fn default() -> Self {
        Self { most: 0.3 }
    }
}

impl Reject for Distance {
    fn reject(&mut self, pairs: &mut [Pair], _: Cloud<'_>) {
        drop_if(pairs, |pair| pair.distance > self.most);
    }
}

/// A fixed share with the largest residuals (Pulli 1999): where the share of outliers is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstShare {
    /// Share that goes, 0…1. Default 0.1.
    pub share: f32,
}

impl Default for WorstShare {
    fn default() -> Self {
        Self { share: 0.1 }
    }
}

impl Reject for WorstShare {
    fn reject(&mut self, pairs: &mut [Pair], _: Cloud<'_>) {
        let limit = quantile(pairs, 1.0 - self.share);
        drop_if(pairs, |pair| math::abs(pair.residual) > limit);
    }
}

/// More than a multiple of the median residual: a gate that narrows by itself as the pose gets better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MedianMultiple {
    /// The multiple. Default 4.4, three standard deviations of normal noise.
    pub factor: f32,
    /// The gate does not get narrower than this (m). Default 0.02: twice the noise of a cheap lidar.
    pub least: f32,
}

impl Default for MedianMultiple {
    fn default() -> Self {
        Self {
            factor: 4.4,
            least: 0.02,
        }
    }
}

impl Reject for MedianMultiple {
    fn reject(&mut self, pairs: &mut [Pair], _: Cloud<'_>) {
        let limit = math::max(self.factor * quantile(pairs, 0.5), self.least);
        drop_if(pairs, |pair| math::abs(pair.residual) > limit);
    }
}

/// Several points on one reference point: those farther than a few times its nearest go.
///
/// With closest points, where all that sees a new surface crowds on the last point of the old one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubles {
    /// A pair may be this many times as long as the shortest with the same reference point. Default 3.
    pub factor: f32,
}

impl Default for Doubles {
    fn default() -> Self {
        Self { factor: 3.0 }
    }
}

/// Pairs before and after one that may share its reference point: points next to each other find points next to
/// each other.
const NEIGHBOURS: usize = 16;

impl Reject for Doubles {
    fn reject(&mut self, pairs: &mut [Pair], _: Cloud<'_>) {
        for i in 0..pairs.len() {
            let from = i.saturating_sub(NEIGHBOURS);
            let to = (i + NEIGHBOURS + 1).min(pairs.len());
            let (Some(pair), Some(around)) = (pairs.get(i).copied(), pairs.get(from..to)) else {
                continue;
            };
            let shortest = around
                .iter()
                .filter(|other| other.reference == pair.reference)
                .fold(pair.distance, |least, other| {
                    math::min(least, other.distance)
                });
            if let Some(pair) = pairs.get_mut(i)
                && pair.distance > self.factor * shortest
            {
                pair.weight = 0.0;
            }
        }
    }
}

/// Reference points at the end of a surface: what a scan does not overlap is drawn to them (Turk and Levoy 1994).
/// With closest points and little overlap.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Boundary;

impl Reject for Boundary {
    fn reject(&mut self, pairs: &mut [Pair], reference: Cloud<'_>) {
        drop_if(pairs, |pair| {
            let surface = reference.surfaces.get(usize::from(pair.reference));
            surface.is_none_or(|surface| surface.edge)
        });
    }
}

/// Points that the reference's lidar would see from behind: it cannot have seen them. After large motions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Visibility;

impl Reject for Visibility {
    fn reject(&mut self, pairs: &mut [Pair], _: Cloud<'_>) {
        drop_if(pairs, |pair| {
            pair.normal[0] * pair.place.x + pair.normal[1] * pair.place.y > 0.0
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::Point,
        matching::icp::modular::normals::Surface,
        scan::{Bearing, ScanPoint},
    };

    /// Pairs with residuals of 1 to 10 cm, the k-th with the k-th reference point, but the last two with one.
    fn left(choice: &mut impl Reject) -> [bool; 10] {
        let mut pairs: [Pair; 10] = core::array::from_fn(|k| Pair {
            place: Point::new(2.0, 0.0),
            normal: if k == 4 { [1.0, 0.0] } else { [-1.0, 0.0] },
            point: k as u16,
            reference: if k == 9 { 0 } else { k as u16 },
            distance: 0.01 * (k + 1) as f32,
            across: 0.0,
            residual: if k % 2 == 0 { -0.01 } else { 0.01 } * (k + 1) as f32,
            weight: 1.0,
        });
        let points = [ScanPoint::at(Bearing(0), 2000); 10];
        let surfaces: [Surface; 10] = core::array::from_fn(|k| Surface {
            foot: Point::new(2.0, 0.0),
            normal: [-1.0, 0.0],
            edge: k == 3,
        });
        let cloud = Cloud {
            points: &points,
            surfaces: &surfaces,
        };
        choice.reject(&mut pairs, cloud);
        pairs.map(|pair| pair.weight > 0.0)
    }

    /// All but these.
    fn without(gone: &[usize]) -> [bool; 10] {
        core::array::from_fn(|k| !gone.contains(&k))
    }

    #[test]
    fn each_choice_rejects_what_it_should() {
        assert_eq!(left(&mut Nothing), without(&[]));
        assert_eq!(left(&mut Distance { most: 0.075 }), without(&[7, 8, 9]));
        assert_eq!(left(&mut WorstShare { share: 0.2 }), without(&[8, 9]));
        let median = MedianMultiple {
            factor: 1.5,
            least: 0.02,
        };
        // The median of ten is the fifth: 5 cm.
        assert_eq!(left(&mut { median }), without(&[7, 8, 9]));
        let wide = MedianMultiple {
            least: 0.2,
            ..median
        };
        assert_eq!(left(&mut { wide }), without(&[]));
        assert_eq!(left(&mut Doubles::default()), without(&[9]));
        assert_eq!(left(&mut Boundary), without(&[3]));
        assert_eq!(left(&mut Visibility), without(&[4]));
        let mut both = (Visibility, WorstShare { share: 0.1 });
        assert_eq!(left(&mut both), without(&[4, 9]));
    }
}
