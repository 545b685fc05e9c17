//! Odometry and SLAM over a log, in the memory of a tier: a pose for every scan by its keyframe's last pose.

pub mod building;

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use beamfix::geometry::{EgoMotion, Pose};
use beamfix::grid::occupancy::{self, UpdateConfig};
use beamfix::grid::{Grid, Shape};
use beamfix::odometry::OdometryConfig;
use beamfix::pipeline::{Estimator, Mapped, Mapper, Mapper64k, Mapper192k, Mapper512k, Tracker};
use beamfix::scan::Scan;
use beamfix::slam::{Counters, Merged, Placed, SLICE, Slam, SlamConfig};
use beamfix_sim::Noise;

use crate::formats::Log;
use crate::pipeline::{config, follow, is_measured};
use crate::size;

/// The memory configurations that map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tier {
    /// [`Mapper64k`]: a map that rolls with the robot, without loops.
    Of64k,
    /// [`Mapper192k`].
    Of192k,
    /// [`Mapper512k`].
    Of512k,
}

/// What is replayed and how.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The memory configuration.
    pub tier: Tier,
    /// Of the odometry.
    pub odometry: OdometryConfig,
    /// Of the map.
    pub slam: SlamConfig,
    /// Scans, and whether the log's wheels and gyroscope are taken.
    pub scans: (usize, bool),
    /// Most keyframes and which go, where it is not the memory that decides.
    pub pruning: Option<(usize, Pruning)>,
    /// Size of a cell (m) of the map that is drawn in the end.
    pub resolution: Option<f32>,
}

impl Settings {
    /// Of a whole log with its wheels, in the largest tier; the map is drawn in cells of 5 cm.
    #[must_use]
    pub fn of_all(log: &Log, pruning: Option<(usize, Pruning)>) -> Self {
        let directions = size::fitting(log.scans.iter().map(|scan| &scan.beams[..]));
        Self {
            tier: Tier::Of512k,
            odometry: config(log.mount, directions),
            slam: SlamConfig::DEFAULT,
            scans: (log.scans.len(), true),
            pruning,
            resolution: Some(0.05),
        }
    }
}

/// Which keyframe goes where there are too many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pruning {
    /// The one that tells least about the map.
    Information,
    /// Every second one in the order of time, round and round.
    Alternate,
    /// Any, by this seed.
    Random(u64),
}

/// What came of a log.
#[derive(Default)]
pub struct Map {
    /// Every scan.
    pub scans: Vec<MappedScan>,
    /// Keyframes that are left: number and the lidar's pose.
    pub keyframes: Vec<(u32, Pose)>,
    /// Of the map.
    pub counters: Counters,
    /// Bytes of the map alone, and of all that the tier keeps.
    pub bytes: (usize, usize),
    /// Drawn from the keyframes.
    pub grid: Option<Grid<Vec<u8>>>,
    /// Beams without room.
    pub refused_beams: u32,
}

/// A scan and where it is.
#[derive(Debug)]
pub struct MappedScan {
    /// Its time stamp in the log.
    pub stamp: String,
    /// The robot, as the map told when the scan came in.
    pub online: Pose,
    /// The robot by the map in the end.
    pub pose: Pose,
    /// Whether a match of the odometry gave the pose, or it is the first; and it is in the map in the end, not in a submap
    /// of a robot that was carried.
    pub is_measured: bool,
    /// Whether the robot was in the map when the scan came in.
    pub is_located: bool,
}

/// Replays a log; `tick` is called for each scan.
pub fn run(log: &Log, settings: &Settings, tick: &mut dyn FnMut()) -> Result<Map> {
    match settings.tier {
        Tier::Of64k => rolling(log, settings, tick),
        Tier::Of192k => replay(
            log,
            settings,
            Box::new(Mapper192k::new(settings.odometry, settings.slam)),
            tick,
        ),
        Tier::Of512k => replay(
            log,
            settings,
            Box::new(Mapper512k::new(settings.odometry, settings.slam)),
            tick,
        ),
    }
}

/// Replays a log through the rolling map: its poses stay as they come.
fn rolling(log: &Log, settings: &Settings, tick: &mut dyn FnMut()) -> Result<Map> {
    let mut map = Map::default();
    let mapper = Mapper64k::new(settings.odometry);
    let followed = follow::<_, 512>(log, settings.scans, mapper, &mut |scan, pose, step| {
        tick();
        map.scans.push(MappedScan {
            stamp: scan.stamp.clone(),
            online: pose,
            is_located: true,
            pose,
            is_measured: step.is_measured(),
        });
        Ok(())
    })?;
    map.refused_beams = followed.refused_beams;
    let bytes = size_of::<Tracker<Mapper64k, 512>>();
    map.bytes = (bytes, bytes);
    Ok(map)
}

/// A mapper that remembers where scans were placed and which keyframes were merged into which.
struct Remembering<
    const N: usize,
    const K: usize,
    const E: usize,
    const L: usize,
    const B: usize,
    const V: usize,
> {
    mapper: Box<Mapper<N, K, E, L, B, V>>,
    merged: BTreeMap<u32, (u32, Pose)>,
    pruning: Option<(usize, Pruning)>,
    noise: Noise,
    /// Number of the keyframe that went last.
    gone: u32,
}

impl<const N: usize, const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Remembering<N, K, E, L, B, V>
{
    /// A slice of work; whether there is more.
    fn step(&mut self) -> bool {
        let slam: &mut Slam<K, E, L, B, V> = self.mapper.slam_mut();
        let more = slam.step(SLICE);
        self.merged.extend(slam.take_merged().map(entry));
        more
    }

    /// Removes a keyframe where there are more than are wanted.
    fn prune(&mut self) {
        let Some((most, pruning)) = self.pruning else {
            return;
        };
        let slam: &mut Slam<K, E, L, B, V> = self.mapper.slam_mut();
        if slam.graph().len() <= most {
            return;
        }
        let id = |slot: u16| slam.graph().node(slot).map_or(0, |node| node.id);
        let slot = match pruning {
            Pruning::Information => slam.least_informative(),
            Pruning::Alternate => {
                let mut order: Vec<u16> = slam.removable().collect();
                order.sort_by_key(|&slot| id(slot));
                let after = order.partition_point(|&slot| id(slot) <= self.gone);
                order.get(after + 1).or(order.first()).copied()
            }
            Pruning::Random(_) => {
                let order: Vec<u16> = slam.removable().collect();
                let at = self.noise.even(0.0, order.len() as f64) as usize;
                order.get(at).copied()
            }
        };
        let removed = slot.and_then(|slot| slam.remove(slot));
        self.gone = removed.map_or(self.gone, |removed| removed.gone);
        self.merged.extend(removed.map(entry));
    }

    /// A place in the frame of a keyframe that is left.
    fn followed(&self, placed: Placed) -> Placed {
        let Placed {
            mut keyframe,
            mut motion,
        } = placed;
        while let Some((into, between)) = self.merged.get(&keyframe) {
            (keyframe, motion) = (*into, *between * motion);
        }
        Placed { keyframe, motion }
    }
}

impl<const N: usize, const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Estimator<N> for Remembering<N, K, E, L, B, V>
{
    type Step = Mapped;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Mapped {
        let step = self.mapper.update(scan, ego);
        self.step();
        self.prune();
        step
    }
}

fn replay<
    const N: usize,
    const K: usize,
    const E: usize,
    const L: usize,
    const B: usize,
    const V: usize,
>(
    log: &Log,
    settings: &Settings,
    mapper: Box<Mapper<N, K, E, L, B, V>>,
    tick: &mut dyn FnMut(),
) -> Result<Map> {
    let mut map = Map::default();
    let mut places = Vec::new();
    let seed = match settings.pruning {
        Some((_, Pruning::Random(seed))) => seed,
        _ => 0,
    };
    let estimator = Remembering {
        mapper,
        merged: BTreeMap::new(),
        pruning: settings.pruning,
        noise: Noise::new(seed, 1),
        gone: 0,
    };
    let followed = follow(log, settings.scans, estimator, &mut |scan, pose, step| {
        tick();
        places.push(step.placed);
        map.scans.push(MappedScan {
            stamp: scan.stamp.clone(),
            online: pose,
            is_located: step.is_located,
            pose: step.odometry.pose,
            is_measured: is_measured(&step.odometry),
        });
        Ok(())
    })?;
    map.refused_beams = followed.refused_beams;
    let mut estimator = followed.estimator;
    while estimator.step() {}
    let slam = estimator.mapper.slam();
    let robot_from_lidar = settings.odometry.points.mount.robot_from_lidar;
    for (scan, placed) in map.scans.iter_mut().zip(places) {
        // Before the first keyframe there is nothing but odometry.
        let placed = placed.map(|placed| estimator.followed(placed));
        let is_in_map = |placed: Placed| {
            let mut nodes = slam.graph().nodes();
            nodes.any(|(slot, node)| node.id == placed.keyframe && slam.is_in_map(slot))
        };
        scan.is_measured &= placed.map_or(scan.is_located, is_in_map);
        if let Some(lidar) = placed.and_then(|placed| slam.pose(&placed)) {
            scan.pose = lidar * robot_from_lidar.inverse();
        }
    }
    map.keyframes = slam
        .graph()
        .nodes()
        .map(|(_, node)| (node.id, node.pose))
        .collect();
    map.counters = slam.counters();
    map.bytes = (
        size_of_val(slam),
        size_of::<Tracker<Mapper<N, K, E, L, B, V>, N>>(),
    );
    map.grid = settings
        .resolution
        .map(|resolution| drawn(estimator.mapper.slam_mut(), resolution))
        .transpose()?;
    Ok(map)
}

/// A removed keyframe, and what it was merged into.
fn entry(merged: Merged) -> (u32, (u32, Pose)) {
    (merged.gone, (merged.into, merged.motion))
}

/// Farthest that a beam makes cells free or occupied (m): what lies farther is drawn by keyframes that are nearer.
const DRAWN: f32 = 12.0;

/// The occupancy grid of all keyframes, a slot at a time as a board would draw it.
pub fn drawn<const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>(
    slam: &mut Slam<K, E, L, B, V>,
    resolution: f32,
) -> Result<Grid<Vec<u8>>> {
    let (low, high) = slam.extent(DRAWN).context("no keyframe to draw")?;
    let cells = |length: f32| (length / resolution).ceil() as u32 + 3;
    let corner = Pose::new(low.x - resolution, low.y - resolution, 0.0);
    let (width, height) = (cells(high.x - low.x), cells(high.y - low.y));
    let shape = Shape::new(width, height, resolution, corner)?;
    let mut grid = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()])?;
    let config = UpdateConfig {
        max_range: DRAWN,
        ..UpdateConfig::DEFAULT
    };
    for slot in 0..K as u16 {
        slam.draw(slot, &mut grid, &config);
    }
    occupancy::decide(grid.cells_mut());
    Ok(grid)
}
