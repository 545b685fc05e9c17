//! Which keyframe makes room where the memory is full: the one that tells least about the map.

use super::{Slam, graph::Slot, loops, pruning};
use crate::geometry::Pose;

/// Worth of a keyframe that is to be weighed.
pub(super) const UNWEIGHED: u16 = u16::MAX;
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

    pub(super) fn is_worth_unknown(&self, slot: Slot) -> bool {
        let worth = self.worth.get(usize::from(slot));
        worth == Some(&UNWEIGHED) && self.graph.node(slot).is_some()
    }

    /// Keyframes around a place are to be weighed anew.
    pub(super) fn forget_worths(&mut self, place: Pose) {
        for (slot, node) in self.graph.nodes() {
            let near = node.pose.between(place).distance() < self.config.reach;
            if let Some(worth) = self.worth.get_mut(usize::from(slot)).filter(|_| near) {
                *worth = UNWEIGHED;
            }
        }
    }

    /// Weighs a keyframe where that is to be done.
    pub(super) fn weigh(&mut self, slot: Slot) {
        if !self.is_worth_unknown(slot) {
            return;
        }
        let information = self.information(slot).min(u32::from(KEPT - 1));
        if let Some(worth) = self.worth.get_mut(usize::from(slot)) {
            *worth = information as u16;
        }
    }

    /// Removes the keyframe worth least. The newest ones, the oldest one and those not looked at so far stay.
    pub(super) fn remove_least(&mut self) {
        let newest = self.last.map_or(0, |last| last.id);
        let oldest = self.graph.nodes().map(|(_, node)| node.id).min();
        let removable = self.graph.nodes().filter(|(slot, node)| {
            newest.wrapping_sub(node.id) > self.config.min_apart
                && Some(node.id) != oldest
                && !self.fresh.iter().any(|fresh| fresh == slot)
        });
        let worth = |slot: Slot| self.worth.get(usize::from(slot)).copied();
        let least = removable.min_by_key(|(slot, _)| worth(*slot).unwrap_or(KEPT));
        let Some((slot, place)) = least.map(|(slot, node)| (slot, node.pose)) else {
            self.stuck = true;
            return;
        };
        self.merged = pruning::merge(&mut self.graph, slot);
        if self.merged.is_some() {
            self.counters.pruned = self.counters.pruned.wrapping_add(1);
            self.pending.forget(slot);
            self.forget_worths(place);
        } else if let Some(worth) = self.worth.get_mut(usize::from(slot)) {
            // Its edges tell too little to be merged: another one goes, if there is one.
            self.stuck = *worth == KEPT;
            *worth = KEPT;
        }
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
