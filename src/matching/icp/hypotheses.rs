//! Several starts that compete: what finds the pose when the guess is far off.

use crate::{
    geometry::Pose,
    matching::{
        MatchError,
        icp::{COARSE, Search, Stepped, Task, pass::FixedPose},
    },
};

/// A pose and what it is worth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub at: FixedPose,
    /// See [`super::score::Score::value`].
    pub value: f32,
}

/// What [`search`] settled on.
pub(super) struct Best {
    pub candidate: Candidate,
    /// The last pass.
    pub last: Stepped,
    pub iterations: u8,
}

/// A score that no wrong pose reached on the recorded pairs: no other start is tried.
const SURE: f32 = 0.7;
/// Turn between two starts: half of it is within reach of the coarse passes.
const TURN_STEP: f32 = 10.0 * core::f32::consts::PI / 180.0;
/// What a start loses per square metre between its end and the guess: a guess is worth something.
const LOCAL_PULL: f32 = 2.5;
const GLOBAL_PULL: f32 = 0.1;
/// Starts are ahead of the guess by these (m) in a global search.
const AHEAD: [f32; 3] = [0.0, 0.5, 1.0];

/// Finds the best candidate: from the guess alone if that is sure, else from turned and moved starts.
pub(super) fn search(task: &Task<'_>, observe: &mut impl FnMut(Pose)) -> Result<Best, MatchError> {
    let (turns, ahead, pull) = match task.config.search {
        Search::Local => (2, &AHEAD[..1], LOCAL_PULL),
        Search::Global => (6, &AHEAD[..], GLOBAL_PULL),
    };
    let from_guess = task.coarse(task.start, observe);
    let mut best = from_guess;
    let mut starts = 1u8;
    if !best.is_ok_and(|candidate| candidate.value >= SURE) {
        for turn in -turns..=turns {
            for &ahead in ahead {
                if turn == 0 && ahead == 0.0 {
                    continue;
                }
                let start = task.start.moved_far([ahead, 0.0, turn as f32 * TURN_STEP]);
                starts = starts.saturating_add(1);
                let Ok(found) = task.coarse(start, &mut |_| ()) else {
                    continue;
                };
                let worth = |c: &Candidate| c.value - pull * c.at.square_distance(task.start);
                if best.is_err() || best.is_ok_and(|b| worth(&b) < worth(&found)) {
                    best = Ok(found);
                }
            }
        }
    }
    let best = best?;
    let last = task.fine(best.at, observe)?;
    Ok(Best {
        candidate: task.judged(last.at),
        last,
        iterations: starts.saturating_mul(COARSE.len() as u8).saturating_add(2),
    })
}
