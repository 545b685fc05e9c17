//! The map drawn from its keyframes when it is asked for: it is kept nowhere.

use super::{Slam, graph::Slot};
use crate::{
    geometry::Point,
    grid::{
        Grid,
        occupancy::{self, UpdateConfig},
    },
    math,
};

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Enters what the keyframe in a slot saw into an occupancy grid; whether there is one in it that
    /// [is in the map](Slam::is_in_map).
    ///
    /// One slot is one slice of work: slots go from 0 up to K. The grid must contain the keyframe's place, else nothing
    /// is entered. At the end [`occupancy::decide`] makes cells free, occupied or unknown.
    pub fn draw<S: AsRef<[u8]> + AsMut<[u8]>>(
        &mut self,
        slot: Slot,
        grid: &mut Grid<S>,
        config: &UpdateConfig,
    ) -> bool {
        if !self.is_in_map(slot) {
            return false;
        }
        let scan = self.scans.get(usize::from(slot));
        let Some((pose, scan)) = self.graph.pose(slot).zip(scan) else {
            return false;
        };
        scan.unpack(&mut self.other);
        occupancy::update(grid, pose, &self.other, config);
        true
    }

    /// The smallest and the largest coordinates (m) of all that the keyframes of the map saw no farther than `max_range` (m), and
    /// of the places that they saw it from; `None` without keyframes. Unpacks every keyframe of the map.
    pub fn extent(&mut self, max_range: f32) -> Option<(Point, Point)> {
        let mut found: Option<(Point, Point)> = None;
        let map = self.graph.oldest_submap();
        let nodes = self.graph.nodes();
        for (slot, node) in nodes.filter(|(_, node)| Some(node.submap) == map) {
            if let Some(scan) = self.scans.get(usize::from(slot)) {
                scan.unpack(&mut self.other);
            }
            let near = self
                .other
                .iter()
                .map(|point| Point::new(f32::from(point.x) * 1e-3, f32::from(point.y) * 1e-3))
                .filter(|point| math::abs(point.x) <= max_range && math::abs(point.y) <= max_range);
            for point in near.chain([Point::new(0.0, 0.0)]) {
                let at = node.pose * point;
                let (low, high) = found.unwrap_or((at, at));
                found = Some((
                    Point::new(math::min(low.x, at.x), math::min(low.y, at.y)),
                    Point::new(math::max(high.x, at.x), math::max(high.y, at.y)),
                ));
            }
        }
        found
    }
}
