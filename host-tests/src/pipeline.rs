//! The library's pipeline over logs, with the counts and the hash that a report needs.

use anyhow::Result;
use beamfix::geometry::{Point, Pose, Twist};
use beamfix::lidar::Protocol;
use beamfix::odometry::{
    Counters, Odometry, OdometryConfig, Refusal, SparseConfig, SparseOdometry, Step,
};
use beamfix::pipeline::{Estimate, Estimator, Pipeline as Bytes, Revolution, Tracker};
use beamfix::scan::{Beam, Mount};

use crate::decode::{WithParser, with_parser};
use crate::formats::capture::{self, Content, Piece};
use crate::formats::{Log, Recorded};
use crate::report::hash::PoseHash;
use crate::size;

/// What an estimator may look up between two scans (bytes): a fifth of a second of an M4F at 168 MHz.
const BUDGET: u32 = 10_000_000;

/// Whether a pose is more than a guess: a match confirms it, or it is the first reference's. A scan before that, which could become
/// none, has no pose of its own.
#[must_use]
pub fn is_measured(step: &Step) -> bool {
    step.outcome.is_ok() || step.keyframe && step.outcome == Err(Refusal::First)
}

/// The odometry's settings for a lidar that sits on the robot like this, with so many directions.
#[must_use]
pub fn config(mount: Mount, directions: usize) -> OdometryConfig {
    OdometryConfig {
        directions: directions as u16,
        ..OdometryConfig::DEFAULT.with_mount(mount)
    }
}

/// Odometry for a ring of rangers whose beams are so wide (rad).
#[must_use]
pub fn sparse_odometry(
    mount: Mount,
    beam_width: f32,
) -> SparseOdometry<{ size::SPARSE }, { size::GATHERED }> {
    SparseOdometry::new(SparseConfig {
        mount,
        beam_width,
        ..SparseConfig::DEFAULT
    })
}

/// What came of a log.
pub struct Followed<E> {
    /// The estimator at the end.
    pub estimator: E,
    /// Scans.
    pub scans: usize,
    /// Beams that found no room because a scan had more than N, or that were interrupted.
    pub refused_beams: u32,
    /// Over all poses.
    pub hash: PoseHash,
    /// The last pose.
    pub last: Pose,
}

impl<E> Followed<E> {
    /// The same with what is of interest of the estimator.
    pub fn map<F>(self, of: impl FnOnce(E) -> F) -> Followed<F> {
        Followed {
            estimator: of(self.estimator),
            scans: self.scans,
            refused_beams: self.refused_beams,
            hash: self.hash,
            last: self.last,
        }
    }
}

/// Gets each scan, the pose after it (the last one again where there is none), and what the estimator says.
pub type Sink<'a, S> = dyn FnMut(&Recorded, Pose, &S) -> Result<()> + 'a;

/// Runs the first `scans` scans of a log through `estimator`: a capture's bytes as a board gets them, else scan by scan.
///
/// `sink` gets each scan, the pose (the last one again where there is none), and what the estimator says. Without
/// `ego` wheels and gyroscope are left out.
pub fn follow<E: Estimator<N>, const N: usize>(
    log: &Log,
    (scans, ego): (usize, bool),
    estimator: E,
    sink: &mut Sink<'_, E::Step>,
) -> Result<Followed<E>> {
    let mut following = Following {
        log,
        scans,
        ego,
        sink,
        number: 0,
        hash: PoseHash::new(),
        last: Pose::IDENTITY,
        error: None,
    };
    let ended = match &log.capture {
        Some(capture) => with_parser(
            capture.model,
            FromBytes {
                bytes: &capture.bytes,
                estimator,
                following,
            },
        ),
        None => {
            let mut tracker = Box::new(Tracker::new(estimator));
            following.by_scans(&mut tracker);
            following.end(*tracker)
        }
    };
    let (followed, error) = ended;
    error.map_or(Ok(followed), Err)
}

/// A log on its way through an estimator.
struct Following<'a, E: Estimator<N>, const N: usize> {
    log: &'a Log,
    scans: usize,
    ego: bool,
    sink: &'a mut Sink<'a, E::Step>,
    number: usize,
    hash: PoseHash,
    last: Pose,
    error: Option<anyhow::Error>,
}

impl<E: Estimator<N>, const N: usize> Following<'_, E, N> {
    fn is_done(&self) -> bool {
        self.number >= self.scans || self.error.is_some()
    }

    fn take(&mut self, step: &E::Step) {
        if self.is_done() {
            return;
        }
        let Some(recorded) = self.log.scans.get(self.number) else {
            return;
        };
        self.number += 1;
        self.last = step.pose().unwrap_or(self.last);
        self.hash.push(self.last);
        self.error = (self.sink)(recorded, self.last, step).err();
    }

    fn by_scans(&mut self, tracker: &mut Tracker<E, N>) {
        for recorded in &self.log.scans {
            if self.is_done() {
                return;
            }
            let wheels = recorded.wheels.filter(|_| self.ego);
            push_scan(tracker, &recorded.beams, wheels, |revolution| {
                self.take(revolution.step);
            });
            tracker.estimator_mut().work(BUDGET);
        }
    }

    fn end(self, tracker: Tracker<E, N>) -> (Followed<E>, Option<anyhow::Error>) {
        let followed = Followed {
            refused_beams: tracker.refused_beams(),
            estimator: tracker.into_estimator(),
            scans: self.number,
            hash: self.hash,
            last: self.last,
        };
        (followed, self.error)
    }
}

/// A whole scan, and the wheels at its end.
pub(crate) fn push_scan<E: Estimator<N>, const N: usize>(
    tracker: &mut Tracker<E, N>,
    beams: &[Beam],
    wheels: Option<Pose>,
    ready: impl FnMut(Revolution<'_, E, N>),
) {
    // Arrays may be reversed or interleaved: the latest beam need not be the last.
    let first = beams.first().map_or(0, |beam| beam.time_us);
    let latest = beams
        .iter()
        .max_by_key(|beam| beam.time_us.wrapping_sub(first).cast_signed());
    if let (Some(wheels), Some(latest)) = (wheels, latest) {
        tracker.push_wheels(latest.time_us, wheels);
    }
    tracker.push_scan(beams.iter().copied(), ready);
}

/// Gets each revolution.
pub type Ready<'a, E, const N: usize> = dyn FnMut(Revolution<'_, E, N>) + 'a;

/// A [`Bytes`] whatever its lidar: a capture goes in piece by piece.
pub trait Pieces<E: Estimator<N>, const N: usize> {
    /// Takes what came in together; true where that completed a revolution. Without `ego` wheels and gyroscope are left
    /// out.
    fn take(&mut self, piece: &Piece<'_>, ego: bool, ready: &mut Ready<'_, E, N>) -> bool;

    /// Takes a whole scan of a log that has no bytes, and the wheels at its end.
    fn take_scan(&mut self, recorded: &Recorded, ready: &mut Ready<'_, E, N>);

    /// Takes the packets that the parser has held back: for the end of a capture.
    fn end(&mut self, ready: &mut Ready<'_, E, N>);

    /// The estimator.
    fn estimator(&mut self) -> &mut E;
}

impl<P: Protocol, E: Estimator<N>, const N: usize> Pieces<E, N> for Bytes<P, E, N> {
    fn take(&mut self, piece: &Piece<'_>, ego: bool, ready: &mut Ready<'_, E, N>) -> bool {
        let time_us = piece.time_us.map(|time_us| time_us as u32);
        let mut is_any = false;
        match (piece.content, time_us) {
            (Content::Bytes(bytes), _) => {
                if let Some(time_us) = time_us {
                    self.set_time(time_us);
                }
                self.push(bytes, &mut |revolution: Revolution<'_, E, N>| {
                    is_any = true;
                    ready(revolution);
                });
            }
            (Content::Zero(zero_cdeg), _) => self.lidar_mut().set_zero(zero_cdeg),
            (Content::Wheels(pose), Some(time_us)) if ego => {
                self.tracker_mut().push_wheels(time_us, pose);
            }
            (Content::Gyro(rate), Some(time_us)) if ego => {
                self.tracker_mut().push_gyro(time_us, rate);
            }
            _ => {}
        }
        is_any
    }

    fn take_scan(&mut self, recorded: &Recorded, ready: &mut Ready<'_, E, N>) {
        push_scan(self.tracker_mut(), &recorded.beams, recorded.wheels, ready);
    }

    fn end(&mut self, ready: &mut Ready<'_, E, N>) {
        self.finish(&mut |revolution: Revolution<'_, E, N>| ready(revolution));
    }

    fn estimator(&mut self) -> &mut E {
        self.tracker_mut().estimator_mut()
    }
}

/// A capture on its way through a lidar's parser and an estimator.
struct FromBytes<'a, E: Estimator<N>, const N: usize> {
    bytes: &'a [u8],
    estimator: E,
    following: Following<'a, E, N>,
}

impl<E: Estimator<N>, const N: usize> WithParser for FromBytes<'_, E, N> {
    type Output = (Followed<E>, Option<anyhow::Error>);

    fn run<P: Protocol>(self, parser: P) -> Self::Output {
        let Self {
            bytes,
            estimator,
            mut following,
        } = self;
        let mut pipeline = Box::new(Bytes::new(parser, estimator));
        for piece in capture::pieces(bytes) {
            if following.is_done() {
                break;
            }
            let ego = following.ego;
            let mut take = |revolution: Revolution<'_, E, N>| following.take(revolution.step);
            if pipeline.take(&piece, ego, &mut take) {
                pipeline.tracker_mut().estimator_mut().work(BUDGET);
            }
        }
        pipeline.finish(&mut |revolution: Revolution<'_, E, N>| following.take(revolution.step));
        following.end(pipeline.into_tracker())
    }
}

/// Odometry over a sequence of scans, with its books.
pub struct Pipeline<const N: usize> {
    tracker: Tracker<Odometry<N>, N>,
    /// Over all poses so far.
    pub hash: PoseHash,
}

impl<const N: usize> Pipeline<N> {
    /// Before the first scan, with N directions. On the heap: a few scans are too much for a thread's stack in debug
    /// builds.
    #[must_use]
    pub fn new(config: OdometryConfig) -> Box<Self> {
        let config = OdometryConfig {
            directions: N as u16,
            ..config
        };
        Box::new(Self {
            tracker: Tracker::new(Odometry::new(config)),
            hash: PoseHash::new(),
        })
    }

    /// What happened so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.tracker.estimator().counters()
    }

    /// Beams that found no room because a scan had more than N.
    #[must_use]
    pub fn refused_beams(&self) -> u32 {
        self.tracker.refused_beams()
    }

    /// Takes the next scan; `wheels` is the robot's pose by wheel odometry at its end.
    pub fn step(&mut self, beams: &[Beam], wheels: Option<Pose>) -> Step {
        let mut step = None;
        push_scan(&mut self.tracker, beams, wheels, |revolution| {
            step = Some(*revolution.step);
        });
        let step = step.expect("a whole scan gives a step");
        self.hash.push(step.pose);
        step
    }
}

/// Places hit by `beams` in the robot's frame at the last one, the robot having moved by `motion` in the last `seconds`.
///
/// For pictures: the matcher has its own, in integers.
#[must_use]
pub fn places(beams: &[Beam], motion: Pose, seconds: f32, robot_from_lidar: Pose) -> Vec<Point> {
    let twist = Twist::from_motion(motion, seconds);
    let end_us = beams.last().map_or(0, |beam| beam.time_us);
    let place = |beam: &Beam| {
        let range = beam.range.metres().ok()?;
        let (s, c) = beamfix::math::sin_cos(beam.bearing.radians());
        let age = end_us.wrapping_sub(beam.time_us) as f32 * 1e-6;
        // Where a log's times are closer together than a revolution is long, the motion is all that is known.
        let age = if age < seconds { age } else { seconds };
        let end_from_then = twist.displacement(-age);
        Some(end_from_then * (robot_from_lidar * Point::new(range * c, range * s)))
    };
    beams.iter().filter_map(place).collect()
}
