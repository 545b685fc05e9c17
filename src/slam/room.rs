//! Which keyframe makes room where the memory is full: the one that tells least about the map.

use super::{
    Merged, Slam,
    graph::Slot,
    loops,
    pruning::{self, UNWEIGHED},
};

/// Worth of one that cannot be removed: more than any other.
const KEPT: u16 = UNWEIGHED - 1;
/// Free places below which a keyframe is removed.
const SPARE: usize = 4;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    pub(super) fn wants_room(&self) -> bool {
        self.graph.len() + SPARE > K && !self.stuck
    }

    /// A keyframe that was not weighed so far.
    pub(super) fn unweighed(&self) -> Option<Slot> {
        let unweighed = (0..)
            .zip(&self.worth)
            .filter(|(_, worth)| **worth == UNWEIGHED);
        let mut slots = unweighed.map(|(slot, _)| slot);
        slots.find(|slot| self.graph.node(*slot).is_some())
    }

    /// Weighs a keyframe.
    pub(super) fn weigh(&mut self, slot: Slot) {
        let information = self.information(slot).min(u32::from(KEPT - 1));
        if let Some(worth) = self.worth.get_mut(usize::from(slot)) {
            *worth = information as u16;
        }
    }

    /// The keyframe worth least of those that may be removed, by what was weighed last.
    ///
    /// A keyframe is worth more once others are gone, never less: what was weighed before is a lower bound. One that is
    /// still worth least when it is weighed again is the one (Minoux's accelerated greedy algorithm, 1978).
    pub(super) fn least(&self) -> Option<Slot> {
        let worth = |slot: Slot| self.worth.get(usize::from(slot)).copied();
        self.removable()
            .min_by_key(|slot| worth(*slot).unwrap_or(KEPT))
    }

    /// Removes a keyframe for room.
    pub(super) fn make_room(&mut self, slot: Slot) {
        self.merged = self.remove(slot);
        let Some(worth) = self.worth.get_mut(usize::from(slot)) else {
            return;
        };
        if self.merged.is_none() {
            // Its edges tell too little to be merged: another one goes, if there is one.
            self.stuck = *worth == KEPT;
            *worth = KEPT;
        }
    }

    /// Slots of the keyframes that may be removed: the newest ones, the oldest one and those not looked at so far stay.
    pub fn removable(&self) -> impl Iterator<Item = Slot> + '_ {
        let newest = self.last.map_or(0, |last| last.id);
        let oldest = self.graph.nodes().map(|(_, node)| node.id).min();
        let removable = self.graph.nodes().filter(move |(slot, node)| {
            newest.wrapping_sub(node.id) > self.config.min_apart
                && Some(node.id) != oldest
                && !self.fresh.iter().any(|fresh| fresh == slot)
        });
        removable.map(|(slot, _)| slot)
    }

    /// The keyframe that tells least about the map of those that may be removed. Weighs as many as that takes.
    pub fn least_informative(&mut self) -> Option<Slot> {
        let mut weighed = None;
        // Each is weighed once at most but for ties.
        for _ in 0..2 * K {
            let next = match self.unweighed() {
                Some(slot) => slot,
                None => self.least()?,
            };
            if weighed == Some(next) {
                break;
            }
            self.weigh(next);
            weighed = Some(next);
        }
        weighed
    }

    /// Removes a keyframe, its edges merged into a tree between its neighbours; `None`, and nothing done, where there is
    /// none or its edges tell too little.
    pub fn remove(&mut self, slot: Slot) -> Option<Merged> {
        let merged = pruning::merge(&mut self.graph, slot)?;
        self.counters.pruned = self.counters.pruned.wrapping_add(1);
        self.pending.forget(slot);
        // The sums under way lack the merged edges.
        self.solver.restart();
        Some(merged)
    }

    /// Expected information of a keyframe about the map, given the others around it (256ths of a bit).
    fn information(&mut self, slot: Slot) -> u32 {
        let Some(pose) = self.graph.pose(slot) else {
            return 0;
        };
        if let Some(scan) = self.scans.get(usize::from(slot)) {
            scan.unpack(&mut self.own);
        }
        self.seen.fill(0);
        for other in loops::around(&self.graph, slot, self.config.reach) {
            let scan = self.scans.get(usize::from(other));
            let Some((at, scan)) = self.graph.pose(other).zip(scan) else {
                continue;
            };
            scan.unpack(&mut self.other);
            self.view.clear();
            self.view.add(pose, &self.other, at);
            pruning::count(&mut self.seen, &self.own, |point| {
                self.view.range(point.bearing)
            });
        }
        pruning::information(self.seen.get(..self.own.len()).unwrap_or(&[]))
    }
}
