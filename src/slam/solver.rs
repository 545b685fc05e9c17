//! Gauss–Newton over a pose graph: block L·D·Lᵀ with a minimum-degree ordering, in fixed memory and in slices.
//!
//! Each elimination takes the node with the fewest neighbours left (Tinney and Walker 1967; Markowitz 1957): on graphs of
//! robots driving through buildings the factor has 3 to 6 blocks a node. Blocks are linked into a list at each of their
//! two nodes, so the order needs no pass of its own and a block made by an elimination is one more entry.

mod blocks;
mod linear;

use self::blocks::{Blocks, NONE};
use crate::{
    geometry::Pose,
    math,
    slam::graph::{Graph, PHI, Slot},
};

/// Working memory for graphs of at most K nodes whose factor has at most L blocks: 44·K + 44·L bytes.
#[derive(Debug, Clone)]
pub struct Solver<const K: usize, const L: usize> {
    blocks: Blocks<K, L>,
    /// Nodes in the order of elimination.
    order: [Slot; K],
    phase: Phase,
    /// χ² up to which a loop counts in full.
    phi: f32,
    /// Gauss–Newton steps taken since [`Solver::start`].
    steps: u8,
}

/// What is to be done next.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Idle,
    /// From this edge on the sums are to be filled.
    Linearise(usize),
    /// So many nodes are eliminated.
    Eliminate(usize),
    /// So many nodes are still to be solved for.
    Substitute(usize),
}

/// How a slice of work ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress {
    /// There is more to do.
    Working,
    /// The graph is at its optimum; the longest last step of a node (m, a radian counted at 1 m).
    Solved(f32),
    /// The factor has more blocks than there is room for: fewer edges are needed.
    TooDense,
    /// Nothing was started.
    Idle,
}

/// Most Gauss–Newton steps: from dead reckoning six are enough (ALGORITHMS 10.2 measured it on two buildings).
const MAX_STEPS: u8 = 10;
/// Φ of the first step of a solution after new loops: 10 m where a match tells 2 cm.
const FIRST_PHI: f32 = 4096.0 * PHI;
/// A step this short (m, rad) is the last.
const SHORT: f32 = 1e-3;

impl<const K: usize, const L: usize> Solver<K, L> {
    /// Idle.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            blocks: Blocks::new(),
            order: [0; K],
            phase: Phase::Idle,
            phi: PHI,
            steps: 0,
        }
    }

    /// Begins a solution, in place of one under way.
    ///
    /// `anew`: loops were added that the poses contradict. They all count at first, so that right ones move the poses, and
    /// those that still contradict the others are let go step by step (graduated non-convexity).
    pub fn start(&mut self, anew: bool) {
        self.phase = Phase::Linearise(0);
        self.phi = if anew { FIRST_PHI } else { PHI };
        self.steps = 0;
    }

    /// Begins the present Gauss–Newton step anew where one is under way: the graph has changed.
    pub fn restart(&mut self) {
        if self.phase != Phase::Idle {
            self.phase = Phase::Linearise(0);
        }
    }

    /// Off-diagonal blocks of the last factor.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Works until `budget` is used up, in about 100 instructions of a Cortex-M4F each, and at least one piece of work.
    ///
    /// Nodes move only when a Gauss–Newton step is complete. The graph must not change between [`Solver::start`] and
    /// the end of the work: start anew where it did.
    pub fn step<const E: usize>(&mut self, graph: &mut Graph<K, E>, budget: &mut u32) -> Progress {
        loop {
            let spent = match self.phase {
                Phase::Idle => return Progress::Idle,
                Phase::Linearise(edge) => match self.linearise(graph, edge) {
                    Some(spent) => spent,
                    None => return self.too_dense(),
                },
                Phase::Eliminate(done) => match self.eliminate(done) {
                    Some(spent) => spent,
                    None => return self.too_dense(),
                },
                Phase::Substitute(0) => {
                    let longest = self.moved(graph);
                    self.steps += 1;
                    let last = self.phi <= PHI;
                    self.phi = math::max(self.phi / 8.0, PHI);
                    if (last && longest < SHORT) || self.steps >= MAX_STEPS {
                        self.phase = Phase::Idle;
                        return Progress::Solved(longest);
                    }
                    self.phase = Phase::Linearise(0);
                    3 * K as u32 / 2
                }
                Phase::Substitute(left) => self.substitute(left),
            };
            *budget = budget.saturating_sub(spent);
            if *budget == 0 {
                return Progress::Working;
            }
        }
    }

    fn too_dense(&mut self) -> Progress {
        self.phase = Phase::Idle;
        Progress::TooDense
    }

    /// Adds an edge to the normal equations.
    fn linearise<const E: usize>(&mut self, graph: &Graph<K, E>, edge: usize) -> Option<u32> {
        if edge == 0 {
            self.blocks.clear();
            // The oldest keyframe stays where it is.
            let oldest = graph.nodes().min_by_key(|(_, node)| node.id);
            for (slot, _) in graph.nodes() {
                if oldest.is_none_or(|(fixed, _)| fixed != slot) {
                    self.blocks.open(slot);
                }
            }
        }
        let Some(next) = graph.edges().get(edge) else {
            self.phase = Phase::Eliminate(0);
            return Some(1);
        };
        if let (Some(from), Some(to)) = (graph.pose(next.from), graph.pose(next.to)) {
            let part = linear::normal(next, from, to, self.phi);
            self.blocks
                .add_diagonal(next.from, &part.from, part.from_side);
            self.blocks.add_diagonal(next.to, &part.to, part.to_side);
            self.blocks.add(next.from, next.to, &part.between)?;
        }
        self.phase = Phase::Linearise(edge + 1);
        Some(11)
    }

    /// Eliminates the node with the fewest neighbours.
    fn eliminate(&mut self, done: usize) -> Option<u32> {
        let Some(slot) = self.blocks.sparsest() else {
            self.phase = Phase::Substitute(done);
            return Some(K as u32 / 10);
        };
        let spent = self.blocks.eliminate(slot)?;
        if let Some(entry) = self.order.get_mut(done) {
            *entry = slot;
        }
        self.phase = Phase::Eliminate(done + 1);
        Some(K as u32 / 10 + spent)
    }

    /// Solves for the node that was eliminated last of those left.
    fn substitute(&mut self, left: usize) -> u32 {
        let slot = self.order.get(left - 1).copied().unwrap_or(NONE);
        self.phase = Phase::Substitute(left - 1);
        self.blocks.substitute(slot)
    }

    /// Moves every node by its step; gives the longest (m, a radian counted at 1 m).
    fn moved<const E: usize>(&mut self, graph: &mut Graph<K, E>) -> f32 {
        /// A longer step (m) is none that a linear model tells anything about.
        const TOO_LONG: f32 = 1e3;
        let mut longest = 0.0;
        for slot in 0..K as Slot {
            let (Some(pose), Some([x, y, theta])) = (graph.pose(slot), self.blocks.step(slot))
            else {
                continue;
            };
            let length = math::abs(x) + math::abs(y) + math::abs(theta);
            if length < TOO_LONG {
                longest = math::max(longest, length);
                graph.set_pose(slot, pose * Pose::new(x, y, theta));
            }
        }
        longest
    }
}

impl<const K: usize, const L: usize> Default for Solver<K, L> {
    fn default() -> Self {
        Self::new()
    }
}
