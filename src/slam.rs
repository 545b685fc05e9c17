//! A map of keyframes that stays consistent when the robot comes back: pose-graph SLAM in fixed memory.
//!
//! | step | where |
//! | --- | --- |
//! | keep a scan as a keyframe, joined to the one before by what odometry tells | `keeping`, `store` |
//! | find earlier keyframes that may see the same place | `loops`, `drift` |
//! | find the place of a robot that was carried | `recognition`, `joining` |
//! | match against what those around that place see together, check, wait for confirmation | `closing`, `verify` |
//! | solve the pose graph, loops weighted by how well they agree | `solver`, `graph` |
//! | remove the keyframe that tells least where the memory is full | `room`, `pruning` |
//! | draw the map from the keyframes | `rendering` |
//! | save it in flash and go on with it | `flash`, `stored` |
//!
//! Odometry goes in with every scan ([`Slam::update`]); everything else is done in slices in the time between scans
//! ([`Slam::step`]). Poses are given in the frame of a keyframe ([`Placed`]), since keyframes still move.
//!
//! The map is its keyframes, poses and scans of two bytes a point, and the motions measured between them. A scan of now is
//! matched with what up to eight keyframes around a place saw, as one scan (see `matching::virtual_scan`): one keyframe alone
//! overlaps too little where a lidar sees to one side only. Where the graph knows to 10 cm (σ) where the robot is, a match
//! alone is a loop; elsewhere two others must close a cycle with it. Loops that contradict the rest later lose their weight in
//! the solution (dynamic covariance scaling).
//!
//! A robot that was carried (odometry gave up its keyframe and tells that the heading may be any) begins a submap of its own.
//! Its keyframes are compared with all others, and it is joined to theirs once matches from places some metres apart agree.
//! Until then [`Slam::is_located`] is false.
//!
//! In less memory and without loops there is a map that rolls with the robot, `rolling`; `pipeline::RollingMapper` lays it over
//! odometry.
//!
//! What it does not do: doors that changed stay as the keyframes saw them, and a keyframe's covariance in the map is not
//! computed.

mod closing;
mod config;
mod drift;
#[cfg(feature = "embedded-storage")]
mod flash;
#[cfg(feature = "internals")]
pub mod graph;
#[cfg(not(feature = "internals"))]
mod graph;
mod growth;
mod joining;
mod keeping;
mod loops;
mod pruning;
mod recognition;
mod rendering;
mod rolling;
mod room;
#[cfg(feature = "internals")]
pub mod solver;
#[cfg(not(feature = "internals"))]
mod solver;
mod store;
#[cfg(feature = "embedded-storage")]
mod stored;
mod task;
mod verify;
mod work;

pub use config::SlamConfig;
#[cfg(feature = "embedded-storage")]
pub use flash::StorageError;
pub use pruning::Merged;
pub(crate) use rolling::{RollingMap, Told};

use heapless::{Deque, Vec};

use self::{
    drift::Drift,
    graph::{Graph, Slot},
    solver::Solver,
    store::PackedScan,
    task::Work,
    verify::Pending,
};
use crate::{
    geometry::Pose,
    linalg::Covariance,
    matching::{icp::projective::Reference, virtual_scan::VirtualScan},
    scan::ScanPoint,
};

/// SLAM for a controller of 192 KB: 224 keyframes of 144 points. Needs 157 KB itself.
pub type Slam192k = Slam<224, 512, 880, 144, 360>;
/// SLAM for a controller of 512 KB: 560 keyframes of 180 points. Needs 451 KB itself.
pub type Slam512k = Slam<560, 1400, 2800, 180, 720>;

/// A budget for [`Slam::step`] between two scans of 5 to 15 a second: two million instructions of a Cortex-M4F, 15 ms at 168 MHz.
pub const SLICE: u32 = 20_000;

/// Keyframes and loops since the start; every number wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Keyframes made.
    pub keyframes: u32,
    /// Keyframes that were due and found no room, because pruning was not given the time.
    pub no_room: u32,
    /// Keyframes removed to make room for others.
    pub pruned: u32,
    /// Matches tried.
    pub tried: u32,
    /// Matches refused: no pose, too little agreement, or far from where the graph expects it.
    pub refused: u32,
    /// Matches that waited for others to confirm them.
    pub waited: u32,
    /// Loops closed.
    pub loops: u32,
    /// Loops given up again because the graph was too dense or had no room.
    pub dropped: u32,
    /// Solutions of the graph.
    pub solved: u32,
    /// Submaps begun, as the robot was carried.
    pub carried: u32,
    /// Submaps that were joined to another one.
    pub joined: u32,
}

/// Where a scan is: a pose in the frame of a keyframe.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Placed {
    /// Number of the keyframe, as [`Slam::keyframes`] has it.
    pub keyframe: u32,
    /// The lidar in its frame.
    pub motion: Pose,
}

/// The last keyframe.
#[derive(Debug, Clone, Copy)]
struct Last {
    slot: Slot,
    id: u32,
    /// Pose of the lidar by odometry, and its covariance.
    odometry: Pose,
    covariance: Covariance,
}

/// Most keyframes that wait to be looked at.
const FRESH: usize = 16;
/// Most loops that wait for confirmation.
const PENDING: usize = 48;

/// Keyframes, graph and all working memory: at most K keyframes of B points, E edges, L blocks of the solver's factor, and
/// V directions of what several keyframes see together.
///
/// About `(77 + 2·B)·K + 48·E + 44·L + 16·B + 32·V` bytes.
#[derive(Debug, Clone)]
pub struct Slam<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize> {
    config: SlamConfig,
    graph: Graph<K, E>,
    scans: [PackedScan<B>; K],
    solver: Solver<K, L>,
    drift: Drift<K, E>,
    /// Expected information of each keyframe (256ths of a bit); [`pruning::UNWEIGHED`] where it is to be weighed anew.
    worth: [u16; K],
    /// What keyframes see together, as points and as lines.
    view: VirtualScan<V>,
    reference: Reference<V>,
    /// Points of the keyframe at hand, and of one of the others.
    own: Vec<ScanPoint, B>,
    other: Vec<ScanPoint, B>,
    /// How many other keyframes saw what each of `own` met.
    seen: [u8; B],
    pending: Pending<PENDING>,
    /// Keyframes whose place was not looked at so far.
    fresh: Deque<Slot, FRESH>,
    work: Work,
    /// There are new edges since the last solution; and they contradict the poses.
    changed: bool,
    contradicted: bool,
    /// The keyframe looked at again last, and how many were since there was a new keyframe.
    again: Slot,
    quiet: u16,
    merged: Option<Merged>,
    /// No keyframe can be removed until there is a new one.
    stuck: bool,
    last: Option<Last>,
    /// Variance of the heading by odometry at the last scan (rad²).
    heading_variance: f32,
    /// The robot was carried, and there is no keyframe since then.
    adrift: bool,
    /// Number of the keyframe whose place was searched in other submaps last.
    searched: Option<u32>,
    /// The keyframe that is matched with other submaps, and its best score.
    likeliest: Option<(Slot, f32)>,
    counters: Counters,
}

impl<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Slam<K, E, L, B, V>
{
    /// Nothing seen.
    #[must_use]
    pub const fn new(config: SlamConfig) -> Self {
        Self {
            config,
            graph: Graph::new(),
            scans: [PackedScan::EMPTY; K],
            solver: Solver::new(),
            drift: Drift::new(),
            worth: [pruning::UNWEIGHED; K],
            view: VirtualScan::new(),
            reference: Reference::new(),
            own: Vec::new(),
            other: Vec::new(),
            seen: [0; B],
            pending: Pending::new(),
            fresh: Deque::new(),
            work: Work::Idle,
            changed: false,
            contradicted: false,
            again: 0,
            quiet: 0,
            merged: None,
            stuck: false,
            last: None,
            heading_variance: 0.0,
            adrift: false,
            searched: None,
            likeliest: None,
            counters: Counters {
                keyframes: 0,
                no_room: 0,
                pruned: 0,
                tried: 0,
                refused: 0,
                waited: 0,
                loops: 0,
                dropped: 0,
                solved: 0,
                carried: 0,
                joined: 0,
            },
        }
    }

    /// The keyframes of the map and of submaps not joined to it so far: number, slot, and pose of the lidar (m, rad).
    pub fn keyframes(&self) -> impl Iterator<Item = (u32, u16, Pose)> + '_ {
        let nodes = self.graph.nodes();
        nodes.map(|(slot, node)| (node.id, slot, node.pose))
    }

    /// The keyframes' poses and what is known of the motions between them.
    #[cfg(feature = "internals")]
    #[must_use]
    pub const fn graph(&self) -> &Graph<K, E> {
        &self.graph
    }

    /// What happened so far.
    #[must_use]
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Whether the robot is where the map began, or came back there: `false` between the time at which it was carried and the
    /// time at which enough matches tell where to.
    #[must_use]
    pub fn is_located(&self) -> bool {
        self.last
            .is_none_or(|last| !self.adrift && self.is_in_map(last.slot))
    }

    /// Whether a keyframe is in the submap of the oldest one.
    #[must_use]
    pub fn is_in_map(&self, slot: Slot) -> bool {
        let submap = self.graph.node(slot).map(|node| node.submap);
        submap.is_some() && submap == self.graph.oldest_submap()
    }

    /// The keyframe that was removed last; each is given once, and none is removed before it was taken.
    pub const fn take_merged(&mut self) -> Option<Merged> {
        self.merged.take()
    }

    /// Pose of the lidar in the map for a scan that [`Slam::update`] placed; `None` where its keyframe was removed (see
    /// [`Slam::take_merged`]). Searches the keyframes.
    #[must_use]
    pub fn pose(&self, placed: &Placed) -> Option<Pose> {
        let mut nodes = self.graph.nodes();
        let (_, node) = nodes.find(|(_, node)| node.id == placed.keyframe)?;
        Some(node.pose * placed.motion)
    }
}
