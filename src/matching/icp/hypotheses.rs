//! Several starts that compete: what finds the pose when the guess is far off.

use crate::{
    geometry::Pose,
    matching::{
        MatchError,
        icp::{Search, Stepped, Task, pass::FixedPose},
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
    /// Starts tried.
    pub starts: u8,
}

/// A score at which the guess alone is believed, and one at which the starts next to it are.
const SURE: f32 = 0.7;
const LIKELY: f32 = 0.5;
/// What a start loses per square metre between its end and the guess: a guess is worth something.
const NEAR_PULL: f32 = 2.5;
const FAR_PULL: f32 = 0.5;
const GLOBAL_PULL: f32 = 0.1;
/// Starts of a global search are ahead of the guess by these (m): robots drive forward.
const AHEAD: [f32; 3] = [0.0, 0.5, 1.0];

/// Starts around the guess. A start that is turned by 5 to 8 degrees too much or too little still finds the pose.
struct Ring {
    /// Turned to both sides by these (degrees).
    turns: &'static [i8],
    /// Moved ahead by these (m).
    ahead: &'static [f32],
    /// See [`NEAR_PULL`].
    pull: f32,
}

const NEAR: Ring = Ring {
    turns: &[10, 20],
    ahead: &[0.0],
    pull: NEAR_PULL,
};
const FAR: Ring = Ring {
    turns: &[5, 15, 30, 40, 50],
    ahead: &[0.0],
    pull: FAR_PULL,
};
const GLOBAL: Ring = Ring {
    turns: &[0, 10, 20, 30, 40, 50, 60],
    ahead: &AHEAD,
    pull: GLOBAL_PULL,
};

/// Finds the best candidate: from the guess alone if that is sure, else from turned and moved starts.
pub(super) fn search(task: &Task<'_>, observe: &mut impl FnMut(Pose)) -> Result<Best, MatchError> {
    let mut best = task.coarse(task.start, observe);
    let mut starts = 1u8;
    let below =
        |limit: f32, best: &Result<Candidate, MatchError>| !best.is_ok_and(|b| b.value >= limit);
    match task.config.search {
        Search::Local => {
            if below(SURE, &best) {
                best = around(task, best, &NEAR, &mut starts);
            }
            if below(LIKELY, &best) {
                best = around(task, best, &FAR, &mut starts);
            }
        }
        Search::Global => {
            if below(SURE, &best) {
                best = around(task, best, &GLOBAL, &mut starts);
            }
        }
    }
    let last = task.fine(best?.at, observe)?;
    Ok(Best {
        candidate: task.judged(last.at),
        last,
        starts,
    })
}

/// Lets the starts of a ring compete with the best so far.
fn around(
    task: &Task<'_>,
    best: Result<Candidate, MatchError>,
    ring: &Ring,
    starts: &mut u8,
) -> Result<Candidate, MatchError> {
    let worth = |c: &Candidate| c.value - ring.pull * c.at.square_distance(task.start);
    let mut best = best;
    for &turn in ring.turns {
        for (side, &ahead) in [1.0, -1.0]
            .into_iter()
            .flat_map(|side| ring.ahead.iter().map(move |a| (side, a)))
        {
            // Not turned is the same both ways, and not moved either it is the guess itself.
            if turn == 0 && (side < 0.0 || ahead == 0.0) {
                continue;
            }
            let start = task.start.moved_far([
                ahead,
                0.0,
                side * f32::from(turn) * (core::f32::consts::PI / 180.0),
            ]);
            *starts = starts.saturating_add(1);
            let Ok(found) = task.coarse(start, &mut |_| ()) else {
                continue;
            };
            if !best.is_ok_and(|b| worth(&b) >= worth(&found)) {
                best = Ok(found);
            }
        }
    }
    best
}
