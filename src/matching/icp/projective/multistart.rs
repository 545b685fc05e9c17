//! Several starts that compete: what finds the pose when the guess is far off.

use crate::{
    geometry::Pose,
    matching::{
        MatchError,
        icp::projective::{Search, Stepped, Task, accumulate::FixedPose},
    },
    math,
};

/// A pose and what it is worth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub at: FixedPose,
    /// Passes that led there.
    pub passes: u8,
    /// Points that met a line, by those that were judged.
    pub overlap: u16,
    /// See [`super::score::Score::value`].
    pub value: f32,
}

/// What [`search`] settled on.
pub(super) struct Best {
    pub candidate: Candidate,
    /// The last pass.
    pub last: Stepped,
    /// Passes of all starts.
    pub iterations: u8,
    /// Starts tried.
    pub starts: u8,
    /// Worth of the best candidate elsewhere over that of the best.
    pub ratio: f32,
}

/// A score at which the guess alone is believed, one for what lies far from the guess, and one at which the starts
/// next to the guess are.
const SURE: f32 = 0.7;
const SURER: f32 = 0.8;
const LIKELY: f32 = 0.5;
/// Far from the guess (m; a turn counted at 3 m).
const FAR_OFF: f32 = 0.75;
/// A second pose that is worth this share of the best makes the match ambiguous.
const AMBIGUOUS: f32 = 0.95;
/// In a local search that ended far from the guess, the ambiguity limit is this times the score: the less a pose explains,
/// the likelier is another one.
const DOUBTFUL: f32 = 1.2;
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

/// Two candidates closer than this (m; a turn counted at 3 m) are the same pose, found twice.
const SAME: f32 = 0.15;

/// The candidates so far: the best one, and the best of those that are somewhere else.
struct Race {
    /// With its worth: the score less what its distance from the guess costs.
    best: Result<(Candidate, f32), MatchError>,
    rival: f32,
    starts: u8,
    passes: u8,
}

impl Race {
    fn enter(&mut self, found: Candidate, worth: f32) {
        self.passes = self.passes.saturating_add(found.passes);
        let Ok((best, best_worth)) = self.best else {
            self.best = Ok((found, worth));
            return;
        };
        let elsewhere = best.at.distance(found.at) > SAME;
        if worth > best_worth {
            self.best = Ok((found, worth));
            if elsewhere {
                self.rival = best_worth;
            }
        } else if elsewhere {
            self.rival = math::max(self.rival, worth);
        }
    }

    fn is_below(&self, limit: f32) -> bool {
        !self.best.is_ok_and(|(best, _)| best.value >= limit)
    }
}

/// Finds the best candidate: from the guess alone if that is sure, else from turned and moved starts.
pub(super) fn search(task: &Task<'_>, observe: &mut impl FnMut(Pose)) -> Result<Best, MatchError> {
    let mut race = Race {
        best: Err(MatchError::Degenerate),
        rival: 0.0,
        starts: 1,
        passes: 0,
    };
    match task.coarse(task.start, observe) {
        Ok(found) => race.enter(found, found.value),
        Err(error) => race.best = Err(error),
    }
    let far = race.best.is_ok_and(|(best, _)| is_far(task, &best));
    let sure = if far { SURER } else { SURE };
    match task.config.search {
        Search::Local => {
            if race.is_below(sure) {
                around(task, &mut race, &NEAR);
            }
            if race.is_below(LIKELY) {
                around(task, &mut race, &FAR);
            }
        }
        Search::Global => {
            if race.is_below(sure) {
                around(task, &mut race, &GLOBAL);
            }
        }
    }
    let (best, worth) = race.best?;
    let ratio = if worth > 0.0 { race.rival / worth } else { 1.0 };
    let most = match task.config.search {
        Search::Global => AMBIGUOUS,
        Search::Local if is_far(task, &best) => DOUBTFUL * best.value,
        // A good guess decides between two places.
        Search::Local => f32::INFINITY,
    };
    if ratio > most {
        return Err(MatchError::Ambiguous { ratio });
    }
    let (last, passes) = task.fine(best.at, observe)?;
    Ok(Best {
        candidate: best,
        last,
        iterations: race.passes.saturating_add(passes),
        starts: race.starts,
        ratio,
    })
}

/// Whether a candidate lies where a good guess would not have led.
fn is_far(task: &Task<'_>, found: &Candidate) -> bool {
    found.at.distance(task.start) > FAR_OFF
}

/// Lets the starts of a ring compete.
fn around(task: &Task<'_>, race: &mut Race, ring: &Ring) {
    let worth = |c: &Candidate| {
        let moved = c.at.distance_only(task.start);
        c.value - ring.pull * moved * moved
    };
    if let Ok((best, old)) = &mut race.best {
        *old = worth(best);
    }
    for &turn in ring.turns {
        for (side, &ahead) in [1.0, -1.0]
            .into_iter()
            .flat_map(|side| ring.ahead.iter().map(move |a| (side, a)))
        {
            // Not turned is the same both ways, and not moved either it is the guess itself.
            if turn == 0 && (side < 0.0 || ahead == 0.0) {
                continue;
            }
            let turn = side * f32::from(turn) * (core::f32::consts::PI / 180.0);
            race.starts = race.starts.saturating_add(1);
            if let Ok(found) = task.coarse(task.start.moved_far([ahead, 0.0, turn]), &mut |_| ()) {
                race.enter(found, worth(&found));
            }
        }
    }
}
