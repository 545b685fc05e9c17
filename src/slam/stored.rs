//! A map as bytes: keyframes and edges, little endian.
//!
//! | bytes | of a keyframe | | bytes | of an edge |
//! | --- | --- | --- | --- | --- |
//! | 2, 2, 4 | slot, submap, number | | 2, 2 | slots it leads from and to |
//! | 12 | pose (3 × `f32`) | | 2 | 0: by odometry, 1: a loop, 2: a gap |
//! | 6 | first bearing, span, step of the range | | 12 | motion (3 × `f32`) |
//! | 2·B | directions | | 24 | information (6 × `f32`) |

use super::{
    Slam,
    graph::{Edge, Graph, Kind, Node, Slot},
    pruning,
    store::PackedScan,
};
use crate::{
    geometry::Pose,
    linalg::{Information, Sym3},
};

/// Takes bytes in order.
pub(super) trait Write {
    /// Why they cannot be taken.
    type Error;
    fn put(&mut self, bytes: &[u8]) -> Result<(), Self::Error>;
}

/// Gives bytes in order.
pub(super) trait Read {
    /// Why they cannot be given.
    type Error;
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Self::Error>;
}

/// Counts that stand before the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Counts {
    pub nodes: u16,
    pub edges: u16,
    /// Number of the next keyframe.
    pub next_id: u32,
}

impl Counts {
    /// Bytes of a map with B directions in a keyframe.
    pub(super) const fn bytes(self, directions: usize) -> u32 {
        self.nodes as u32 * (26 + 2 * directions as u32) + self.edges as u32 * 42
    }
}

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    pub(super) fn counts(&self) -> Counts {
        Counts {
            nodes: self.graph.len() as u16,
            edges: self.graph.edges().len() as u16,
            next_id: self.graph.next_id(),
        }
    }

    /// Writes keyframes and edges.
    pub(super) fn write<W: Write>(&self, to: &mut W) -> Result<(), W::Error> {
        for (slot, node) in self.graph.nodes() {
            to.put(&slot.to_le_bytes())?;
            to.put(&u16::from(node.submap).to_le_bytes())?;
            to.put(&node.id.to_le_bytes())?;
            put_pose(to, node.pose)?;
            let scan = self.scans.get(usize::from(slot));
            for word in scan.unwrap_or(&PackedScan::EMPTY).words() {
                to.put(&word.to_le_bytes())?;
            }
        }
        for edge in self.graph.edges() {
            let kind = match edge.kind {
                Kind::Chain => 0,
                Kind::Loop => 1,
                Kind::Gap => 2,
            };
            for word in [edge.from, edge.to, kind] {
                to.put(&word.to_le_bytes())?;
            }
            put_pose(to, edge.motion)?;
            let Sym3 {
                xx,
                xy,
                xt,
                yy,
                yt,
                tt,
            } = edge.information.0;
            for value in [xx, xy, xt, yy, yt, tt] {
                to.put(&value.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// Reads keyframes and edges in place of those there are; whether they are ones. Where not, nothing is left.
    pub(super) fn read<R: Read>(&mut self, counts: Counts, from: &mut R) -> Result<bool, R::Error> {
        self.graph = Graph::new();
        self.worth = [pruning::UNWEIGHED; K];
        let whole = self.read_all(counts, from)?;
        if !whole {
            self.graph = Graph::new();
        }
        Ok(whole)
    }

    fn read_all<R: Read>(&mut self, counts: Counts, from: &mut R) -> Result<bool, R::Error> {
        for _ in 0..counts.nodes {
            let slot = Slot::from_le_bytes(from.take()?);
            let submap = u16::from_le_bytes(from.take()?) as u8;
            let id = u32::from_le_bytes(from.take()?);
            let pose = take_pose(from)?;
            let node = Node {
                pose,
                id,
                submap,
                used: true,
            };
            if !pose.is_finite() || !self.graph.put(slot, node) {
                return Ok(false);
            }
            let mut scan = PackedScan::EMPTY;
            for word in scan.words_mut() {
                *word = u16::from_le_bytes(from.take()?);
            }
            if let Some(entry) = self.scans.get_mut(usize::from(slot)) {
                *entry = scan;
            }
        }
        self.graph.set_next_id(counts.next_id);
        for _ in 0..counts.edges {
            let [from_slot, to, kind] = [from.take()?, from.take()?, from.take()?];
            let kind = match u16::from_le_bytes(kind) {
                0 => Kind::Chain,
                1 => Kind::Loop,
                _ => Kind::Gap,
            };
            let motion = take_pose(from)?;
            let mut values = [0.0; 6];
            for value in &mut values {
                *value = f32::from_le_bytes(from.take()?);
            }
            let [xx, xy, xt, yy, yt, tt] = values;
            let edge = Edge {
                from: Slot::from_le_bytes(from_slot),
                to: Slot::from_le_bytes(to),
                kind,
                motion,
                information: Information(Sym3 {
                    xx,
                    xy,
                    xt,
                    yy,
                    yt,
                    tt,
                }),
            };
            if self.graph.join(edge).is_err() {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

fn put_pose<W: Write>(to: &mut W, pose: Pose) -> Result<(), W::Error> {
    [pose.x, pose.y, pose.theta]
        .iter()
        .try_for_each(|value| to.put(&value.to_le_bytes()))
}

fn take_pose<R: Read>(from: &mut R) -> Result<Pose, R::Error> {
    Ok(Pose {
        x: f32::from_le_bytes(from.take()?),
        y: f32::from_le_bytes(from.take()?),
        theta: f32::from_le_bytes(from.take()?),
    })
}
