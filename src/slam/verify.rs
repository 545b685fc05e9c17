//! What makes a match a loop: enough agreement, no contradiction to what is known, and other matches that close with it.

use heapless::Vec;

use super::{
    config::SlamConfig,
    graph::{Edge, Graph, Slot},
};
use crate::{geometry::Pose, matching::Match, math};

/// Whether a match alone may be a loop; `loose`: the graph tells little of where it should be, so that the match must know
/// all directions.
pub(super) fn is_plausible(found: &Match, loose: bool, config: &SlamConfig) -> bool {
    let beams = f32::from(found.beams.max(1));
    found.score >= config.min_score
        && f32::from(found.overlap) >= config.min_overlap * beams
        && found
            .starts
            .is_none_or(|starts| starts.rival <= config.max_rival)
        && (!loose || found.degenerate_direction.is_none())
}

/// Whether the difference between a match and the guess is no longer than both tell (χ², 99 %: position and heading).
pub(super) fn is_expected(off: Pose, variance: (f32, f32), found: &Match) -> bool {
    let sigma = found.covariance.0;
    // 11.34 for three: 9.21 for position and 6.63 for heading, each alone.
    let square = off.x * off.x + off.y * off.y;
    square <= 9.21 * (variance.0 + sigma.xx + sigma.yy + 0.02 * 0.02)
        && off.theta * off.theta <= 6.63 * (variance.1 + sigma.tt + 0.01 * 0.01)
}

/// Matches that wait for others to confirm them.
#[derive(Debug, Clone, Default)]
pub(super) struct Pending<const P: usize> {
    waiting: Vec<Edge, P>,
    next: usize,
}

impl<const P: usize> Pending<P> {
    /// None.
    pub(super) const fn new() -> Self {
        Self {
            waiting: Vec::new(),
            next: 0,
        }
    }

    /// Lets a match wait; the oldest gives way where there is no room.
    pub(super) fn push(&mut self, edge: Edge) {
        if let Err(edge) = self.waiting.push(edge) {
            self.next = if self.next + 1 < P { self.next + 1 } else { 0 };
            if let Some(entry) = self.waiting.get_mut(self.next) {
                *entry = edge;
            }
        }
    }

    /// The matches that wait.
    pub(super) fn as_slice(&self) -> &[Edge] {
        &self.waiting
    }

    /// Keeps the matches for which `keep` is true.
    pub(super) fn retain(&mut self, keep: impl FnMut(&Edge) -> bool) {
        self.waiting.retain(keep);
    }

    /// Forgets the matches of a node.
    pub(super) fn forget(&mut self, slot: Slot) {
        self.waiting.retain(|edge| edge.other(slot).is_none());
    }
}

/// Whether two loops close a cycle with the chains between their ends; `None` where they are too far apart to tell, and
/// for a loop and itself.
pub(super) fn closes<const K: usize, const E: usize>(
    graph: &Graph<K, E>,
    a: &Edge,
    b: &Edge,
    config: &SlamConfig,
) -> Option<bool> {
    /// Keyframes between the ends, at most.
    const NEAR: u32 = 12;
    if a == b {
        return None;
    }
    let node = |slot| graph.node(slot);
    let (i, j, k, l) = (node(a.from)?, node(a.to)?, node(b.from)?, node(b.to)?);
    if i.id.abs_diff(k.id) > NEAR || j.id.abs_diff(l.id) > NEAR / 2 {
        return None;
    }
    Some(is_closed([i, j, k, l].map(|node| node.pose), a, b, config))
}

/// Whether two matches between the same two submaps say the same of where these are to each other; `None` for others.
pub(super) fn agree<const K: usize, const E: usize>(
    graph: &Graph<K, E>,
    a: &Edge,
    b: &Edge,
    config: &SlamConfig,
) -> Option<bool> {
    let between = |from, to| graph.are_in_one(from, to);
    if between(a.from, a.to) || !between(a.from, b.from) || !between(a.to, b.to) {
        return None;
    }
    let pose = |slot| graph.pose(slot);
    let poses = [pose(a.from)?, pose(a.to)?, pose(b.from)?, pose(b.to)?];
    Some(is_closed(poses, a, b, config))
}

/// Whether two matches close a cycle with the poses of their ends, those of `a` first.
fn is_closed([i, j, k, l]: [Pose; 4], a: &Edge, b: &Edge, config: &SlamConfig) -> bool {
    let around = i.between(k) * b.motion;
    let direct = a.motion * j.between(l);
    let gap = around.between(direct);
    gap.distance() <= config.max_gap && math::abs(gap.theta) <= config.max_heading_gap
}
