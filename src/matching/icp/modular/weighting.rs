//! Third stage: what a pair counts.
//!
//! Rusinkiewicz and Levoy found that weights matter little and rejection more; a robust kernel is both.
//! Two choices make one as a pair, `(RangeUncertainty::default(), GemanMcClure::default())`: the weights are
//! multiplied, and the second sees the first's.

use crate::{
    matching::icp::modular::{normals::Cloud, pair::Pair},
    math,
};

/// Weighs pairs.
pub trait Weigh {
    /// The pair's new weight; `pair.weight` is the one so far, 1 at first.
    fn weigh(&mut self, pair: &Pair, reference: Cloud<'_>) -> f32;
}

impl<A: Weigh, B: Weigh> Weigh for (A, B) {
    fn weigh(&mut self, pair: &Pair, reference: Cloud<'_>) -> f32 {
        let weight = self.0.weigh(pair, reference);
        self.1.weigh(&Pair { weight, ..*pair }, reference)
    }
}

/// All the same: the default, for scans without outliers or behind a strict rejection.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Constant;

impl Weigh for Constant {
    fn weigh(&mut self, pair: &Pair, _: Cloud<'_>) -> f32 {
        pair.weight
    }
}

/// Less the farther apart: `1 − d/d_max` (Godin 1994). With closest points, which mostly lie too near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance that counts nothing (m). Default 0.5.
    pub most: f32,
}

impl Default for Distance {
    fn default() -> Self {
        Self { most: 0.5 }
    }
}

impl Weigh for Distance {
    fn weigh(&mut self, pair: &Pair, _: Cloud<'_>) -> f32 {
        pair.weight * math::max(1.0 - pair.distance / self.most, 0.0)
    }
}

/// The cosine between the normals, nothing for those that look apart: among clutter. Pairs without two normals
/// count half.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Normals;

impl Weigh for Normals {
    fn weigh(&mut self, pair: &Pair, reference: Cloud<'_>) -> f32 {
        let Some(surface) = reference.surfaces.get(usize::from(pair.reference)) else {
            return 0.0;
        };
        let ([ax, ay], [bx, by]) = (pair.normal, surface.normal);
        if pair.normal == [0.0; 2] || !surface.is_some() {
            return 0.5 * pair.weight;
        }
        pair.weight * math::max(ax * bx + ay * by, 0.0)
    }
}

/// The inverse variance of a range seen across the surface, `1/(cos² β + c²)`: the right one for point-to-line.
///
/// Noise lies along the beam. A wall that is grazed is known better across than along the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeUncertainty {
    /// c: all other noise as a share of a range's. Default 0.2, which keeps the weight below 25.
    pub other: f32,
}

impl Default for RangeUncertainty {
    fn default() -> Self {
        Self { other: 0.2 }
    }
}

impl Weigh for RangeUncertainty {
    fn weigh(&mut self, pair: &Pair, reference: Cloud<'_>) -> f32 {
        let index = usize::from(pair.reference);
        let (Some(surface), Some(point)) =
            (reference.surfaces.get(index), reference.points.get(index))
        else {
            return 0.0;
        };
        let [nx, ny] = surface.normal;
        let cos = if surface.is_some() {
            (nx * f32::from(point.x) + ny * f32::from(point.y)) / f32::from(point.range.max(1))
        } else {
            1.0
        };
        pair.weight / (cos * cos + self.other * self.other)
    }
}

/// A robust kernel's square of the residual over its scale: the residual counts in standard deviations if a weight
/// before it says how large these are.
fn square(pair: &Pair, scale: f32) -> f32 {
    let ratio = pair.residual / scale;
    pair.weight * ratio * ratio
}

/// `min(1, k/|r|)`: the gentlest kernel. Where outliers are few; it never lets go of them altogether.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Huber {
    /// k (m). Default 0.02: twice the noise of a cheap lidar.
    pub scale: f32,
}

impl Default for Huber {
    fn default() -> Self {
        Self { scale: 0.02 }
    }
}

impl Weigh for Huber {
    fn weigh(&mut self, pair: &Pair, _: Cloud<'_>) -> f32 {
        let square = square(pair, self.scale);
        if square > 1.0 {
            pair.weight / math::sqrt(square)
        } else {
            pair.weight
        }
    }
}

/// `1/(1 + (r/c)²)`: a wide basin and a soft hand; the choice for a poor guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cauchy {
    /// c (m). Default 0.05.
    pub scale: f32,
}

impl Default for Cauchy {
    fn default() -> Self {
        Self { scale: 0.05 }
    }
}

impl Weigh for Cauchy {
    fn weigh(&mut self, pair: &Pair, _: Cloud<'_>) -> f32 {
        pair.weight / (1.0 + square(pair, self.scale))
    }
}

/// `(k²/(k² + r²))²`: lets go of what is far off; the choice among moving things.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GemanMcClure {
    /// k (m). Default 0.05.
    pub scale: f32,
}

impl Default for GemanMcClure {
    fn default() -> Self {
        Self { scale: 0.05 }
    }
}

impl Weigh for GemanMcClure {
    fn weigh(&mut self, pair: &Pair, _: Cloud<'_>) -> f32 {
        let share = 1.0 / (1.0 + square(pair, self.scale));
        pair.weight * share * share
    }
}

/// `(1 − (r/c)²)²`, nothing beyond c: a kernel and a gate in one, for a good guess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tukey {
    /// c (m). Default 0.15.
    pub scale: f32,
}

impl Default for Tukey {
    fn default() -> Self {
        Self { scale: 0.15 }
    }
}

impl Weigh for Tukey {
    fn weigh(&mut self, pair: &Pair, _: Cloud<'_>) -> f32 {
        let rest = math::max(1.0 - square(pair, self.scale), 0.0);
        pair.weight * rest * rest
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

    fn pair(residual: f32, weight: f32) -> Pair {
        Pair {
            place: Point::new(2.0, 0.0),
            normal: [-1.0, 0.0],
            point: 0,
            reference: 0,
            distance: residual,
            across: residual,
            residual,
            weight,
        }
    }

    /// One reference point 2 m ahead whose normal is turned by `degrees` against the beam.
    fn weight(choice: &mut impl Weigh, pair: Pair, degrees: f32) -> f32 {
        let (s, c) = math::sin_cos(degrees.to_radians());
        let points = [ScanPoint::at(Bearing(0), 2000)];
        let surfaces = [Surface {
            foot: Point::new(2.0, 0.0),
            normal: [-c, -s],
            edge: false,
        }];
        let cloud = Cloud {
            points: &points,
            surfaces: &surfaces,
        };
        choice.weigh(&pair, cloud)
    }

    #[test]
    fn weights_are_those_of_their_formulas() {
        let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a} for {b}");
        near(weight(&mut Constant, pair(9.0, 1.0), 0.0), 1.0);
        near(weight(&mut Distance::default(), pair(0.1, 1.0), 0.0), 0.8);
        near(weight(&mut Distance::default(), pair(0.6, 1.0), 0.0), 0.0);
        near(weight(&mut Normals, pair(0.0, 1.0), 60.0), 0.5);
        near(weight(&mut Normals, pair(0.0, 1.0), 120.0), 0.0);
        near(
            weight(&mut RangeUncertainty::default(), pair(0.0, 1.0), 60.0),
            1.0 / 0.29,
        );
        near(weight(&mut Huber { scale: 0.1 }, pair(0.05, 1.0), 0.0), 1.0);
        near(
            weight(&mut Huber { scale: 0.1 }, pair(-0.4, 1.0), 0.0),
            0.25,
        );
        near(weight(&mut Cauchy { scale: 0.1 }, pair(0.1, 1.0), 0.0), 0.5);
        near(
            weight(&mut GemanMcClure { scale: 0.1 }, pair(0.1, 1.0), 0.0),
            0.25,
        );
        near(
            weight(&mut Tukey { scale: 0.1 }, pair(0.05, 1.0), 0.0),
            0.5625,
        );
        near(weight(&mut Tukey { scale: 0.1 }, pair(0.2, 1.0), 0.0), 0.0);
        // A weight of 4 halves the standard deviation: the residual counts twice.
        near(
            weight(&mut Cauchy { scale: 0.1 }, pair(0.05, 4.0), 0.0),
            2.0,
        );
        let mut both = (RangeUncertainty { other: 0.0 }, Cauchy { scale: 0.1 });
        near(weight(&mut both, pair(0.05, 1.0), 60.0), 2.0);
    }
}
