//! The pipelines behind the lines: mapping with its odometry, and in a world that is known localization as well.

use anyhow::{Context, Result};
use beamfix::geometry::{Pose, Twist};
use beamfix::lidar::{Model, Protocol};
use beamfix::linalg::Covariance;
use beamfix::localization::{Localizer, LocalizerConfig};
use beamfix::matching::correlative::pyramid::Pyramid;
use beamfix::matching::icp::Reference;
use beamfix::pipeline::{Estimate as _, Estimator, MapLocalizer, Mapped, Mapper512k};
use beamfix::pipeline::{Pipeline, Revolution, Verdict};
use beamfix::scan::{Mount, Points, PointsConfig};
use beamfix::sensor_model::likelihood_field::{FieldModel, LikelihoodField};
use beamfix::slam::{SLICE, SlamConfig};
use beamfix_sim::TruePose;
use host_tests::decode::{WithParser, with_parser};
use host_tests::formats::capture::Piece;
use host_tests::formats::field::of_map;
use host_tests::formats::ros_map;
use host_tests::pipeline::{Pieces, config, is_measured};
use host_tests::report::hash::PoseHash;
use host_tests::size;

use crate::live::Live;
use crate::replay::{Next, Replay};

/// Room for the beams of a revolution: a recording's poses do not depend on it.
pub const BEAMS: usize = 1024;
/// Points with which places are searched.
const POINTS: usize = 96;
/// Bytes that the search for a lost robot looks up for each picture: a tenth of a Cortex-M4F's time.
const LOOKUPS: u32 = 300_000;

type Mapping = Mapper512k;
type Locating = MapLocalizer<'static, BEAMS, POINTS>;
type Boxed<E> = Box<dyn Pieces<E, BEAMS>>;

/// Where the bytes are from.
enum Source {
    Live(Box<Live>),
    Replay(Box<Replay>),
}

/// Where the last revolution puts the robot.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    pub pose: Pose,
    pub covariance: Option<Covariance>,
    pub verdict: Verdict,
}

/// A scan's points, and the scan that it is matched to.
pub struct Scans {
    pub mount: Mount,
    /// In the lidar's frame.
    pub points: Box<Points<BEAMS>>,
    /// The lidar's keyframe: its lines, its points, and where it was by odometry.
    pub reference: Box<Reference<BEAMS>>,
    pub reference_points: Box<Points<BEAMS>>,
    pub reference_pose: Pose,
}

/// All that is known of a robot.
pub struct Twin {
    source: Source,
    mapper: Boxed<Mapping>,
    locator: Option<Boxed<Locating>>,
    pub field: Option<LikelihoodField<&'static [u8]>>,
    pub seen: Seen,
    /// Odometry's start in the world, where that is known.
    pub start: TruePose,
}

/// What came of the revolutions so far.
pub struct Seen {
    pub scans: Scans,
    pub hash: PoseHash,
    pub count: usize,
    pub refused: usize,
    pub keyframes: usize,
    /// By odometry, in its own frame.
    pub odometry: Found,
    /// By the map that is being made.
    pub mapped: Pose,
    /// In the world's map.
    pub located: Option<Found>,
    last_end_us: Option<u32>,
    /// A line for each of truth, odometry, localization: places, and not a number where one ends.
    pub trails: [Vec<[f32; 2]>; 3],
}

/// Makes a pipeline for a lidar.
struct Make<E>(E);

impl<E: Estimator<BEAMS> + 'static> WithParser for Make<E> {
    type Output = Boxed<E>;

    fn run<P: Protocol + 'static>(self, parser: P) -> Boxed<E> {
        Box::new(Pipeline::new(parser, self.0))
    }
}

impl Twin {
    /// Of a robot that is driven by hand.
    pub fn drive(live: Live) -> Result<Self> {
        let robot_from_lidar = Pose::from(live.settings.mount);
        let mount = Mount {
            robot_from_lidar,
            ..Mount::DEFAULT
        };
        let field = field(&live)?;
        let buffer = vec![0; Pyramid::bytes(field.grid().shape())].leak();
        let pyramid = Pyramid::new(field, buffer).context("the search's table")?;
        let localizer = Localizer::new(pyramid, LocalizerConfig::DEFAULT);
        let points = PointsConfig {
            mount,
            ..PointsConfig::DEFAULT
        };
        let locator = Locating::new(localizer, points);
        let (model, start) = (live.model, live.underway.robot.pose);
        let mut twin = Self::new(Source::Live(Box::new(live)), model, mount, start);
        twin.locator = Some(with_parser(model, Make(locator)));
        twin.field = Some(field);
        Ok(twin)
    }

    /// Of a recording.
    pub fn replay(replay: Replay) -> Result<Self> {
        let (model, mount) = (replay.model(), replay.log.mount);
        Ok(Self::new(
            Source::Replay(Box::new(replay)),
            model,
            mount,
            TruePose::default(),
        ))
    }

    fn new(source: Source, model: &Model, mount: Mount, start: TruePose) -> Self {
        let directions = match &source {
            Source::Live(live) => size::of_model(live.model),
            Source::Replay(replay) => replay.directions,
        };
        let mapper = Mapping::new(config(mount, directions), SlamConfig::DEFAULT);
        Self {
            source,
            mapper: with_parser(model, Make(mapper)),
            locator: None,
            field: None,
            seen: Seen::new(mount),
            start,
        }
    }

    /// Drives on.
    pub fn advance(&mut self, seconds: f64, aim: (f64, f64)) {
        let Self {
            source: Source::Live(live),
            mapper,
            locator,
            seen,
            start,
            ..
        } = self
        else {
            return;
        };
        let (mut count, before) = (seen.count, seen.count);
        let advanced = live.advance(seconds, aim, &mut |time_us, content| {
            let piece = Piece {
                time_us: Some(time_us),
                content,
            };
            let is_any = mapper.take(&piece, true, &mut |revolution| seen.mapped(&revolution));
            if is_any {
                // What can wait is done between two revolutions.
                mapper.estimator().work(SLICE);
            }
            if let Some(locator) = locator {
                locator.take(&piece, true, &mut |revolution| {
                    seen.located = Some(Found {
                        pose: revolution.step.pose.unwrap_or(Pose::IDENTITY),
                        covariance: revolution.step.covariance,
                        verdict: revolution.step.verdict(),
                    });
                });
            }
            count = seen.count;
        });
        // Memory takes all that is written.
        debug_assert!(advanced.is_ok());
        if let Some(locator) = locator {
            locator.estimator().work(LOOKUPS);
        }
        if count == before {
            return;
        }
        let truth = live.underway.robot.pose;
        if before == 0 {
            *start = truth;
        }
        let by_odometry = start.then(seen.odometry.pose.into());
        let located = seen
            .located
            .filter(|found| found.verdict == Verdict::Measured);
        let places = [
            Some(truth),
            Some(by_odometry),
            located.map(|found| found.pose.into()),
        ];
        for (trail, place) in seen.trails.iter_mut().zip(places) {
            trail.push(place.map_or([f32::NAN; 2], |pose| [pose.x as f32, pose.y as f32]));
        }
    }

    /// Replays up to so many scans; gives how many are left.
    pub fn step(&mut self, scans: usize) -> usize {
        let Self {
            source: Source::Replay(replay),
            mapper,
            seen,
            ..
        } = self
        else {
            return 0;
        };
        let until = (seen.count + scans).min(replay.log.scans.len());
        let is_left = seen.count < until
            && replay.go_on(&mut |next| {
                // A piece may complete several revolutions: as the tool does, no more than are asked for.
                let mut take = |revolution: Revolution<'_, Mapping, BEAMS>| {
                    if seen.count < until {
                        seen.mapped(&revolution);
                        let Pose { x, y, .. } = seen.odometry.pose;
                        seen.trails[1].push([x, y]);
                    }
                };
                match next {
                    Next::Piece(piece) => {
                        mapper.take(&piece, true, &mut take);
                    }
                    Next::Scan(recorded) => mapper.take_scan(recorded, &mut take),
                }
                mapper.estimator().work(SLICE);
                seen.count < until
            });
        if !is_left && seen.count < until {
            mapper.end(&mut |revolution| {
                if seen.count < until {
                    seen.mapped(&revolution);
                }
            });
            return 0;
        }
        replay.log.scans.len() - seen.count
    }

    /// Puts the robot elsewhere, unless something stands there.
    pub fn carry(&mut self, pose: TruePose) -> bool {
        match &mut self.source {
            Source::Live(live) => live.carry(pose),
            Source::Replay(_) => false,
        }
    }

    /// Puts the robot at some free place.
    pub fn kidnap(&mut self) {
        if let Source::Live(live) = &mut self.source {
            live.kidnap();
        }
    }

    /// The drive so far, for `beamfix replay`.
    pub fn recording(&self) -> Option<Vec<u8>> {
        self.live().map(Live::recording)
    }

    /// The simulated robot, where it is no recording.
    pub fn live(&self) -> Option<&Live> {
        match &self.source {
            Source::Live(live) => Some(live),
            Source::Replay(_) => None,
        }
    }

    /// The recording, where it is one.
    pub fn recorded(&self) -> Option<&Replay> {
        match &self.source {
            Source::Live(_) => None,
            Source::Replay(replay) => Some(replay),
        }
    }

    /// The map that is being made.
    pub fn mapper(&mut self) -> &mut Mapping {
        self.mapper.estimator()
    }

    /// Times the robot was lost in the world's map, and bytes looked up to find it.
    pub fn searches(&mut self) -> Option<(u32, u64)> {
        let counters = self.locator.as_mut()?.estimator().localizer().counters();
        Some((counters.lost, counters.lookups))
    }
}

impl Seen {
    fn new(mount: Mount) -> Self {
        let start = Found {
            pose: Pose::IDENTITY,
            covariance: None,
            verdict: Verdict::Unknown,
        };
        Self {
            scans: Scans {
                mount,
                points: Box::new(Points::new()),
                reference: Box::new(Reference::new()),
                reference_points: Box::new(Points::new()),
                reference_pose: Pose::IDENTITY,
            },
            hash: PoseHash::new(),
            count: 0,
            refused: 0,
            keyframes: 0,
            odometry: start,
            mapped: Pose::IDENTITY,
            located: None,
            last_end_us: None,
            trails: [const { Vec::new() }; 3],
        }
    }

    /// Takes a revolution of the mapping pipeline.
    fn mapped(&mut self, revolution: &Revolution<'_, Mapping, BEAMS>) {
        let Mapped { pose, odometry, .. } = revolution.step;
        let (before, end_us) = (self.odometry.pose, revolution.scan.end_us());
        let last_us = self.last_end_us.replace(end_us);
        let twist = last_us.map_or(Twist::ZERO, |last_us| {
            let seconds = end_us.wrapping_sub(last_us) as f32 * 1e-6;
            Twist::from_motion(before.between(odometry.pose), seconds)
        });
        self.hash.push(odometry.pose);
        self.count += 1;
        self.mapped = *pose;
        self.refused += usize::from(!is_measured(odometry));
        self.odometry = Found {
            pose: odometry.pose,
            covariance: Some(odometry.covariance),
            verdict: odometry.verdict(),
        };
        let scans = &mut self.scans;
        let config = PointsConfig {
            mount: scans.mount,
            ..PointsConfig::DEFAULT
        };
        scans.points.assign(revolution.scan, twist, &config);
        if odometry.keyframe {
            self.keyframes += 1;
            scans.reference.assign(scans.points.as_slice());
            scans.reference_points.clone_from(&scans.points);
            scans.reference_pose = odometry.pose;
        }
    }
}

/// Largest number of cells of a world's map.
const MOST_CELLS: f64 = 1.2e6;

/// The likelihood field of the world that the robot drives through; an instance has one, which stays until its end.
fn field(live: &Live) -> Result<LikelihoodField<&'static [u8]>> {
    let (low, high) = live.underway.world.extent();
    let area = (high[0] - low[0]) * (high[1] - low[1]);
    // Cells of 5 cm, larger ones in a large world.
    let resolution = [0.05, 0.1, 0.2]
        .into_iter()
        .find(|cell| area < MOST_CELLS * cell * cell)
        .unwrap_or(0.4);
    let robot = live.underway.robot.pose;
    let map = ros_map::of_world(
        &live.underway.world,
        low.map(|side| side - 3.0 * resolution),
        high.map(|side| side + 3.0 * resolution),
        resolution as f32,
        [robot.x, robot.y],
    )?;
    let made: &'static LikelihoodField<Vec<u8>> =
        Box::leak(Box::new(of_map(&map, &FieldModel::DEFAULT)?));
    Ok(made.as_slice())
}
