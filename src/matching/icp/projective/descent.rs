//! From a start to a pose: coarse passes over a few points, then fine ones until two steps are short against the covariance.

use crate::{
    geometry::Pose,
    matching::{
        MatchError,
        icp::projective::{
            accumulate::{self, Gate, Pass},
            fixed_pose::{self, FixedPose},
            normal_equations::Sums,
            score,
            task::Task,
        },
    },
    math,
};

/// Width of the first coarse pass's gate (mm), and most coarse passes.
const COARSE_FIRST: u32 = 2048;
const COARSE_MOST: u8 = 16;
/// Width of the gate (mm) from which on a start that is near a known place does not leave it.
const KNOWN_WIDTH: u32 = 512;
/// A step that is this short compared with the gate narrows it to a quarter, or to half.
const SHORT: f32 = 1.0 / 16.0;
const MEDIUM: f32 = 1.0 / 4.0;
/// Width of the last gate in fifths of a standard deviation of a range: half weight at two standard deviations.
const FINE_FIFTHS: u32 = 64;
/// Most fine passes, each over half of the points. Those of recorded scans need 3 to 9.
const FINE_MOST: u8 = 24;
/// A match has converged when its last two steps, whose passes took all points between them, are each shorter than this share
/// of the standard deviation that its covariance tells: what is left of the way then is shorter, and adds nothing to the error.
/// After the last pass twice as much is let pass: points that change between two lines lead to and fro for ever.
const CONVERGED: f32 = 0.3;
/// Points that decide what a converged pose is worth, about.
const JUDGED: u16 = 120;

/// A pose on the way, and the passes that led there.
#[derive(Clone, Copy)]
pub(super) struct Reached {
    pub at: FixedPose,
    pub passes: u8,
}

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

impl Candidate {
    pub const fn reached(&self) -> Reached {
        Reached {
            at: self.at,
            passes: self.passes,
        }
    }
}

/// A converged candidate.
pub(super) struct Refined {
    pub candidate: Candidate,
    /// What the last passes knew.
    pub sums: Sums,
}

/// A Gauss–Newton step.
struct Stepped {
    /// See [`FixedPose::moved`].
    by: [f32; 3],
    /// Its length in standard deviations of the pose.
    sigmas: f32,
}

/// How much of a Gauss–Newton step is made: weights and lines that change with the pose make it too short or too long.
struct Pace {
    share: f32,
    last: [f32; 3],
}

impl Pace {
    const fn new() -> Self {
        Self {
            share: 1.0,
            last: [0.0; 3],
        }
    }

    /// More of a step that leads on as the last one did, less of one that leads back.
    fn adapted(&mut self, [x, y, turn]: [f32; 3]) -> [f32; 3] {
        /// A rotation is counted at 3 m (1/16 mm).
        const LEVER: f32 = 48_000.0;
        let [lx, ly, lt] = self.last;
        let along = x * lx + y * ly + LEVER * LEVER * turn * lt;
        self.last = [x, y, turn];
        if along > 0.0 {
            self.share = math::min(1.4 * self.share, 2.0);
        } else if along < 0.0 {
            self.share = math::max(0.5 * self.share, 0.25);
        }
        [x, y, turn].map(|v| self.share * v)
    }
}

impl Task<'_> {
    /// Width of the last gate (mm).
    fn fine_width(&self) -> u32 {
        u32::from(self.noise.sigma) * FINE_FIFTHS / 5
    }

    /// A pass over every other eight points by the last gate.
    fn half(&self, which: u8) -> Pass {
        Pass {
            period: 16,
            first: 8 * u16::from(which),
            length: 8,
            gate: Gate::new(self.fine_width()),
        }
    }

    /// The step that all points lead to.
    pub fn step_by_all(&self, at: FixedPose) -> Result<[f32; 3], MatchError> {
        let all = Pass {
            period: u16::MAX,
            first: 0,
            length: u16::MAX,
            gate: Gate::new(self.fine_width()),
        };
        let mut known = Sums::default();
        Ok(self.step(at, all, &mut known, &Sums::default())?.by)
    }

    /// A pass, what it knows as `known`, and the Gauss–Newton step by that and by what is known of other points.
    fn step(
        &self,
        at: FixedPose,
        pass: Pass,
        known: &mut Sums,
        others: &Sums,
    ) -> Result<Stepped, MatchError> {
        accumulate::run(self.lines, self.points, at, self.lever_shift, pass, known);
        // Half of the share of the points that the pass looked at.
        let share = u32::from(self.config.min_inliers) * u32::from(pass.length);
        let needed = (share / u32::from(pass.period.max(1)) / 2) as u16;
        if known.inliers < needed {
            let found = known.inliers;
            return Err(MatchError::TooFewCorrespondences { found, needed });
        }
        let sums = known.plus(others);
        let step = sums.step(self.lever_shift).ok_or(MatchError::Degenerate)?;
        let noise = math::max(sums.residual(), self.config.min_range_sigma) * 1e3;
        let variance = sums.inflation() * noise * noise;
        Ok(Stepped {
            by: step.by,
            sigmas: math::sqrt(math::max(step.gain, 0.0) / variance),
        })
    }

    /// From a start to near a candidate: coarse passes whose gate narrows as their steps get shorter. `None` where they lead to
    /// a place that is known.
    pub fn coarse(
        &self,
        start: FixedPose,
        is_known: impl Fn(FixedPose) -> bool,
        observe: &mut impl FnMut(Pose),
    ) -> Result<Option<Reached>, MatchError> {
        let period = self.stride(self.config.coarse_beams);
        let least = self.fine_width();
        let mut at = start;
        let mut width = COARSE_FIRST.max(least);
        let mut passes = 0;
        let mut known = Sums::default();
        while passes < COARSE_MOST {
            let pass = Pass {
                period,
                // Another set of points each time.
                first: u16::from(passes) % period,
                length: 1,
                gate: Gate::new(width),
            };
            let stepped = self.step(at, pass, &mut known, &Sums::default())?;
            at = at.moved(stepped.by, self.start);
            observe(at.pose());
            passes += 1;
            let metres = width as f32 * 1e-3;
            let length = fixed_pose::length(stepped.by);
            let narrower = if length < metres * SHORT {
                width / 4
            } else if length < metres * MEDIUM {
                width / 2
            } else {
                continue;
            };
            if width == least {
                break;
            }
            width = narrower.max(least);
            if width <= KNOWN_WIDTH && is_known(at) {
                return Ok(None);
            }
        }
        Ok(Some(Reached { at, passes }))
    }

    /// From a candidate to the pose: passes over one half of the points and then the other, each with what the last one knew of
    /// its half, until steps are a fraction of what the pose is uncertain by.
    pub fn fine(
        &self,
        from: Reached,
        observe: &mut impl FnMut(Pose),
    ) -> Result<Refined, MatchError> {
        let Reached { mut at, mut passes } = from;
        let mut pace = Pace::new();
        let (mut mine, mut others) = (Sums::default(), Sums::default());
        let (mut step, mut before) = (0.0, f32::INFINITY);
        for pass in 0..FINE_MOST {
            let stepped = self.step(at, self.half(pass % 2), &mut mine, &others)?;
            let by = pace.adapted(stepped.by);
            at = at.moved(by, self.start);
            observe(at.pose());
            passes = passes.saturating_add(1);
            let enough = if pass + 1 < FINE_MOST {
                CONVERGED
            } else {
                2.0 * CONVERGED
            };
            if math::max(stepped.sigmas, before) < enough {
                let candidate = self.judged(Reached { at, passes }, JUDGED);
                let sums = mine.plus(&others);
                return Ok(Refined { candidate, sums });
            }
            step = fixed_pose::length(by);
            // The first pass knows half of the points only.
            before = if pass > 0 { stepped.sigmas } else { before };
            others = mine.after(by, self.lever_shift);
        }
        Err(MatchError::NotConverged { step })
    }

    /// Every how many-th point makes at most `beams`.
    fn stride(&self, beams: u16) -> u16 {
        (self.points.len() as u16).div_ceil(beams.max(1)).max(1)
    }

    /// What a pose is worth by at most `beams` points.
    pub fn judged(&self, Reached { at, passes }: Reached, beams: u16) -> Candidate {
        let stride = self.stride(beams);
        let score = score::judge(self.lines, self.points, at, stride, self.noise);
        Candidate {
            at,
            passes,
            overlap: score.overlap.saturating_mul(stride),
            value: score.value(20 / stride.max(1)),
        }
    }
}
