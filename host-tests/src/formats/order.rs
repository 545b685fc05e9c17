//! In which order, and how fast, the beams of a scan were measured.
//!
//! A `LaserScan` says "from one element to the next". Drivers of clockwise lidars turn the array round, so that angles
//! grow, and leave `time_increment` positive: then the last element was measured first. Others leave it 0. Which of it
//! a recording holds shows where the robot turns: bent back the wrong way, scans do not fit each other.

use beamfix::geometry::Pose;
use beamfix::odometry::OdometryConfig;
use beamfix::scan::{Beam, Mount};

use crate::pipeline::Pipeline;
use crate::{size, sized};

/// The order in which the elements of a scan's array were measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Order {
    /// The first element first.
    InOrder,
    /// The last element first.
    Reversed,
    /// All at one moment, or moved there by the driver.
    AtOnce,
}

impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::InOrder => "in order",
            Self::Reversed => "reversed",
            Self::AtOnce => "at once",
        })
    }
}

/// When the elements of a scan's array were measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Which comes first.
    pub order: Order,
    /// From one to the next (s).
    pub step: f64,
    /// Whether the stamp is the last one's time instead of the first one's.
    pub ends_at_stamp: bool,
}

/// Longest believable time between two beams (s): a turn a second in 100 beams.
const MAX_STEP: f64 = 0.01;

impl Timing {
    /// What a scan of `count` elements may mean that states `time_step` and `scan_time` (s), the stated meaning first.
    #[must_use]
    pub fn candidates(time_step: f64, scan_time: f64, count: usize) -> Vec<Self> {
        let stated = libm::fabs(time_step);
        let is_stated = stated > 0.0 && stated < MAX_STEP;
        let shared = scan_time / count.max(1) as f64;
        let timing = |order, step| Self {
            order,
            step,
            ends_at_stamp: false,
        };
        let at_once = timing(Order::AtOnce, 0.0);
        let both = |step| [timing(Order::InOrder, step), timing(Order::Reversed, step)];
        if is_stated && time_step < 0.0 {
            // By the definition the first element is the last in time, and has the stamp.
            let backwards = Self {
                ends_at_stamp: true,
                ..timing(Order::Reversed, stated)
            };
            [&[backwards], &both(stated)[..], &[at_once]].concat()
        } else if is_stated {
            [&both(stated)[..], &[at_once]].concat()
        } else if shared > 0.0 && shared < MAX_STEP {
            [&[at_once], &both(shared)[..]].concat()
        } else {
            vec![at_once]
        }
    }

    /// Gives beams in the order of the array the times that they have: in the order of time, the first at `stamp_us` or
    /// the last there.
    pub fn apply(&self, beams: &mut [Beam], stamp_us: u32) {
        if self.order == Order::Reversed {
            beams.reverse();
        }
        let step_us = if self.order == Order::AtOnce {
            0.0
        } else {
            self.step * 1e6
        };
        let last = beams.len().saturating_sub(1);
        let first_us = if self.ends_at_stamp {
            stamp_us.wrapping_sub((step_us * last as f64) as u32)
        } else {
            stamp_us
        };
        for (k, beam) in beams.iter_mut().enumerate() {
            beam.time_us = first_us.wrapping_add((step_us * k as f64) as u32);
        }
    }
}

/// A heading that changes by more than this from scan to scan tells the order (rad).
const TURNING: f32 = 0.02;
/// So many turning scans are enough, and so few tell nothing.
const ENOUGH: usize = 150;
const TOO_FEW: usize = 10;
/// Another order than the stated one must raise the mean score of a match by this: the wrong one costs 0.1 to 0.3 of
/// it, noise less than 0.01.
const MARGIN: f64 = 0.02;

/// The timing among `candidates` by which scans fit each other best where the robot turns; the first one if they say
/// nothing. `scans` gives the scans by a timing, one by one.
#[must_use]
pub fn fitting(
    candidates: &[Timing],
    count: usize,
    mount: Mount,
    scan: impl Fn(usize, &Timing) -> Vec<Beam>,
) -> Fit {
    let Some(&stated) = candidates.first() else {
        return Fit::default();
    };
    let of = |timing: &Timing, most: usize| {
        let scans = (0..most).map(|k| scan(k, timing));
        let some: Vec<Vec<Beam>> = (0..most.min(20)).map(|k| scan(k, timing)).collect();
        let size = size::fitting(some.iter().map(|beams| &beams[..]));
        sized!(size, trial(scans, mount))
    };
    let mut best = Fit {
        timing: Some(stated),
        gain: 0.0,
    };
    if candidates.len() < 2 {
        return best;
    }
    let first = of(&stated, count);
    let Some(by_stated) = first.mean() else {
        return best;
    };
    for timing in &candidates[1..] {
        if let Some(mean) = of(timing, first.scans).mean() {
            let gain = mean - by_stated;
            if gain > MARGIN && gain > best.gain {
                best = Fit {
                    timing: Some(*timing),
                    gain,
                };
            }
        }
    }
    best
}

/// What [`fitting`] found.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fit {
    /// The timing to use.
    pub timing: Option<Timing>,
    /// By how much it raises the mean score of a match over the stated one; 0 for the stated one.
    pub gain: f64,
}

/// What came of matching some scans.
struct Trial {
    scans: usize,
    turning: usize,
    score: f64,
}

impl Trial {
    fn mean(&self) -> Option<f64> {
        (self.turning >= TOO_FEW).then(|| self.score / self.turning as f64)
    }
}

/// Matches scans without wheels until enough of them turned.
fn trial<const N: usize>(scans: impl Iterator<Item = Vec<Beam>>, mount: Mount) -> Trial {
    let mut pipeline = Pipeline::<N>::new(OdometryConfig::DEFAULT.with_mount(mount));
    let mut before = Pose::IDENTITY;
    let mut trial = Trial {
        scans: 0,
        turning: 0,
        score: 0.0,
    };
    for beams in scans {
        let step = pipeline.step(&super::thinned(beams, N), None);
        trial.scans += 1;
        if before.between(step.pose).theta.abs() > TURNING {
            trial.turning += 1;
            trial.score += step.outcome.map_or(0.0, |found| f64::from(found.score));
        }
        before = step.pose;
        if trial.turning >= ENOUGH {
            break;
        }
    }
    trial
}
