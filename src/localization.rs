//! Where am I in a known map: tracking, finding oneself, noticing that one is lost.
//!
//! ```text
//!            search done        one left
//! Searching ────────────▶ Choosing ────▶ Tracking
//!     ▲                      │ none fits    │ three bad scans
//!     └──────────────────────┴──────────────┘
//! ```
//!
//! A [`Localizer`] draws nothing at random: its search looks at every place and heading; what it finds is followed until
//! the robot's motion has told the candidates apart. [`Localizer::update`] and [`Localizer::step`] do a bounded amount of
//! work per call. Poses drawn at random are in `particles`, behind the feature of that name.

mod config;
#[cfg(not(feature = "internals"))]
pub(crate) mod hypotheses;
#[cfg(feature = "internals")]
pub mod hypotheses;
#[cfg(feature = "particles")]
pub mod particles;
pub mod presence;
#[cfg(not(feature = "internals"))]
pub(crate) mod quality;
#[cfg(feature = "internals")]
pub mod quality;
#[cfg(not(feature = "internals"))]
pub(crate) mod search;
#[cfg(feature = "internals")]
pub mod search;

use crate::{
    geometry::Pose,
    matching::{
        Match,
        correlative::{CorrelativeConfig, Correlator, pyramid::Pyramid},
        field,
    },
    scan::{ScanPoint, thinning::thinned},
};
pub use config::LocalizerConfig;
use hypotheses::{Hypotheses, Hypothesis};
use quality::Quality;
use search::Search;

/// What is known after a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// The pose is known: the match, and how well the scan fits.
    Tracking(Match, Quality),
    /// The pose is predicted by odometry alone, or matched so that it may be another: do not rely on it.
    Doubtful(Quality),
    /// The pose is not known: the search goes on in [`Localizer::step`].
    Searching,
    /// The pose is one of so many, and the best of them fits so well.
    Choosing {
        /// Candidates left.
        candidates: u8,
        /// Mean quality of the best.
        best: f32,
    },
}

/// The robot's place in a map that lies in flash.
///
/// 24·N bytes and about 4 KB, beside the pyramid's buffer: 8.7 KB for a map of 400 by 320 cells.
/// N: points of a scan that are used where all are not needed, 96 to 128.
#[derive(Debug, Clone)]
pub struct Localizer<'a, const N: usize> {
    pyramid: Pyramid<'a>,
    config: LocalizerConfig,
    correlator: Correlator<N>,
    state: State,
    /// While tracking.
    pose: Pose,
    bad_scans: u8,
    doubts: u8,
    search: Search<N>,
    hypotheses: Hypotheses,
    counters: Counters,
}

/// What happened so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Scans given.
    pub scans: u32,
    /// Times the pose was lost.
    pub lost: u32,
    /// Searches begun.
    pub searches: u32,
    /// Bytes looked up by searches.
    pub lookups: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Waits for a scan to search with.
    Lost,
    Searching,
    Choosing,
    Tracking,
}

impl<'a, const N: usize> Localizer<'a, N> {
    /// Knows nothing: the first scan starts a search.
    #[must_use]
    pub const fn new(pyramid: Pyramid<'a>, config: LocalizerConfig) -> Self {
        Self {
            pyramid,
            config,
            correlator: Correlator::new(),
            state: State::Lost,
            pose: Pose::IDENTITY,
            bad_scans: 0,
            doubts: 0,
            search: Search::new(),
            hypotheses: Hypotheses::new(),
            counters: Counters {
                scans: 0,
                lost: 0,
                searches: 0,
                lookups: 0,
            },
        }
    }

    /// Tracks from a known pose of the lidar in the map on.
    pub fn start_at(&mut self, map_from_lidar: Pose) {
        let Pose { x, y, theta } = map_from_lidar;
        self.pose = Pose::new(x, y, theta);
        (self.bad_scans, self.doubts) = (0, 0);
        self.state = if map_from_lidar.is_finite() {
            State::Tracking
        } else {
            State::Lost
        };
    }

    /// The lidar's pose in the map, where it is known.
    #[must_use]
    pub fn pose(&self) -> Option<Pose> {
        (self.state == State::Tracking).then_some(self.pose)
    }

    /// What happened so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Takes a scan; `motion` is the lidar's since the scan before, by odometry, in its own frame.
    ///
    /// Tracking costs what [`field::align`] costs, a scan that leaves doubts a search of [`LocalizerConfig::position_range`]
    /// around, choosing one short match a candidate.
    pub fn update(&mut self, points: &[ScanPoint], motion: Pose) -> Verdict {
        self.counters.scans = self.counters.scans.wrapping_add(1);
        let motion = if motion.is_finite() {
            motion
        } else {
            Pose::IDENTITY
        };
        match self.state {
            State::Lost => {
                self.hypotheses.clear();
                if self.search.start(points) {
                    self.counters.searches = self.counters.searches.wrapping_add(1);
                    self.state = State::Searching;
                }
                Verdict::Searching
            }
            State::Searching => {
                self.search.moved(motion);
                Verdict::Searching
            }
            State::Choosing => self.choose(points, motion),
            State::Tracking => self.track(points, motion),
        }
    }

    /// Goes on with a search for about `budget` bytes looked up (7 to 17 instructions each on an M4F); true where there is
    /// nothing more to do before the next scan.
    ///
    /// A call looks up at most `budget` bytes and then finishes the block that it is at: 12 000 bytes more.
    pub fn step(&mut self, budget: u32) -> bool {
        if self.state != State::Searching {
            return true;
        }
        let before = self.search.lookups() + self.correlator_lookups();
        loop {
            let done = self.search.advance(
                &self.pyramid,
                &self.config,
                &mut self.correlator,
                &mut self.hypotheses,
            );
            let spent = self.search.lookups() + self.correlator_lookups() - before;
            if done {
                // Candidates are poses at the search's own scan: bring them to now.
                self.hypotheses.moved(self.search.motion());
                self.counters.lookups += spent;
                self.state = if self.hypotheses.is_empty() {
                    State::Lost
                } else {
                    State::Choosing
                };
                return true;
            }
            if spent >= u64::from(budget) {
                self.counters.lookups += spent;
                return false;
            }
        }
    }

    fn correlator_lookups(&self) -> u64 {
        self.correlator.lookups()
    }

    fn track(&mut self, points: &[ScanPoint], motion: Pose) -> Verdict {
        let predicted = self.pose * motion;
        let field = *self.pyramid.field();
        let fitting = |found: &Match| Quality::of(&field, points, found.pose, N);
        let near = field::align(&field, points, predicted, &self.config.field).ok();
        let mut best = near.map(|found| (found, fitting(&found)));
        if !best.is_some_and(|(_, quality)| self.is_sure(&quality)) {
            let around = CorrelativeConfig {
                position_range: self.config.position_range,
                heading_range: self.config.heading_range,
                min_score: 0.2,
                ..CorrelativeConfig::DEFAULT
            };
            let wide = self
                .correlator
                .best(&self.pyramid.local(), points, predicted, &around);
            let wide = wide.and_then(|wide| field::align(&field, points, wide, &self.config.field));
            if let Ok(found) = wide {
                let quality = fitting(&found);
                if best.is_none_or(|(_, before)| quality.value() > before.value()) {
                    best = Some((found, quality));
                }
            }
        }
        let fits = best.filter(|(_, quality)| quality.value() >= self.config.min_quality);
        if let Some((found, quality)) = fits {
            self.pose = found.pose;
            self.bad_scans = 0;
            if self.is_sure(&quality) {
                self.doubts = 0;
                return Verdict::Tracking(found, quality);
            }
            self.doubts = self.doubts.saturating_add(1);
        } else {
            self.pose = predicted;
            // Motions that lead beyond all numbers lead nowhere.
            self.bad_scans = match predicted.is_finite() {
                true => self.bad_scans.saturating_add(1),
                false => u8::MAX,
            };
        }
        if self.bad_scans >= self.config.max_bad_scans
            || self.doubts >= self.config.max_doubtful_scans
        {
            self.counters.lost = self.counters.lost.wrapping_add(1);
            self.state = State::Lost;
            // This scan will do for the search.
            return self.update_lost(points);
        }
        Verdict::Doubtful(best.map_or(Quality::NONE, |(_, quality)| quality))
    }

    /// Whether a scan that fits leaves no doubts.
    fn is_sure(&self, quality: &Quality) -> bool {
        quality.value() >= self.config.confident_quality
            && quality.is_confident(self.config.max_wall_crossings)
    }

    fn update_lost(&mut self, points: &[ScanPoint]) -> Verdict {
        self.counters.scans = self.counters.scans.wrapping_sub(1);
        self.update(points, Pose::IDENTITY)
    }

    fn choose(&mut self, points: &[ScanPoint], motion: Pose) -> Verdict {
        let field = *self.pyramid.field();
        let short = self.config.short();
        let mut some = heapless::Vec::<ScanPoint, N>::new();
        for &point in thinned(points, N) {
            let _ = some.push(point);
        }
        self.hypotheses.moved(motion);
        self.hypotheses.weigh(|pose| {
            let found = field::align(&field, &some, pose, &short);
            let pose = found.map_or(pose, |found| found.pose);
            (pose, Quality::of(&field, &some, pose, N).strict_value())
        });
        let Some(best) = self.hypotheses.best() else {
            self.state = State::Lost;
            return Verdict::Searching;
        };
        let scans = best.scans;
        let verdict = Verdict::Choosing {
            candidates: self.hypotheses.len() as u8,
            best: best.mean(),
        };
        if best.mean() < 0.6 * self.config.min_candidate_quality && scans >= 2
            || scans >= self.config.max_scans
        {
            self.state = State::Lost;
            return verdict;
        }
        if scans < self.config.min_scans
            || best.mean() < self.config.min_candidate_quality
            || best.last < self.config.min_quality
        {
            return verdict;
        }
        if self.hypotheses.margin() < self.config.min_margin {
            return verdict;
        }
        let Hypothesis { pose, .. } = best;
        let Ok(found) = field::align(&field, points, pose, &self.config.field) else {
            return verdict;
        };
        let quality = Quality::of(&field, points, found.pose, N);
        if !self.is_sure(&quality) {
            return verdict;
        }
        self.pose = found.pose;
        (self.bad_scans, self.doubts) = (0, 0);
        self.state = State::Tracking;
        Verdict::Tracking(found, quality)
    }
}
