//! Several starts that compete: what finds the pose when the guess is far off.

use crate::{
    geometry::Pose,
    matching::{
        MatchError,
        icp::projective::{
            config::Search,
            descent::{Candidate, Reached, Refined},
            fixed_pose::FixedPose,
            normal_equations::Sums,
            task::{Rivals, Task},
        },
    },
    math,
};

/// What [`search`] settled on.
pub(super) struct Best {
    pub candidate: Candidate,
    /// What the last passes knew.
    pub sums: Sums,
    /// Passes of all starts.
    pub iterations: u8,
    /// Starts tried.
    pub starts: u8,
    /// Worth of the best candidate elsewhere over that of the best.
    pub ratio: f32,
}

/// A score at which what is found from the guess alone is believed, and one at which the starts next to the guess are.
const SURE: f32 = 0.75;
const LIKELY: f32 = 0.5;
/// A score at which it is believed near the guess (m; a rotation counted at 3 m), if its places are known better than one
/// range is: nine in ten of the wrong poses on recorded scans lie along a direction that is known worse.
const SURE_NEAR: f32 = 0.6;
const NEARBY: f32 = 0.35;
/// Far from the guess (m; a rotation counted at 3 m).
const FAR_OFF: f32 = 0.75;
/// A second pose that is worth this share of the best makes the match ambiguous.
const AMBIGUOUS: f32 = 0.95;
/// In a local search that ended far from the guess, the ambiguity limit is this times the score: the less a pose explains,
/// the likelier is another one.
const DOUBTFUL: f32 = 1.2;
/// The same for a search that ended near the guess: a guess decides between places that explain about as much of the scan if
/// they explain most of it.
const UNDECIDED: f32 = 1.4;
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

/// Starts moved along the direction that is known least (m): from what a gate still sees to what it does not.
const SLIDES: [f32; 8] = [0.1, -0.1, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0];

/// Two candidates closer than this (m; a rotation counted at 3 m) are the same pose, found twice.
const SAME: f32 = 0.15;

/// Candidates whose fine passes are made, and how far apart they are at least (m; a rotation counted at 3 m).
const KEPT: usize = 3;
const APART: f32 = 0.08;
/// A start nearer than this to a pose that was found leads there again (m; a rotation counted at 3 m).
const KNOWN: f32 = 0.05;
/// The most that fine passes are assumed to add to a score.
const GAIN: f32 = 0.15;
/// A pose elsewhere whose score is higher by this makes a match ambiguous that only its nearness to the guess decided.
const CLEARLY: f32 = 0.05;

/// Candidates of different places, best first, each with its worth: the score less what its distance from the guess
/// costs.
struct Race {
    /// Where the guess led.
    first: Option<FixedPose>,
    places: heapless::Vec<(Candidate, f32), KEPT>,
    starts: u8,
    passes: u8,
}

impl Race {
    fn enter(&mut self, found: Candidate, worth: f32) {
        self.passes = self.passes.saturating_add(found.passes);
        let near = |(other, _): &&mut (Candidate, f32)| other.at.distance(found.at) < APART;
        if let Some(same) = self.places.iter_mut().find(near) {
            if worth > same.1 {
                *same = (found, worth);
            }
        } else if let Err(place) = self.places.push((found, worth))
            && let Some(last) = self.places.last_mut()
            && worth > last.1
        {
            *last = place;
        }
        self.sort();
    }

    /// Best first. There are few, and most are in order.
    fn sort(&mut self) {
        for _ in 1..KEPT {
            for i in (1..self.places.len()).rev() {
                if let Some([a, b]) = self.places.get_mut(i - 1..=i)
                    && b.1 > a.1
                {
                    core::mem::swap(a, b);
                }
            }
        }
    }

    /// Whether a pose is that of the guess or of a candidate.
    fn knows(&self, at: FixedPose) -> bool {
        let near = |known: &FixedPose| known.distance(at) < KNOWN;
        self.first.as_ref().is_some_and(near)
            || self.places.iter().any(|(found, _)| near(&found.at))
    }

    fn is_likely(&self) -> bool {
        self.places.iter().any(|(found, _)| is_likely(found))
    }

    /// Lets a start compete.
    fn start(&mut self, task: &Task<'_>, at: FixedPose, pull: f32) {
        self.starts = self.starts.saturating_add(1);
        let found = task.coarse(at, |at| self.knows(at), &mut |_| ());
        if let Ok(Some(reached)) = found {
            let found = task.judged(reached, task.config.coarse_beams);
            self.enter(found, worth(task, &found, pull));
        }
    }
}

fn is_likely(found: &Candidate) -> bool {
    found.value >= LIKELY
}

/// Score of a candidate less what its distance from the guess costs.
fn worth(task: &Task<'_>, c: &Candidate, pull: f32) -> f32 {
    let moved = c.at.distance_only(task.start);
    c.value - pull * moved * moved
}

/// Whether no other start is needed.
fn is_sure(task: &Task<'_>, converged: &Refined) -> bool {
    let found = &converged.candidate;
    // Far from a guess that is worth little another place may look the same.
    let elsewhere = task.config.search == Search::Global && is_far(task, found);
    found.value >= SURE && !elsewhere
        || found.value >= SURE_NEAR
            && found.at.distance(task.start) < NEARBY
            && is_sharp(task, converged)
}

/// Whether the place is known better than a range is.
fn is_sharp(task: &Task<'_>, found: &Refined) -> bool {
    let sums = &found.sums;
    let (residual, range) = (sums.residual(), f32::from(task.noise.sigma) * 1e-3);
    let curvature = sums.curvature(task.lever_shift, found.candidate.at);
    curvature.inverse().is_some_and(|spread| {
        let square = math::max(spread.xx, spread.yy) * sums.inflation() * residual * residual;
        square < range * range
    })
}

/// Finds the best candidate: from the guess alone if that is sure, else from starts around what was found and around the
/// guess.
pub(super) fn search(task: &Task<'_>, observe: &mut impl FnMut(Pose)) -> Result<Best, MatchError> {
    let first = task
        .coarse(task.start, |_| false, observe)
        .and_then(|found| {
            let reached = found.ok_or(MatchError::Degenerate)?;
            if let Rivals::None(least) = task.rivals {
                may_be_worth(task, reached, least)?;
            }
            task.fine(reached, observe)
        });
    let alone = matches!(task.rivals, Rivals::None(_));
    match first {
        Ok(found) if alone || is_sure(task, &found) => Ok(Best {
            candidate: found.candidate,
            sums: found.sums,
            iterations: found.candidate.passes,
            starts: 1,
            ratio: 0.0,
        }),
        Err(error) if alone => Err(error),
        unsure => compete(task, unsure, observe),
    }
}

/// Whether a candidate may be worth `least` once its fine passes are made.
fn may_be_worth(task: &Task<'_>, reached: Reached, least: f32) -> Result<(), MatchError> {
    let score = task.judged(reached, task.config.coarse_beams).value;
    if score + GAIN < math::max(least, task.config.min_score) {
        return Err(MatchError::Unlikely { score });
    }
    Ok(())
}

/// Lets other starts compete with what was found from the guess.
// Seldom needed: apart, so that the passes of every match keep their registers.
#[cold]
#[inline(never)]
fn compete(
    task: &Task<'_>,
    first: Result<Refined, MatchError>,
    observe: &mut impl FnMut(Pose),
) -> Result<Best, MatchError> {
    let mut race = Race {
        first: first.as_ref().ok().map(|found| found.candidate.at),
        places: heapless::Vec::new(),
        starts: 1,
        passes: 0,
    };
    if let Ok(found) = &first {
        race.passes = found.candidate.passes;
        slide(task, &mut race, found);
    }
    let pull = match task.config.search {
        Search::Global => around(task, &mut race, &GLOBAL),
        Search::Local => {
            let near = around(task, &mut race, &NEAR);
            let likely = task.rivals == Rivals::Near
                || race.is_likely()
                || first.as_ref().is_ok_and(|b| is_likely(&b.candidate));
            if likely {
                near
            } else {
                around(task, &mut race, &FAR)
            }
        }
    };
    settle(task, first, &race, pull, observe)
}

/// Makes the fine passes of the candidates and takes the one that is worth most; refuses as ambiguous if another is nearly as
/// good.
// Apart: what it holds need not lie below the starts on the stack.
#[inline(never)]
fn settle(
    task: &Task<'_>,
    first: Result<Refined, MatchError>,
    race: &Race,
    pull: f32,
    observe: &mut impl FnMut(Pose),
) -> Result<Best, MatchError> {
    let mut best = first;
    let value = |found: &Result<Refined, MatchError>| {
        found
            .as_ref()
            .map_or((f32::NEG_INFINITY, f32::NEG_INFINITY), |found| {
                (worth(task, &found.candidate, pull), found.candidate.value)
            })
    };
    let (mut most, mut highest) = value(&best);
    let (mut rival, mut passes) = (f32::NEG_INFINITY, race.passes);
    for (candidate, worth) in &race.places {
        // Fine passes add to what a candidate is worth, but not so much.
        let could = candidate.value + GAIN;
        if could < task.config.min_score || (*worth + GAIN < most && could < highest) {
            continue;
        }
        let Ok(found) = task.fine(candidate.reached(), observe) else {
            continue;
        };
        passes = passes.saturating_add(found.candidate.passes);
        let elsewhere = best
            .as_ref()
            .is_ok_and(|best| best.candidate.at.distance(found.candidate.at) > SAME);
        let found = Ok(found);
        let (worth, score) = value(&found);
        highest = math::max(highest, score);
        if elsewhere {
            rival = math::max(rival, math::min(worth, most));
        }
        if worth > most {
            (best, most) = (found, worth);
        }
    }
    let best = best?;
    let ratio = if most > 0.0 {
        math::max(rival, 0.0) / most
    } else {
        1.0
    };
    let limit = match task.config.search {
        Search::Global => AMBIGUOUS,
        Search::Local if is_far(task, &best.candidate) => DOUBTFUL * best.candidate.value,
        // A good guess decides between two places ...
        Search::Local if task.is_decided => f32::INFINITY,
        Search::Local => UNDECIDED * best.candidate.value,
    };
    if ratio > limit {
        return Err(MatchError::Ambiguous { ratio });
    }
    // ... that explain the scan equally well.
    if highest > best.candidate.value + CLEARLY {
        let ratio = best.candidate.value / highest;
        return Err(MatchError::Ambiguous { ratio });
    }
    Ok(Best {
        candidate: best.candidate,
        sums: best.sums,
        iterations: passes,
        starts: race.starts,
        ratio,
    })
}

/// Whether a candidate lies where a good guess would not have led.
fn is_far(task: &Task<'_>, found: &Candidate) -> bool {
    found.at.distance(task.start) > FAR_OFF
}

/// Starts moved along the direction that a candidate knows least of: where walls leave it open, local minima lie along it.
fn slide(task: &Task<'_>, race: &mut Race, found: &Refined) {
    /// Makes a heading comparable with a distance, as everywhere here (m).
    const LEVER: f32 = 3.0;
    let curvature = found.sums.curvature(task.lever_shift, found.candidate.at);
    let [(least, [x, y, t]), _, _] = curvature.theta_scaled(1.0 / LEVER).eigen();
    if least < task.least_curvature(&found.sums) {
        // Nothing is known along it: the guess decides.
        return;
    }
    let at = found.candidate.at.pose();
    for d in SLIDES {
        let start = Pose::new(at.x + d * x, at.y + d * y, at.theta + d * t / LEVER);
        if let Some(start) = FixedPose::new(start) {
            race.start(task, start, NEAR_PULL);
        }
    }
}

/// Lets the starts of a ring compete; gives its pull.
fn around(task: &Task<'_>, race: &mut Race, ring: &Ring) -> f32 {
    for (candidate, old) in &mut race.places {
        *old = worth(task, candidate, ring.pull);
    }
    race.sort();
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
            race.start(task, task.start.moved_far([ahead, 0.0, turn]), ring.pull);
        }
    }
    ring.pull
}
