//! Keyframes as nodes of a pose graph, and the measured motions between them as its edges, in fixed memory.
//!
//! Lu and Milios, Autonomous Robots 1997; Grisetti et al., *A tutorial on graph-based SLAM*, 2010.

use heapless::Vec;

use crate::{
    geometry::Pose,
    linalg::{Information, Sym3},
    math,
};

/// Place of a node in the graph's memory: it is given to another keyframe once this one is removed.
pub type Slot = u16;

/// A keyframe's pose. 20 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// The lidar in the map.
    pub pose: Pose,
    /// Number of the keyframe since the start, never given twice.
    pub id: u32,
    /// Number of the submap: poses of two submaps say nothing about each other.
    pub submap: u8,
    /// Whether the slot is in use.
    pub used: bool,
}

/// Where an edge comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// From one keyframe to the next, by odometry, or what pruning made of such edges: always believed.
    Chain,
    /// By a match of two visits: doubted where it contradicts the others (see [`Edge::weight`]).
    Loop,
    /// From one submap to the next: the robot was carried, and nothing is known but that there is a next one.
    Gap,
}

/// A measured motion of the lidar from one node to another. 44 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// The node from whose pose the motion starts.
    pub from: Slot,
    /// The node to whose pose it leads.
    pub to: Slot,
    /// Where it comes from.
    pub kind: Kind,
    /// Pose of `to` in the frame of `from`.
    pub motion: Pose,
    /// Information about `motion`, position in the frame of `from`.
    pub information: Information,
}

/// Φ of dynamic covariance scaling: a loop counts in full up to this χ². Agarwal et al., ICRA 2013, take 1 to 10.
pub const PHI: f32 = 5.0;

impl Edge {
    /// Difference between the motion by the poses of both ends and the measured one (m, m, rad).
    #[must_use]
    pub fn error(&self, from: Pose, to: Pose) -> [f32; 3] {
        let seen = from.between(to);
        [
            seen.x - self.motion.x,
            seen.y - self.motion.y,
            math::wrap_angle(seen.theta - self.motion.theta),
        ]
    }

    /// Factor on the information at an error: 1 but for loops; for these dynamic covariance scaling, so that a
    /// loop which contradicts all others counts for little. `phi` is the χ² up to which it counts in full.
    #[must_use]
    pub fn weight(&self, error: [f32; 3], phi: f32) -> f32 {
        if self.kind != Kind::Loop {
            return 1.0;
        }
        let scale = math::min(1.0, 2.0 * phi / (phi + self.information.0.quadratic(error)));
        scale * scale
    }

    /// Variances of position (m², the mean of both directions) and heading (rad²).
    #[must_use]
    pub fn variances(&self) -> (f32, f32) {
        /// Where a direction is not determined at all: 10 m, 10 rad.
        const UNKNOWN: (f32, f32) = (100.0, 100.0);
        self.information.covariance().map_or(UNKNOWN, |covariance| {
            let Sym3 { xx, yy, tt, .. } = covariance.0;
            (0.5 * (xx + yy), tt)
        })
    }

    /// The other end of the edge than `slot`; `None` if that is no end.
    #[must_use]
    pub fn other(&self, slot: Slot) -> Option<Slot> {
        if self.from == slot {
            Some(self.to)
        } else {
            (self.to == slot).then_some(self.from)
        }
    }
}

/// At most K keyframes and E edges: 20·K + 44·E bytes.
#[derive(Debug, Clone)]
pub struct Graph<const K: usize, const E: usize> {
    nodes: [Node; K],
    edges: Vec<Edge, E>,
    used: u16,
    next_id: u32,
}

impl<const K: usize, const E: usize> Graph<K, E> {
    /// No nodes.
    #[must_use]
    pub const fn new() -> Self {
        const FREE: Node = Node {
            pose: Pose::IDENTITY,
            id: 0,
            submap: 0,
            used: false,
        };
        Self {
            nodes: [FREE; K],
            edges: Vec::new(),
            used: 0,
            next_id: 0,
        }
    }

    /// Number of nodes.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.used as usize
    }

    /// Whether there is no node.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.used == 0
    }

    /// Whether no further node finds room.
    #[must_use]
    pub const fn is_full(&self) -> bool {
        self.used as usize >= K
    }

    /// Nodes with their slots.
    pub fn nodes(&self) -> impl Iterator<Item = (Slot, &Node)> + Clone {
        (0..).zip(&self.nodes).filter(|(_, node)| node.used)
    }

    /// The node in a slot, if there is one.
    #[must_use]
    pub fn node(&self, slot: Slot) -> Option<&Node> {
        self.nodes.get(usize::from(slot)).filter(|node| node.used)
    }

    /// The pose of the node in a slot, if there is one.
    #[must_use]
    pub fn pose(&self, slot: Slot) -> Option<Pose> {
        self.node(slot).map(|node| node.pose)
    }

    /// Moves a node; nothing happens where there is none.
    pub fn set_pose(&mut self, slot: Slot, pose: Pose) {
        if let Some(node) = self.nodes.get_mut(usize::from(slot)) {
            node.pose = pose;
        }
    }

    /// Moves all nodes of a submap into another one, `motion` being the pose of the former's frame in the latter's.
    ///
    /// Edges between the two told nothing that is still true: they tell now what the poses do.
    pub fn unite(&mut self, from: u8, into: u8, motion: Pose) {
        for node in self.nodes.iter_mut().filter(|node| node.used) {
            if node.submap == from {
                (node.submap, node.pose) = (into, motion * node.pose);
            }
        }
        let nodes = &self.nodes;
        let pose = |slot: Slot| nodes.get(usize::from(slot)).map(|node| node.pose);
        for edge in self.edges.iter_mut().filter(|edge| edge.kind == Kind::Gap) {
            if let Some((from, to)) = pose(edge.from).zip(pose(edge.to)) {
                edge.motion = from.between(to);
            }
        }
    }

    /// Whether two nodes are in one submap.
    #[must_use]
    pub fn are_in_one(&self, a: Slot, b: Slot) -> bool {
        let submap = |slot| self.node(slot).map(|node| node.submap);
        submap(a).is_some() && submap(a) == submap(b)
    }

    /// The edges in no particular order.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Edges at a node.
    pub fn edges_at(&self, slot: Slot) -> impl Iterator<Item = &Edge> + Clone {
        self.edges
            .iter()
            .filter(move |edge| edge.from == slot || edge.to == slot)
    }

    /// Whether an edge joins two nodes, in either direction.
    #[must_use]
    pub fn are_joined(&self, a: Slot, b: Slot) -> bool {
        self.edges_at(a).any(|edge| edge.other(a) == Some(b))
    }

    /// Adds a node to a submap; `None` where there is no room or the pose is not finite.
    pub fn add(&mut self, pose: Pose, submap: u8) -> Option<Slot> {
        if !pose.is_finite() {
            return None;
        }
        let (slot, free) = (0..).zip(&mut self.nodes).find(|(_, node)| !node.used)?;
        *free = Node {
            pose,
            id: self.next_id,
            submap,
            used: true,
        };
        self.used += 1;
        self.next_id = self.next_id.wrapping_add(1);
        Some(slot)
    }

    /// Number of the next node.
    #[cfg(feature = "embedded-storage")]
    pub(super) const fn next_id(&self) -> u32 {
        self.next_id
    }

    /// Puts a node where none is; whether that is a place.
    #[cfg(feature = "embedded-storage")]
    pub(super) fn put(&mut self, slot: Slot, node: Node) -> bool {
        match self.nodes.get_mut(usize::from(slot)) {
            Some(free) if !free.used => {
                *free = node;
                self.used += 1;
                true
            }
            _ => false,
        }
    }

    /// Sets the number of the next node.
    #[cfg(feature = "embedded-storage")]
    pub(super) const fn set_next_id(&mut self, next_id: u32) {
        self.next_id = next_id;
    }

    /// The submap of the oldest node.
    #[must_use]
    pub fn oldest_submap(&self) -> Option<u8> {
        let oldest = self.nodes().min_by_key(|(_, node)| node.id);
        oldest.map(|(_, node)| node.submap)
    }

    /// A number that no submap has; `None` where all 256 are taken.
    #[must_use]
    pub fn free_submap(&self) -> Option<u8> {
        (0..=u8::MAX).find(|submap| self.nodes().all(|(_, node)| node.submap != *submap))
    }

    /// Adds an edge between two nodes; gives it back where there is no room, or it is none: from a node to itself, to a
    /// slot without a node, with a number that is not finite.
    ///
    /// # Errors
    /// The edge itself.
    pub fn join(&mut self, edge: Edge) -> Result<(), Edge> {
        let known = self.node(edge.from).is_some() && self.node(edge.to).is_some();
        let [x, y, t] = edge.information.0.times([1.0, 1.0, 1.0]);
        let finite = edge.motion.is_finite() && (x + y + t).is_finite();
        if !known || !finite || edge.from == edge.to {
            return Err(edge);
        }
        self.edges.push(edge)
    }

    /// Whether no further edge finds room.
    #[must_use]
    pub fn edges_are_full(&self) -> bool {
        self.edges.is_full()
    }

    /// Removes a node with all its edges.
    pub fn remove(&mut self, slot: Slot) {
        if self.node(slot).is_none() {
            return;
        }
        self.retain_edges(|edge| edge.from != slot && edge.to != slot);
        if let Some(node) = self.nodes.get_mut(usize::from(slot)) {
            node.used = false;
            self.used = self.used.saturating_sub(1);
        }
    }

    /// Removes the edges for which `keep` is false.
    pub fn retain_edges(&mut self, keep: impl FnMut(&Edge) -> bool) {
        self.edges.retain(keep);
    }

    /// Sum over all edges of the squared error in units of what each told, robust weights taken.
    #[must_use]
    pub fn chi_squared(&self) -> f32 {
        let term = |edge: &Edge| {
            let (from, to) = (self.pose(edge.from)?, self.pose(edge.to)?);
            let error = edge.error(from, to);
            Some(edge.weight(error, PHI) * edge.information.0.quadratic(error))
        };
        self.edges.iter().filter_map(term).sum()
    }
}

impl<const K: usize, const E: usize> Default for Graph<K, E> {
    fn default() -> Self {
        Self::new()
    }
}
