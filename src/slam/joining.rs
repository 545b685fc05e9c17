//! When two submaps are one: matches between them that agree, from far enough apart, and more than those that do not.

use heapless::Vec;

use super::{
    PENDING, Slam,
    graph::{Edge, Slot},
    verify,
};
use crate::math;

/// Two places whose matches differ by less in their score look alike.
const AS_GOOD: f32 = 0.05;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Whether a match of a keyframe with another submap explains as much as its best one did. Matches that explain less are
    /// let go.
    pub(super) fn is_likeliest(&mut self, slot: Slot, score: f32) -> bool {
        let best = match self.likeliest {
            Some((other, best)) if other == slot => best,
            _ => 0.0,
        };
        if score > best + AS_GOOD {
            let graph = &self.graph;
            self.pending
                .retain(|edge| edge.to != slot || graph.are_in_one(edge.from, slot));
        }
        self.likeliest = Some((slot, math::max(score, best)));
        score > best - AS_GOOD
    }

    /// Joins the submap of a keyframe, all of whose matches with others are known now, to one of them, if enough agree with
    /// one of its matches, and far fewer on anything else.
    ///
    /// Where two places look alike a keyframe has matches with both, and tells neither: which one it is shows only where the
    /// robot has left.
    pub(super) fn join(&mut self, slot: Slot) {
        let graph = &self.graph;
        let mut between = self.pending.as_slice().iter();
        let new = between.find(|edge| {
            edge.to == slot && !graph.are_in_one(edge.from, slot) && self.is_decided(edge)
        });
        if let Some(new) = new.copied() {
            self.unite(&new);
        }
    }

    /// Whether enough keyframes, from far enough apart, agree with a match, and far fewer on anything else.
    fn is_decided(&self, new: &Edge) -> bool {
        let least = usize::from(self.config.min_votes);
        let (votes, spread) = self.votes(new);
        if votes.len() <= least || spread < self.config.min_spread {
            return false;
        }
        let only = |these: &Vec<Slot, PENDING>, those: &Vec<Slot, PENDING>| {
            these.iter().filter(|slot| !those.contains(slot)).count()
        };
        let mut others = self.pending.as_slice().iter();
        others.all(|other| {
            if verify::agree(&self.graph, new, other, &self.config) != Some(false) {
                return true;
            }
            let (rivals, _) = self.votes(other);
            let decided = only(&votes, &rivals);
            decided > least && decided >= 2 * only(&rivals, &votes)
        })
    }

    /// Makes the submaps of both ends of a match one, and loops of all that agree with it.
    fn unite(&mut self, new: &Edge) {
        let (Some(&there), Some(&here)) = (self.graph.node(new.from), self.graph.node(new.to))
        else {
            return;
        };
        let mut agreeing: Vec<Edge, PENDING> = Vec::new();
        let (graph, config) = (&self.graph, &self.config);
        self.pending.retain(|edge| {
            let agrees = verify::agree(graph, new, edge, config);
            if edge == new || agrees == Some(true) {
                // As many as wait at most: it fits.
                let _ = agreeing.push(*edge);
            }
            // The others between the two were wrong.
            agrees.is_none()
        });
        // The older frame stays.
        let motion = there.pose * new.motion * here.pose.inverse();
        if there.submap < here.submap {
            self.graph.unite(here.submap, there.submap, motion);
        } else {
            self.graph
                .unite(there.submap, here.submap, motion.inverse());
        }
        self.counters.joined = self.counters.joined.wrapping_add(1);
        self.contradicted = true;
        for edge in &agreeing {
            self.close(*edge);
        }
    }

    /// The keyframes of the robot's submap whose matches agree with one, and how far apart they are (m).
    fn votes(&self, one: &Edge) -> (Vec<Slot, PENDING>, f32) {
        let mut votes = Vec::new();
        let mut spread = 0.0;
        for edge in self.pending.as_slice() {
            if verify::agree(&self.graph, one, edge, &self.config) != Some(true)
                || votes.contains(&edge.to)
            {
                continue;
            }
            if let Some((a, b)) = self.graph.pose(one.to).zip(self.graph.pose(edge.to)) {
                spread = math::max(spread, a.between(b).distance());
            }
            // As many as wait at most: it fits.
            let _ = votes.push(edge.to);
        }
        (votes, spread)
    }
}
