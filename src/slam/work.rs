//! What is done in the time between scans, in slices.

use super::{
    FRESH, Slam,
    graph::{Kind, Slot},
    solver::Progress,
    task::{Meeting, Work},
};

/// Costs of the pieces of work in hundreds of instructions of a Cortex-M4F, for the tier of 192 KB, as measured on a
/// recorded log: about what nine in ten cost. A match that searches is the largest.
mod cost {
    /// Looking for keyframes that may see the same place.
    pub const LOOK: u32 = 2_500;
    /// Showing a keyframe in the virtual scan.
    pub const SHOW: u32 = 10_000;
    /// Comparing the outlines of some keyframes.
    pub const RECOGNIZE: u32 = 6_000;
    /// Matching against what is seen there.
    pub const MEET: u32 = 6_000;
    /// Matching where the guess may be far off.
    pub const MEET_LOOSE: u32 = 25_000;
    /// Weighing a keyframe.
    pub const WEIGH: u32 = 7_000;
}
/// Keyframes looked at again between one new keyframe and the next.
const AGAIN: u16 = 4;

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Works for about `budget` hundreds of a Cortex-M4F's instructions, and at least one piece: a match, a node of the
    /// factor. A piece that costs more than what is left is kept for the next call. Whether there is more to do.
    ///
    /// Returns early where a keyframe was removed: see [`Slam::take_merged`].
    pub fn step(&mut self, budget: u32) -> bool {
        let mut left = budget;
        while left > 0 && self.merged.is_none() {
            let cost = self.cost();
            if cost > left && left < budget {
                break;
            }
            left = left.saturating_sub(cost);
            self.work = match core::mem::replace(&mut self.work, Work::Idle) {
                Work::Idle => match self.next() {
                    Work::Idle => return false,
                    work => work,
                },
                Work::Look(slot) => Work::meet(slot, self.candidates(slot)),
                Work::Recognize(search) => self.recognize(search),
                Work::Meet(meeting) => self.go_on(meeting),
                Work::Solve => self.solve(&mut left),
                Work::Weigh(slot) => {
                    self.weigh(slot);
                    Work::Idle
                }
                Work::Clear(weighed) => self.clear(weighed),
            };
        }
        true
    }

    /// What the next piece of work costs; solving counts by itself.
    fn cost(&self) -> u32 {
        match &self.work {
            Work::Idle | Work::Solve => 1,
            Work::Look(_) => cost::LOOK,
            Work::Recognize(_) => cost::RECOGNIZE,
            Work::Meet(meeting) => match meeting.candidates.last() {
                Some(_) if !meeting.is_shown => cost::SHOW,
                Some(candidate) if candidate.is_loose() => cost::MEET_LOOSE,
                Some(_) => cost::MEET,
                None => 1,
            },
            Work::Weigh(_) | Work::Clear(_) => cost::WEIGH,
        }
    }

    /// Weighs the keyframe that seems worth least, or removes it if it is the one that was weighed last.
    fn clear(&mut self, weighed: Option<Slot>) -> Work {
        match self.least() {
            None => {
                self.stuck = true;
                Work::Idle
            }
            Some(slot) if weighed == Some(slot) => {
                self.make_room(slot);
                Work::Idle
            }
            Some(slot) => {
                self.weigh(slot);
                Work::Clear(Some(slot))
            }
        }
    }

    /// The next piece of a meeting.
    fn go_on(&mut self, mut meeting: Meeting) -> Work {
        let Some(candidate) = meeting.candidates.last().copied() else {
            self.join(meeting.slot);
            return Work::Idle;
        };
        if !candidate.is_anywhere() && self.has_loops(meeting.slot) {
            return Work::Idle;
        }
        let Some(guess) = candidate.guess(meeting.attempt) else {
            meeting.candidates.pop();
            (meeting.attempt, meeting.is_shown) = (0, false);
            return Work::Meet(meeting);
        };
        if !meeting.is_shown {
            self.show(meeting.slot, candidate.slot, guess);
        } else if self.meet(meeting.slot, &candidate, guess) {
            meeting.candidates.pop();
            meeting.attempt = 0;
        } else {
            meeting.attempt += 1;
        }
        meeting.is_shown = !meeting.is_shown;
        Work::Meet(meeting)
    }

    /// What is to be done first.
    fn next(&mut self) -> Work {
        if self.wants_room() {
            return match self.unweighed() {
                Some(slot) => Work::Weigh(slot),
                None => Work::Clear(None),
            };
        }
        // New keyframes are searched for first, unless many wait: then the graph would never be solved, what it tells of their
        // places would stay uncertain, and an uncertain place is a long search.
        let many_wait = self.fresh.len() > FRESH / 2;
        if !(self.changed && many_wait)
            && let Some(slot) = self.fresh.pop_front()
        {
            return Work::Look(slot);
        }
        if core::mem::take(&mut self.changed) {
            self.solver.start(core::mem::take(&mut self.contradicted));
            return Work::Solve;
        }
        if let Some(search) = self.recognition() {
            return Work::Recognize(search);
        }
        if self.graph.edges().len() + 2 * FRESH > E {
            self.thin();
        }
        // Time is left: keyframes are weighed before room is needed.
        if 2 * self.graph.len() > K
            && let Some(slot) = self.unweighed()
        {
            return Work::Weigh(slot);
        }
        // And a keyframe may find loops that its first look did not, as the poses were not as good: a few between one new
        // keyframe and the next, as long as there is ample room. All in turn, so each is looked at again.
        let room = self.graph.edges().len() + 4 * FRESH < E;
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

    fn solve(&mut self, budget: &mut u32) -> Work {
        match self.solver.step(&mut self.graph, budget) {
            Progress::Working => Work::Solve,
            Progress::TooDense => {
                // More loops would only push out others.
                self.quiet = AGAIN;
                if self.thin() {
                    self.solver.start(true);
                    Work::Solve
                } else {
                    Work::Idle
                }
            }
            Progress::Solved(_) | Progress::Idle => {
                self.counters.solved = self.counters.solved.wrapping_add(1);
                Work::Idle
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
