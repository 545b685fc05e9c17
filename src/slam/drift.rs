//! How far off the graph's poses may be against each other: the shortest path in the sense of variance.

use heapless::Vec;

use super::graph::{Graph, Kind, Slot};

/// Variances of the poses of nodes as seen from one of them: 8·K bytes.
#[derive(Debug, Clone)]
pub(super) struct Drift<const K: usize> {
    /// Of position (m²) and heading (rad²); infinite where no path is known.
    variances: [(f32, f32); K],
}

impl<const K: usize> Drift<K> {
    /// Nothing known.
    pub(super) const fn new() -> Self {
        Self {
            variances: [UNKNOWN; K],
        }
    }

    /// Variance of the position (m²) and heading (rad²) of the node that [`Drift::assign`] was given, as seen from `slot`.
    pub(super) fn of(&self, slot: Slot) -> (f32, f32) {
        self.variances
            .get(usize::from(slot))
            .copied()
            .unwrap_or(UNKNOWN)
    }

    /// Finds the paths from `start` whose variance is at most `most` (m²): Dijkstra's algorithm.
    ///
    /// Variances of the chain count `doubt` times. Errors along one path add up; that several paths know more than the best one is left out, so the variances are
    /// upper bounds. An error of heading moves the start by its distance from where the error is.
    pub(super) fn assign<const E: usize>(
        &mut self,
        graph: &Graph<K, E>,
        start: Slot,
        most: f32,
        doubt: f32,
    ) {
        self.variances.fill(UNKNOWN);
        let Some(origin) = graph.pose(start) else {
            return;
        };
        if let Some(entry) = self.variances.get_mut(usize::from(start)) {
            *entry = (0.0, 0.0);
        }
        let mut open: Vec<Slot, K> = Vec::new();
        let _ = open.push(start);
        while let Some((at, &slot)) = open
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| self.of(**a).0.total_cmp(&self.of(**b).0))
        {
            open.swap_remove(at);
            let (position, heading) = self.of(slot);
            for edge in graph.edges_at(slot) {
                let Some(other) = edge.other(slot) else {
                    continue;
                };
                let Some(pose) = graph.pose(other) else {
                    continue;
                };
                let (mut added, mut turned) = edge.variances();
                if edge.kind == Kind::Chain {
                    added *= doubt;
                    turned *= doubt;
                }
                let (dx, dy) = (pose.x - origin.x, pose.y - origin.y);
                let reached = (
                    position + added + turned * (dx * dx + dy * dy),
                    heading + turned,
                );
                let known = self.of(other).0;
                if reached.0 < known && reached.0 <= most {
                    if known == UNKNOWN.0 {
                        let _ = open.push(other);
                    }
                    if let Some(entry) = self.variances.get_mut(usize::from(other)) {
                        *entry = reached;
                    }
                }
            }
        }
    }
}

const UNKNOWN: (f32, f32) = (f32::INFINITY, f32::INFINITY);
