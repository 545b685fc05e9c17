//! Where a keyframe may have been before: candidates by place, and the earlier keyframes around each.

use heapless::Vec;

use super::{
    config::SlamConfig,
    drift::Drift,
    graph::{Graph, Slot},
};
use crate::{geometry::Pose, math};

/// Most candidates for a keyframe.
pub(super) const CANDIDATES: usize = 4;
/// Most keyframes that are seen as one.
const NEIGHBOURS: usize = 8;
/// Most keyframes that one is weighed against: what the fourth saw already is worth nothing.
const AROUND: usize = 6;

/// Keyframes whose places against each other are known to this (m²) are seen as one: farther off a second wall would show.
pub(super) const WELL_KNOWN: f32 = 0.06 * 0.06;

/// An earlier keyframe whose surroundings a later one may see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// The earlier keyframe.
    pub slot: Slot,
    /// The later one as seen from it, by the graph.
    pub guess: Pose,
    /// Variance of the guess: position (m²), heading (rad²).
    pub variance: (f32, f32),
}

/// A guess that may be this far off (m, 3σ) is none that a local match finds its pose from.
const LOOSE: f32 = 0.3;

impl Candidate {
    /// Whether the graph tells so little of where the keyframe should be that a match must search, and others confirm it.
    pub(super) fn is_loose(&self) -> bool {
        3.0 * math::sqrt(self.variance.0) > LOOSE
    }

    /// Whether the graph tells nothing of where the keyframe should be: it is in another submap.
    pub(super) const fn is_anywhere(&self) -> bool {
        self.variance.0 == f32::INFINITY
    }

    /// Where a match starts: the first, second … guess.
    pub(super) fn guess(&self, attempt: u8) -> Option<Pose> {
        match attempt {
            0 => Some(self.guess),
            // Where the graph does not know, the robot may as well be back at the very place.
            1 if self.is_loose() && !self.is_anywhere() => {
                Some(Pose::new(0.0, 0.0, self.guess.theta))
            }
            _ => None,
        }
    }
}

/// The earlier keyframes that may see what `slot` sees, likeliest first; `drift` is that of `slot`.
///
/// Of keyframes made one after the other only the likeliest is taken.
pub(super) fn candidates<const K: usize, const E: usize>(
    graph: &Graph<K, E>,
    drift: &Drift<K, E>,
    slot: Slot,
    all_around: bool,
    config: &SlamConfig,
) -> Vec<Candidate, CANDIDATES> {
    let mut chosen: Vec<(Candidate, u32), CANDIDATES> = Vec::new();
    let Some(&here) = graph.node(slot) else {
        return Vec::new();
    };
    for _ in 0..CANDIDATES {
        let mut best: Option<(f32, Candidate, u32)> = None;
        for (other, node) in graph.nodes() {
            let taken = |(_, id): &(Candidate, u32)| id.abs_diff(node.id) < config.min_apart / 2;
            if node.submap != here.submap
                || node.id.abs_diff(here.id) < config.min_apart
                || chosen.iter().any(taken)
            {
                continue;
            }
            let guess = node.pose.between(here.pose);
            let variance = drift.of(other);
            let reach = config.reach + 3.0 * math::sqrt(variance.0);
            let turn = math::abs(guess.theta);
            let distance = guess.distance();
            if distance > math::min(reach, config.max_reach)
                || (!all_around && turn > config.max_rotation)
            {
                continue;
            }
            let rank = distance + if all_around { 0.0 } else { turn };
            // Edges are gone through for the few that are left.
            if best.as_ref().is_none_or(|(least, ..)| rank < *least)
                && !graph.are_joined(slot, other)
            {
                let candidate = Candidate {
                    slot: other,
                    guess,
                    variance,
                };
                best = Some((rank, candidate, node.id));
            }
        }
        let Some((_, candidate, id)) = best else {
            break;
        };
        // As many as there is room for.
        let _ = chosen.push((candidate, id));
    }
    let mut candidates = Vec::new();
    for (candidate, _) in &chosen {
        let _ = candidates.push(*candidate);
    }
    candidates
}

/// The keyframes that see what lies around `at` (in the map) and whose places against `candidate` are known well, nearest
/// first; `drift` is that of the candidate.
///
/// Those fewer than `min_apart` before or after `slot` are left out: they would only agree with it.
pub(super) fn neighbours<const K: usize, const E: usize>(
    graph: &Graph<K, E>,
    drift: &Drift<K, E>,
    slot: Slot,
    at: Pose,
    config: &SlamConfig,
) -> Vec<Slot, NEIGHBOURS> {
    let mut chosen: Vec<Slot, NEIGHBOURS> = Vec::new();
    let Some(id) = graph.node(slot).map(|node| node.id) else {
        return chosen;
    };
    for _ in 0..NEIGHBOURS {
        let mut best: Option<(f32, Slot)> = None;
        for (other, node) in graph.nodes() {
            let rank = node.pose.between(at).distance();
            if drift.of(other).0 > WELL_KNOWN
                || node.id.abs_diff(id) < config.min_apart
                || rank > config.reach + 1.0
                || chosen.contains(&other)
            {
                continue;
            }
            if best.is_none_or(|(least, _)| rank < least) {
                best = Some((rank, other));
            }
        }
        let Some((_, other)) = best else { break };
        let _ = chosen.push(other);
    }
    chosen
}

/// The keyframes around `slot`, nearest first.
pub(super) fn around<const K: usize, const E: usize>(
    graph: &Graph<K, E>,
    slot: Slot,
    reach: f32,
) -> Vec<Slot, AROUND> {
    let mut chosen: Vec<Slot, AROUND> = Vec::new();
    let Some(here) = graph.node(slot) else {
        return chosen;
    };
    for _ in 0..AROUND {
        let others = graph.nodes().filter(|(other, node)| {
            *other != slot && node.submap == here.submap && !chosen.contains(other)
        });
        let ranked = others.map(|(other, node)| (other, here.pose.between(node.pose).distance()));
        let near = ranked.filter(|(_, distance)| *distance <= reach);
        let Some((other, _)) = near.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let _ = chosen.push(other);
    }
    chosen
}
