//! What SLAM is at between scans: a task that is kept from one slice of time to the next.

use heapless::Vec;

use super::{
    graph::Slot,
    loops::{CANDIDATES, Candidate},
};

/// What is being done.
#[derive(Debug, Clone)]
pub(super) enum Work {
    Idle,
    /// Earlier keyframes that may see the place of this one are to be found.
    Look(Slot),
    /// They are to be matched.
    Meet(Meeting),
    /// Keyframes of other submaps that look alike are to be found.
    Recognize(Recognition),
    /// The graph is being solved.
    Solve,
    /// This keyframe is to be weighed.
    Weigh(Slot),
    /// The keyframe worth least is to be removed, once it is the one that was weighed last.
    Clear(Option<Slot>),
}

impl Work {
    /// A keyframe is to be matched with these, the likeliest last.
    pub(super) const fn meet(slot: Slot, candidates: Vec<Candidate, CANDIDATES>) -> Self {
        Self::Meet(Meeting {
            slot,
            candidates,
            attempt: 0,
            is_shown: false,
        })
    }
}

/// A search for the place of a keyframe among those of other submaps.
#[derive(Debug, Clone)]
pub(super) struct Recognition {
    /// The keyframe.
    pub slot: Slot,
    /// The next slot to be compared.
    pub next: Slot,
    /// The likeliest so far, best first: difference, slot, rotation.
    pub best: Vec<(u32, Slot, u8), CANDIDATES>,
}

/// A keyframe that is matched with earlier ones.
#[derive(Debug, Clone)]
pub(super) struct Meeting {
    pub slot: Slot,
    /// The likeliest last.
    pub candidates: Vec<Candidate, CANDIDATES>,
    /// Guesses for the last candidate that led nowhere.
    pub attempt: u8,
    /// What is seen around it was made the reference.
    pub is_shown: bool,
}
