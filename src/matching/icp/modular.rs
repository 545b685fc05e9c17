//! Iterative closest point with every stage a choice: for comparing, teaching, and scenes that want another mixture.
//!
//! The loop pairs each point with a point of the reference, weighs the pairs, drops the worst, and moves the scan to where
//! what is left fits best; then again, since other pairs are closest there. The stages are those of Rusinkiewicz and Levoy
//! (3DIM 2001). Each is a small trait with a type a choice; what is not chosen costs no flash.
//!
//! `projective` is one fixed mixture in integers, made for the smallest boards: take it unless it lacks
//! something. [`Stages::projective`] is that mixture in this module's terms, and its specification:
//! `host-tests/tests/matching/staged.rs`, `the_fused_path_is_these_stages_in_integers`, holds the two within 3 mm and 0.05°.
//!
//! | stage | default | choices |
//! | --- | --- | --- |
//! | [`selection`] | `All` | every k-th, random, features, normal space |
//! | [`correspondence`] | `Closest` | brute force, compatible, normal shooting, projection |
//! | [`weighting`] | [`Constant`](weighting::Constant) | distance, normals, range noise, four robust kernels, pairs of these |
//! | [`rejection`] | [`Trimmed`](rejection::Trimmed) | distance, worst share, median, doubles, boundary, visibility, pairs |
//! | [`minimisation`] | [`PointToLine`] | point to point, Censi's constrained form |

pub mod correspondence;
mod limits;
pub mod minimisation;
pub mod normals;
mod pair;
pub mod rejection;
pub mod selection;
mod verdict;
pub mod weighting;

use crate::{
    geometry::{Point, Pose},
    matching::{Match, MatchError, degeneracy},
    math,
    scan::ScanPoint,
};
use correspondence::{Correspond, Projection};
use heapless::Vec;
pub use limits::Limits;
use minimisation::{Minimise, PointToLine};
pub use normals::Cloud;
use normals::Surface;
pub use pair::Pair;
use rejection::{Nothing, Reject};
use selection::{All, Select};
use verdict::Determined;
use weighting::{GemanMcClure, RangeUncertainty, Weigh};

/// A choice for every stage, and when to stop.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stages<S, C, W, R, M> {
    /// Which points take part.
    pub selection: S,
    /// Which reference point each is paired with.
    pub correspondence: C,
    /// What a pair counts.
    pub weighting: W,
    /// Which pairs do not count at all.
    pub rejection: R,
    /// What is made small, and how.
    pub minimisation: M,
    /// When it ends.
    pub limits: Limits,
}

/// The choices that `projective` has built in: all points, projection, noise of the range seen across the
/// surface and Geman–McClure, no rejection, point to line.
pub type Projective<const B: usize> =
    Stages<All, Projection<B>, (RangeUncertainty, GemanMcClure), Nothing, PointToLine>;

impl<const B: usize> Projective<B> {
    /// The mixture of `projective` in its last passes, in `f32`: what the fast matcher computes in
    /// integers. B: directions of the reference.
    ///
    /// `host-tests/tests/matching/staged.rs` holds the two within 3 mm and 0.05° of each other.
    #[must_use]
    pub fn projective() -> Self {
        Self {
            selection: All,
            correspondence: Projection::new(),
            // Half weight of the last passes: a gate of 32 mm times 0.64 is 21 mm, which a scale of 32 mm has as well.
            weighting: (RangeUncertainty::default(), GemanMcClure { scale: 0.032 }),
            rejection: Nothing,
            minimisation: PointToLine,
            limits: Limits {
                // Lines as short as those of the fast matcher far off; with 4 one pair in 50 differs by 2.3 mm.
                neighbours: 3,
                ..Limits::DEFAULT
            },
        }
    }
}

/// Room for [`align`]: about 77·N bytes. N is the most points a scan may have; further ones are left out.
#[derive(Debug, Clone)]
pub struct Workspace<const N: usize> {
    reference: [Surface; N],
    current: [Surface; N],
    chosen: [bool; N],
    pairs: Vec<Pair, N>,
}

impl<const N: usize> Workspace<N> {
    /// Room with nothing in it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            reference: [Surface::NONE; N],
            current: [Surface::NONE; N],
            chosen: [false; N],
            pairs: Vec::new(),
        }
    }

    /// The pairs of the last pass, those rejected with weight 0.
    #[must_use]
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }
}

impl<const N: usize> Default for Workspace<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Pose of the lidar that saw `points` in the frame of the one that saw `reference`.
///
/// `guess` is where the search starts and what the result keeps along a direction that the scene does not determine.
/// In `f32`, a few square roots a point and pass: for hosts and boards with an FPU.
///
/// A pair that changes sides at every pass moves the pose by less than the noise: a last step below 1 cm and 0.3° is a
/// result, too.
///
/// # Errors
/// See [`MatchError`]: too few beams, pairs or directions, or the last step was longer than that.
pub fn align<const N: usize, S, C, W, R, M>(
    reference: &[ScanPoint],
    points: &[ScanPoint],
    guess: Pose,
    stages: &mut Stages<S, C, W, R, M>,
    workspace: &mut Workspace<N>,
) -> Result<Match, MatchError>
where
    S: Select,
    C: Correspond,
    W: Weigh,
    R: Reject,
    M: Minimise,
{
    let limits = stages.limits;
    let (reference, points) = (first(reference, N), first(points, N));
    verdict::enough(reference, points, guess, &limits)?;
    let half = usize::from(limits.neighbours);
    let Workspace {
        reference: lines,
        current,
        chosen,
        pairs,
    } = workspace;
    let reference = normals::lay(reference, half, lines);
    let current = normals::lay(points, half, current);
    let chosen = first_mut(chosen, current.points.len());
    chosen.fill(false);
    stages.selection.select(current, chosen);
    stages.correspondence.prepare(reference);
    let lever = degeneracy::mean_range(current.points);
    let (mut pose, mut passes) = (guess, 0);
    loop {
        passes += 1;
        associate(stages, reference, current, chosen, pose, pairs);
        for pair in pairs.iter_mut() {
            pair.weight = stages.weighting.weigh(pair, reference);
        }
        stages.rejection.reject(pairs, reference);
        verdict::enough_pairs(pairs, &limits)?;
        let determined = Determined::by(pairs, reference, pose, lever)?;
        let step = stages.minimisation.step(pairs, reference, pose);
        let step = determined.part_of(step.ok_or(MatchError::Degenerate)?);
        pose = Pose::new(pose.x + step.x, pose.y + step.y, pose.theta + step.theta);
        let short = step.distance() < limits.translation_tolerance
            && math::abs(step.theta) < limits.rotation_tolerance;
        if short || passes >= limits.max_iterations {
            let poses = [guess, pose, step];
            return verdict::judge(pairs, current, &determined, poses, passes, &limits);
        }
    }
}

/// Pairs every chosen point, at `pose`, with its correspondence.
fn associate<const N: usize, S, C, W, R, M>(
    stages: &mut Stages<S, C, W, R, M>,
    reference: Cloud<'_>,
    current: Cloud<'_>,
    chosen: &[bool],
    pose: Pose,
    pairs: &mut Vec<Pair, N>,
) where
    C: Correspond,
    M: Minimise,
{
    pairs.clear();
    let (s, c) = math::sin_cos(pose.theta);
    let turned = |x: f32, y: f32| [c * x - s * y, s * x + c * y];
    let all = current.points.iter().zip(current.surfaces);
    for (index, ((point, surface), _)) in all.zip(chosen).enumerate().filter(|(_, (_, on))| **on) {
        let [x, y] = turned(f32::from(point.x) * 1e-3, f32::from(point.y) * 1e-3);
        let place = Point::new(x + pose.x, y + pose.y);
        let [nx, ny] = surface.normal;
        let normal = turned(nx, ny);
        let Some(found) = stages.correspondence.find(reference, place, normal) else {
            continue;
        };
        let Some(mut pair) = Pair::new(reference, place, normal, index, found) else {
            continue;
        };
        pair.residual = stages.minimisation.residual(&pair);
        // As many pairs as points at most: it fits.
        let _ = pairs.push(pair);
    }
}

fn first<T>(slice: &[T], most: usize) -> &[T] {
    slice.get(..most).unwrap_or(slice)
}

fn first_mut<T>(slice: &mut [T], most: usize) -> &mut [T] {
    let most = most.min(slice.len());
    slice.get_mut(..most).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matching::virtual_scan::VirtualScan;

    #[test]
    fn the_buffers_are_as_large_as_said() {
        assert!(size_of::<Workspace<360>>() <= 77 * 360 + 16);
        assert!(size_of::<VirtualScan<360>>() <= 20 * 360 + 16);
        assert_eq!(size_of::<correspondence::Projection<360>>(), 2 * 360);
        assert_eq!(size_of::<rejection::Trimmed>(), 148);
    }
}
