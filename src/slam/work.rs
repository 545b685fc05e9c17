//! What is done in the time between scans, in slices.

use heapless::Vec;

use super::{
    Slam,
    graph::{Kind, Slot},
    loops::{CANDIDATES, Candidate},
    solver::Progress,
};

/// What is being done.
#[derive(Debug, Clone)]
pub(super) enum Work {
    Idle,
    /// Earlier keyframes that may see the place of this one are to be found.
    Look(Slot),
    /// They are to be matched, the last one first.
    Meet(Slot, Vec<Candidate, CANDIDATES>),
    /// The graph is being solved.
    Solve,
    /// This keyframe is to be weighed; where room is wanted those after it too, and then the one worth least removed.
    Weigh(Slot),
}

/// Cost of the search for candidates, of a match from a good guess and from several, and of weighing a keyframe (hundreds
/// of instructions, estimated from the edges and points they touch; not measured so far).
const LOOK: u32 = 8_000;
const MEET: u32 = 10_000;
const MEET_LOOSE: u32 = 40_000;
const WEIGH: u32 = 3_500;
/// Keyframes looked at again between one new keyframe and the next.
const AGAIN: u16 = 4;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Works for about `budget` hundreds of a Cortex-M4F's instructions, and at least one piece: a match, a node of the
    /// factor. Whether there is more to do.
    ///
    /// Returns early where a keyframe was removed: see [`Slam::take_merged`].
    pub fn step(&mut self, budget: u32) -> bool {
        let mut budget = budget;
        while budget > 0 && self.merged.is_none() {
            match &mut self.work {
                Work::Idle => match self.next() {
                    Work::Idle => return false,
                    work => self.work = work,
                },
                Work::Look(slot) => {
                    let slot = *slot;
                    budget = budget.saturating_sub(LOOK);
                    self.work = Work::Meet(slot, self.candidates(slot));
                }
                Work::Meet(slot, candidates) => {
                    let (slot, candidate) = (*slot, candidates.pop());
                    let Some(candidate) = candidate.filter(|_| !self.has_loops(slot)) else {
                        self.work = Work::Idle;
                        continue;
                    };
                    let loose = self.meet(slot, &candidate);
                    budget = budget.saturating_sub(if loose { MEET_LOOSE } else { MEET });
                }
                Work::Solve => self.solve(&mut budget),
                Work::Weigh(slot) => {
                    let slot = *slot;
                    let unknown = self.is_worth_unknown(slot);
                    budget = budget.saturating_sub(if unknown { WEIGH } else { 1 });
                    self.work = if usize::from(slot) < K {
                        self.weigh(slot);
                        if self.wants_room() {
                            Work::Weigh(slot + 1)
                        } else {
                            Work::Idle
                        }
                    } else {
                        self.remove_least();
                        Work::Idle
                    };
                }
            }
        }
        true
    }

    /// What is to be done first.
    fn next(&mut self) -> Work {
        if let Some(slot) = self.fresh.pop_front() {
            return Work::Look(slot);
        }
        if core::mem::take(&mut self.changed) {
            self.solver.start(core::mem::take(&mut self.contradicted));
            return Work::Solve;
        }
        if self.graph.edges().len() + 2 * super::FRESH > E {
            self.thin();
        }
        if self.wants_room() {
            return Work::Weigh(0);
        }
        // Time is left: keyframes are weighed before room is needed.
        let unweighed = (0..K as Slot).find(|slot| self.is_worth_unknown(*slot));
        if let Some(slot) = unweighed.filter(|_| 2 * self.graph.len() > K) {
            return Work::Weigh(slot);
        }
        // And a keyframe may find loops that its first look did not, as the poses were not as good: a few between one new
        // keyframe and the next, as long as there is ample room. All in turn, so each is looked at again.
        let room = self.graph.edges().len() + 4 * super::FRESH < E;
        let mut passed = 0;
        while room && self.quiet < AGAIN && passed < K {
            passed += 1;
            self.again = if usize::from(self.again) + 1 < K {
                self.again + 1
            } else {
                0
            };
            if self.graph.node(self.again).is_some() {
                self.quiet += 1;
                return Work::Look(self.again);
            }
        }
        Work::Idle
    }

    fn solve(&mut self, budget: &mut u32) {
        match self.solver.step(&mut self.graph, budget) {
            Progress::Working => {}
            Progress::TooDense => {
                // More loops would only push out others.
                self.quiet = AGAIN;
                if self.thin() {
                    self.solver.start(true);
                } else {
                    self.work = Work::Idle;
                }
            }
            Progress::Solved(_) | Progress::Idle => {
                self.counters.solved = self.counters.solved.wrapping_add(1);
                self.work = Work::Idle;
            }
        }
    }

    /// Whether a keyframe has as many loops as are wanted.
    fn has_loops(&self, slot: Slot) -> bool {
        let loops = self
            .graph
            .edges_at(slot)
            .filter(|edge| edge.kind == Kind::Loop);
        loops.count() >= usize::from(self.config.max_loops)
    }
}
