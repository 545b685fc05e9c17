//! What a run leaves behind: poses, points and errors, and the pictures of them.

use crate::pipeline::places;
use crate::report::picture::{chart::Errors as Chart, colour, map::Map, map::Path};
use crate::report::score;
use beamfix::geometry::{Point, Pose};
use beamfix::scan::Beam;
use beamfix_sim::{TruePose, World};

/// A robot at the end of a scan; all poses in the frame in which it started.
#[derive(Clone, Copy)]
pub struct At {
    /// Since the start (s).
    pub time: f64,
    /// Where the pipeline puts it.
    pub estimate: Pose,
    /// Where it really was, if anybody knows.
    pub truth: Option<Pose>,
    /// Where its wheels said it was.
    pub wheels: Option<Pose>,
}

/// A run so far.
pub struct Track {
    /// Where the start lies on the picture.
    origin: TruePose,
    robot_from_lidar: Pose,
    /// Every so many scans are drawn.
    drawn: usize,
    at: Vec<At>,
    points: Vec<[f64; 2]>,
}

/// Errors in metres and degrees.
#[derive(Default)]
pub struct Errors {
    /// At the last scan.
    pub last: (f64, f64),
    /// The largest of all scans, distance and angle each on its own.
    pub largest: (f64, f64),
    /// Of the wheels' pose at the last scan.
    pub wheels: (f64, f64),
}

impl Track {
    /// Nothing yet; every `drawn`-th scan will be drawn.
    pub fn new(origin: TruePose, robot_from_lidar: Pose, drawn: usize) -> Self {
        Self {
            origin,
            robot_from_lidar,
            drawn,
            at: Vec::new(),
            points: Vec::new(),
        }
    }

    /// Takes a scan in; gives its points in the robot's frame.
    pub fn push(&mut self, at: At, beams: &[Beam]) -> Vec<Point> {
        let before = self.at.last();
        let motion = before.map_or(Pose::IDENTITY, |before| {
            before.estimate.between(at.estimate)
        });
        let seconds = before.map_or(0.0, |before| (at.time - before.time) as f32);
        let points = places(beams, motion, seconds, self.robot_from_lidar);
        if self.at.len().is_multiple_of(self.drawn.max(1)) {
            let placed = points
                .iter()
                .map(|&point| self.on_picture(at.estimate * point));
            self.points.extend(placed.collect::<Vec<_>>());
        }
        self.at.push(at);
        points
    }

    /// Of the estimates against the truth.
    pub fn errors(&self) -> Errors {
        let mut errors = Errors::default();
        for at in &self.at {
            let Some(truth) = at.truth else { continue };
            errors.last = score::error(at.estimate, truth);
            errors.largest.0 = errors.largest.0.max(errors.last.0);
            errors.largest.1 = errors.largest.1.max(errors.last.1);
            errors.wheels = at
                .wheels
                .map_or((0.0, 0.0), |wheels| score::error(wheels, truth));
        }
        errors
    }

    /// The picture from above.
    pub fn map(&self, title: String, caption: String, world: Option<World>) -> Map {
        let paths = [
            self.path("wheel odometry alone", colour::ORANGE, 2, |at| at.wheels),
            self.path("true path", colour::GREEN, 6, |at| at.truth),
            self.path("estimated path", colour::RED, 2, |at| Some(at.estimate)),
        ];
        let paths = paths
            .into_iter()
            .filter(|path| !path.places.is_empty())
            .collect();
        Map {
            title,
            caption,
            world,
            points: self.points.clone(),
            paths,
        }
    }

    /// The errors over time.
    pub fn chart(&self, title: String) -> Chart {
        let error = |at: &At| {
            let (metres, degrees) = score::error(at.estimate, at.truth?);
            Some((at.time, 100.0 * metres, degrees))
        };
        Chart {
            title,
            errors: self.at.iter().filter_map(error).collect(),
        }
    }

    fn on_picture(&self, point: Point) -> [f64; 2] {
        let place = self
            .origin
            .then(TruePose::new(f64::from(point.x), f64::from(point.y), 0.0));
        [place.x, place.y]
    }

    fn path(
        &self,
        name: &str,
        colour: colour::Colour,
        width: u32,
        pose: impl Fn(&At) -> Option<Pose>,
    ) -> Path {
        let places = self
            .at
            .iter()
            .filter_map(pose)
            .map(|pose| self.on_picture(Point::new(pose.x, pose.y)));
        Path {
            name: name.to_owned(),
            colour,
            width,
            places: places.collect(),
        }
    }
}
