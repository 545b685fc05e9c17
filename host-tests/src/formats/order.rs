//! In which order, and how fast, the beams of a scan were measured.
//!
//! A `LaserScan` says "from one element to the next". Drivers of clockwise lidars turn the array round, so that angles
//! grow, and leave `time_increment` positive: then the last element was measured first. Which of
//! it a recording holds shows where the robot turns: bent back the wrong way, scans do not fit each other.

use beamfix::geometry::Pose;
use beamfix::odometry::OdometryConfig;
use beamfix::scan::{Beam, Mount};

use crate::pipeline::Pipeline;
use crate::{size, sized};

/// The order in which the elements of a scan's array were measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(target_family = "wasm"), derive(clap::ValueEnum))]
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
    /// What a scan may mean that states `time_step` (s), the stated meaning first: no step is believed as it stands.
    #[must_use]
    pub fn candidates(time_step: f64) -> Vec<Self> {
        let step = libm::fabs(time_step);
        let timing = |order, step| Self {
            order,
            step,
            ends_at_stamp: false,
        };
        let is_stated = step > 0.0 && step < MAX_STEP;
        if !is_stated {
            vec![timing(Order::AtOnce, 0.0)]
        } else if time_step < 0.0 {
            // By the definition the first element is the last in time, and has the stamp.
            let backwards = Self {
                ends_at_stamp: true,
                ..timing(Order::Reversed, step)
            };
            vec![backwards, timing(Order::InOrder, step)]
        } else {
            vec![timing(Order::InOrder, step), timing(Order::Reversed, step)]
        }
    }

    /// The order that the user tells; the step is the stated one, or the scan's time in equal parts.
    #[must_use]
    pub fn told(order: Order, time_step: f64, scan_time: f64, count: usize) -> Self {
        let stated = libm::fabs(time_step);
        let shared = scan_time / count.max(1) as f64;
        let step = [stated, shared]
            .into_iter()
            .find(|step| *step > 0.0 && *step < MAX_STEP);
        Self {
            order: if step.is_some() { order } else { Order::AtOnce },
            step: step.unwrap_or(0.0),
            ends_at_stamp: false,
        }
    }

    /// Time of the last of `count` elements after the stamp (s).
    #[must_use]
    pub fn end(&self, count: usize) -> f64 {
        if self.ends_at_stamp || self.order == Order::AtOnce {
            0.0
        } else {
            self.step * count.saturating_sub(1) as f64
        }
    }

    /// Gives beams in the order of the array the times that they have: in the order of time, the first at `stamp_us` or
    /// the last there.
    ///
    /// Beams of one moment have no order in time: they run counter-clockwise about the robot from behind the lidar, so
    /// that one that hangs head down gives the poses of an upright one.
    pub fn apply(&self, beams: &mut [Beam], stamp_us: u32, upside_down: bool) {
        match self.order {
            Order::InOrder => {}
            Order::Reversed => beams.reverse(),
            Order::AtOnce => beams.sort_by_key(|beam| {
                let bearing = beam.bearing.0 as i16;
                if upside_down {
                    bearing.wrapping_neg()
                } else {
                    bearing
                }
            }),
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
/// The other order must raise the mean score of a match by this: the wrong one costs 0.02 of it in steady turns, whose
/// scans are all bent alike, and 0.2 where the turn rate changes.
const MARGIN: f64 = 0.01;

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
