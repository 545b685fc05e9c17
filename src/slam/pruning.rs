//! Which keyframe tells least about the map, and how the graph does without it.
//!
//! Kretzschmar and Stachniss, *Information-theoretic compression of pose graphs for laser-based SLAM*, IJRR 2012: the scan
//! with the least expected information about the map goes, and its node is marginalised into a tree (Chow and Liu 1968)
//! instead of a clique, so that the graph stays sparse for ever.

use super::graph::{Edge, Graph, Kind, PHI, Slot};
use crate::{geometry::Pose, linalg::Information, scan::ScanPoint};

/// Worth of a keyframe that is to be weighed.
pub(super) const UNWEIGHED: u16 = u16::MAX;

/// What is left of a keyframe that was removed: scans placed in its frame are to be placed in another's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Merged {
    /// Number of the keyframe that is gone.
    pub gone: u32,
    /// Number of the one that takes its scans over.
    pub into: u32,
    /// The former's pose in the latter's frame.
    pub motion: Pose,
}

/// Entropy (256ths of a bit) that one more hit takes from a cell that other keyframes hit 0, 1, 2 … times: `H(n·l) −
/// H((n + 1)·l)` with the log-odds `l` of a hit that is right nine times in ten.
const GAIN: [u16; 4] = [136, 95, 21, 3];

/// A surface that another keyframe saw this near (mm) is the same: a map's cell.
const SAME: u32 = 100;

/// Expected information of a scan about the map (256ths of a bit), by how many other keyframes saw what each beam met.
pub(super) fn information(seen: &[u8]) -> u32 {
    let gain = |&times: &u8| u32::from(GAIN.get(usize::from(times)).copied().unwrap_or(0));
    seen.iter().map(gain).sum()
}

/// Counts for each point whether another keyframe saw its surface; `range` is what that one shows in a direction (mm).
pub(super) fn count(
    seen: &mut [u8],
    points: &[ScanPoint],
    range: impl Fn(&ScanPoint) -> Option<u32>,
) {
    for (count, point) in seen.iter_mut().zip(points) {
        if range(point).is_some_and(|range| range.abs_diff(u32::from(point.range)) < SAME) {
            *count = count.saturating_add(1);
        }
    }
}

/// Removes a node, its edges merged into a tree around the neighbour that it was tied to best.
///
/// For a star of edges the two neighbours that tell most about each other are always the best tied one and another: the
/// tree of Chow and Liu is the star around it. Each of its edges has the motion by the present poses and the sum of both
/// covariances. Loops that the graph does not believe any more are left out.
/// `None`, and nothing done, for a node without neighbours.
pub(super) fn merge<const K: usize, const E: usize>(
    graph: &mut Graph<K, E>,
    slot: Slot,
) -> Option<Merged> {
    /// A loop that counts for less is taken for wrong.
    const BELIEVED: f32 = 0.25;
    let node = *graph.node(slot)?;
    let believed = |graph: &Graph<K, E>, edge: &Edge| {
        let (Some(from), Some(to)) = (graph.pose(edge.from), graph.pose(edge.to)) else {
            return false;
        };
        edge.weight(edge.error(from, to), PHI) >= BELIEVED
    };
    let tightness = |edge: &Edge| {
        let (position, heading) = edge.variances();
        position + heading
    };
    let best = graph
        .edges_at(slot)
        .filter(|edge| edge.kind != Kind::Gap && believed(graph, edge))
        .min_by(|a, b| tightness(a).total_cmp(&tightness(b)))
        .copied()?;
    let hub = best.other(slot)?;
    let hub_pose = graph.pose(hub)?;
    // The node as seen from the hub.
    let to_node = if best.to == slot {
        best
    } else {
        reversed(&best)?
    };
    let from_hub = hub_pose.between(node.pose);
    // One edge at a time is taken off, and its merged form put in its place: the number never rises.
    loop {
        let mut others = graph
            .edges_at(slot)
            .filter(|edge| edge.other(slot) != Some(hub));
        let Some(edge) = others.next().copied() else {
            break;
        };
        drop(others);
        let keep = believed(graph, &edge);
        let mut taken = false;
        graph.retain_edges(|other| {
            taken || *other != edge || {
                taken = true;
                false
            }
        });
        if !keep {
            continue;
        }
        let Some(other) = edge.other(slot) else {
            continue;
        };
        let outwards = if edge.from == slot {
            Some(edge)
        } else {
            reversed(&edge)
        };
        let (Some(outwards), Some(pose)) = (outwards, graph.pose(other)) else {
            continue;
        };
        let motion = hub_pose.between(pose);
        let covariance = to_node
            .information
            .covariance()
            .zip(outwards.information.covariance());
        let information = covariance.and_then(|(near, far)| {
            near.transported(motion.x - from_hub.x, motion.y - from_hub.y)
                .plus(&far.rotated(from_hub))
                .information()
        });
        let Some(information) = information else {
            continue;
        };
        let kind = match best.kind {
            Kind::Loop if edge.kind != Kind::Gap => Kind::Loop,
            _ => edge.kind,
        };
        put(
            graph,
            Edge {
                from: hub,
                to: other,
                kind,
                motion,
                information,
            },
        );
    }
    let into = graph.node(hub)?.id;
    graph.remove(slot);
    Some(Merged {
        gone: node.id,
        into,
        motion: from_hub,
    })
}

/// The same motion from the other end: position in the frame of the node that was the end.
fn reversed(edge: &Edge) -> Option<Edge> {
    let covariance = edge.information.covariance()?;
    let motion = edge.motion.inverse();
    let back = covariance
        .transported(-edge.motion.x, -edge.motion.y)
        .rotated(motion);
    Some(Edge {
        from: edge.to,
        to: edge.from,
        kind: edge.kind,
        motion,
        information: back.information()?,
    })
}

/// Adds an edge, or its information to the one that joins the same nodes.
fn put<const K: usize, const E: usize>(graph: &mut Graph<K, E>, edge: Edge) {
    let same = graph
        .edges_at(edge.from)
        .find(|other| other.other(edge.from) == Some(edge.to))
        .copied();
    let Some(same) = same else {
        // It takes the place of one that was removed.
        let _ = graph.join(edge);
        return;
    };
    let aligned = if same.from == edge.from {
        Some(same)
    } else {
        reversed(&same)
    };
    let Some(fused) = aligned.and_then(|other| fused(&other, &edge)) else {
        return;
    };
    graph.retain_edges(|other| *other != same);
    let _ = graph.join(fused);
}

/// Two measurements of one motion as one.
fn fused(a: &Edge, b: &Edge) -> Option<Edge> {
    let sum = a.information.0.plus(&b.information.0);
    let off = [
        b.motion.x - a.motion.x,
        b.motion.y - a.motion.y,
        crate::math::wrap_angle(b.motion.theta - a.motion.theta),
    ];
    let [x, y, theta] = sum.solve(b.information.0.times(off))?;
    let motion = Pose::new(a.motion.x + x, a.motion.y + y, a.motion.theta + theta);
    let kind = match (a.kind, b.kind) {
        (Kind::Chain, _) | (_, Kind::Gap) => a.kind,
        _ => b.kind,
    };
    Some(Edge {
        kind,
        motion,
        information: Information(sum),
        ..*a
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{Covariance, Sym3};

    fn edge(from: Slot, to: Slot, motion: Pose, sigma: f32) -> Edge {
        let weight = 1.0 / (sigma * sigma);
        Edge {
            from,
            to,
            kind: Kind::Chain,
            motion,
            information: Information(Sym3::diagonal(weight, weight, 4.0 * weight)),
        }
    }

    #[test]
    fn an_edge_reversed_twice_is_itself() {
        let there = edge(0, 1, Pose::new(1.0, 0.5, 0.7), 0.02);
        let again = reversed(&there)
            .and_then(|back| reversed(&back))
            .expect("reversed");
        let gap = there.motion.between(again.motion);
        assert!(gap.distance() < 1e-5 && gap.theta.abs() < 1e-5, "{again:?}");
        let (a, b) = (there.information.0, again.information.0);
        for (a, b) in [(a.xx, b.xx), (a.yy, b.yy), (a.tt, b.tt)] {
            // Two inversions in single precision.
            assert!((a - b).abs() < 1e-3 * a, "{there:?} {again:?}");
        }
    }

    #[test]
    fn a_node_of_a_chain_leaves_one_edge_that_knows_as_much() {
        let mut graph = Graph::<4, 4>::new();
        let step = Pose::new(1.0, 0.0, 0.5);
        let mut pose = Pose::IDENTITY;
        for _ in 0..3 {
            graph.add(pose, 0).expect("room");
            pose = pose * step;
        }
        graph.join(edge(0, 1, step, 0.01)).expect("room");
        graph.join(edge(1, 2, step, 0.02)).expect("room");
        let merged = merge(&mut graph, 1).expect("neighbours");
        assert_eq!((merged.gone, merged.into), (1, 0));
        assert_eq!((graph.len(), graph.edges().len()), (2, 1));
        let [left] = graph.edges() else {
            panic!("one edge")
        };
        let gap = left.motion.between(step * step);
        assert!(gap.distance() < 1e-5, "{left:?}");
        let Covariance(told) = left.information.covariance().expect("definite");
        // Headings add; and the first one's carries the second step of 1 m.
        let heading = 0.005_f32 * 0.005 + 0.01 * 0.01;
        assert!((told.tt - heading).abs() < 1e-3 * heading, "{told:?}");
        let least = 0.01_f32 * 0.01 + 0.02_f32 * 0.02;
        assert!(
            told.xx >= 0.99 * least && told.xx + told.yy < 2.2 * least,
            "{told:?}"
        );
    }
}
