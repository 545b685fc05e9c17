//! How far off the graph's poses may be against each other: the shortest path in the sense of variance.

use heapless::Vec;

use super::graph::{Graph, Kind, Slot};

/// Variances of the poses of nodes as seen from one of them: 10·K + 4·E bytes.
#[derive(Debug, Clone)]
pub(super) struct Drift<const K: usize, const E: usize> {
    /// Of position (m²) and heading (rad²); infinite where no path is known.
    variances: [(f32, f32); K],
    /// The first edge of each node, and the next one at either end of each edge.
    first: [u16; K],
    next: [[u16; 2]; E],
}

/// No edge.
const NONE: u16 = u16::MAX;
const UNKNOWN: (f32, f32) = (f32::INFINITY, f32::INFINITY);

impl<const K: usize, const E: usize> Drift<K, E> {
    /// Nothing known.
    pub(super) const fn new() -> Self {
        Self {
            variances: [UNKNOWN; K],
            first: [NONE; K],
            next: [[NONE; 2]; E],
        }
    }

    /// Variance of the position (m²) and heading (rad²) of the node that [`Drift::assign`] was given, as seen from `slot`.
    pub(super) fn of(&self, slot: Slot) -> (f32, f32) {
        self.variances
            .get(usize::from(slot))
            .copied()
            .unwrap_or(UNKNOWN)
    }

    /// Finds the paths from `start` whose variance is at most `most` (m²): Dijkstra's algorithm. Variances of the chain
    /// count `doubt` times.
    ///
    /// Errors along one path add up; that several paths know more than the best one is left out, so the variances are
    /// upper bounds. An error of heading moves the start by its distance from where the error is.
    pub(super) fn assign(&mut self, graph: &Graph<K, E>, start: Slot, most: f32, doubt: f32) {
        self.variances.fill(UNKNOWN);
        let Some(origin) = graph.pose(start) else {
            return;
        };
        self.link(graph);
        self.reach(start, (0.0, 0.0));
        let mut open: Vec<Slot, K> = Vec::new();
        let _ = open.push(start);
        while let Some((at, &slot)) = open
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| self.of(**a).0.total_cmp(&self.of(**b).0))
        {
            // The last one takes its place, unless it is the last one itself.
            if let Some(last) = open.pop()
                && let Some(entry) = open.get_mut(at)
            {
                *entry = last;
            }
            let (position, heading) = self.of(slot);
            let mut at = self.first.get(usize::from(slot)).copied().unwrap_or(NONE);
            while let Some((edge, next)) = graph.edges().get(usize::from(at)).zip(self.next(at)) {
                let [from, to] = next;
                at = if edge.from == slot { from } else { to };
                let Some(other) = edge.other(slot) else {
                    continue;
                };
                if edge.kind == Kind::Gap {
                    continue;
                }
                // What is reached from nearer needs no second look.
                if self.of(other).0 <= position {
                    continue;
                }
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
                    self.reach(other, reached);
                }
            }
        }
    }

    fn reach(&mut self, slot: Slot, variance: (f32, f32)) {
        if let Some(entry) = self.variances.get_mut(usize::from(slot)) {
            *entry = variance;
        }
    }

    fn next(&self, edge: u16) -> Option<[u16; 2]> {
        self.next.get(usize::from(edge)).copied()
    }

    /// Links each node's edges into a list.
    fn link(&mut self, graph: &Graph<K, E>) {
        self.first.fill(NONE);
        for ((number, edge), next) in (0..).zip(graph.edges()).zip(&mut self.next) {
            for (end, next) in [edge.from, edge.to].into_iter().zip(next) {
                if let Some(first) = self.first.get_mut(usize::from(end)) {
                    *next = core::mem::replace(first, number);
                }
            }
        }
    }
}
