//! What a run leaves behind: poses, points and errors, and the pictures of them.

use crate::formats::ros_map::Map as Grid;
use crate::pipeline::places;
use crate::report::picture::axes::ellipse;
use crate::report::picture::chart::{Errors as Chart, Row};
use crate::report::picture::{colour, map::Ellipses, map::Map, map::Path};
use crate::report::score;
use beamfix::geometry::{Point, Pose};
use beamfix::grid::Shape;
use beamfix::grid::occupancy::{self, UpdateConfig};
use beamfix::linalg::Covariance;
use beamfix::scan::{Beam, Bearing, ScanPoint};
use beamfix_sim::{TruePose, World};

/// A robot at the end of a scan; all poses in the frame in which it started, or the map's.
#[derive(Clone, Copy)]
pub struct At {
    /// Since the start (s).
    pub time: f64,
    /// Where the pipeline puts it.
    pub estimate: Pose,
    /// How well that is known, if anybody says.
    pub covariance: Option<Covariance>,
    /// Whether a match confirms the estimate, or it is the first.
    pub is_measured: bool,
    /// Where it really was, if anybody knows.
    pub truth: Option<Pose>,
    /// Where its wheels said it was.
    pub wheels: Option<Pose>,
}

/// Time since the first scan, from a clock of microseconds that overflows.
#[derive(Debug, Default)]
pub struct Elapsed {
    last_us: Option<u32>,
    us: u64,
}

impl Elapsed {
    /// The time (s) at the last of a scan's beams.
    pub fn at(&mut self, beams: &[Beam]) -> f64 {
        if let Some(beam) = beams.last() {
            let before = self.last_us.replace(beam.time_us);
            self.us += before.map_or(0, |before| u64::from(beam.time_us.wrapping_sub(before)));
        }
        self.us as f64 * 1e-6
    }
}

/// A scan that is drawn.
struct Shot {
    /// Which of [`Track::at`] it belongs to.
    index: usize,
    estimate: Pose,
    /// In the robot's frame.
    points: Vec<Point>,
}

/// A run so far.
pub struct Track {
    /// Where the start lies on the picture.
    origin: TruePose,
    robot_from_lidar: Pose,
    /// Every so many scans are drawn.
    drawn: usize,
    at: Vec<At>,
    shots: Vec<Shot>,
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

/// About so many ellipses of covariance are drawn.
const ELLIPSES: usize = 40;
/// How large an ellipse should be, beside the picture's larger side.
const SEEN: f64 = 0.02;
/// Side of a cell of a map of what was seen (m), as map servers have it.
const CELL: f32 = 0.05;
/// Longest side of such a map (cells).
const MAX_CELLS: f64 = 4000.0;

impl Track {
    /// Nothing yet; every `drawn`-th scan will be drawn.
    pub fn new(origin: TruePose, robot_from_lidar: Pose, drawn: usize) -> Self {
        Self {
            origin,
            robot_from_lidar,
            drawn,
            at: Vec::new(),
            shots: Vec::new(),
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
            self.shots.push(Shot {
                index: self.at.len(),
                estimate: at.estimate,
                points: points.clone(),
            });
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
        let placed = |shot: &Shot| -> Vec<[f64; 2]> {
            let points = shot.points.iter();
            points
                .map(|&point| self.on_picture(shot.estimate * point))
                .collect()
        };
        let mut map = Map {
            title,
            caption,
            world,
            points: self.shots.iter().flat_map(placed).collect(),
            paths,
            ellipses: None,
        };
        let (low, high) = map.limits();
        let side = (high[0] - low[0]).max(high[1] - low[1]);
        map.ellipses = self.ellipses(SEEN * side);
        map
    }

    /// Ellipses along the path, at a scale that makes most of them about so large (m).
    fn ellipses(&self, seen: f64) -> Option<Ellipses> {
        let step = self.shots.len().div_ceil(ELLIPSES).max(1);
        let of = |shot: &Shot| {
            let at = self.at.get(shot.index)?;
            let covariance = at.covariance?;
            let size = 2.0 * sigma(covariance);
            (size > 0.0 && size.is_finite()).then_some((at.estimate, covariance, size))
        };
        let chosen: Vec<_> = self.shots.iter().step_by(step).filter_map(of).collect();
        if chosen.is_empty() {
            return None;
        }
        let sizes: Vec<f64> = chosen.iter().map(|(_, _, size)| *size).collect();
        let wanted = seen / score::quantile(&sizes, 0.5);
        let (scale, name) = scaled(wanted);
        // One that is far larger than most says no more than that the robot is lost.
        let drawn = chosen
            .iter()
            .filter(|(_, _, size)| scale * size < 10.0 * seen);
        let shape = |(pose, covariance, _): &(Pose, Covariance, f64)| {
            let centre = [f64::from(pose.x), f64::from(pose.y)];
            let corners = ellipse(centre, *covariance, scale);
            let place = |[x, y]: [f64; 2]| self.on_picture(Point::new(x as f32, y as f32));
            corners.into_iter().map(place).collect()
        };
        Some(Ellipses {
            name,
            shapes: drawn.map(shape).collect(),
        })
    }

    /// Error and standard deviation over time.
    pub fn chart(&self, title: String) -> Chart {
        let row = |at: &At| {
            let error = at.truth.map(|truth| {
                let (metres, degrees) = score::error(at.estimate, truth);
                (100.0 * metres, degrees)
            });
            let stated = at.covariance.map(|covariance| {
                let heading = libm::sqrt(f64::from(covariance.0.tt).max(0.0));
                (100.0 * sigma(covariance), heading.to_degrees())
            });
            Row {
                time: at.time,
                error,
                sigma: stated,
                is_measured: at.is_measured,
            }
        };
        let has_truth = self.at.iter().any(|at| at.truth.is_some());
        let caption = if has_truth {
            "error of the estimate against the truth after every scan, and what the estimate states itself"
        } else {
            "what the estimate states itself after every scan; no truth is known"
        };
        Chart {
            title,
            caption: caption.into(),
            rows: self.at.iter().map(row).collect(),
        }
    }

    /// What is free and what is occupied, by the scans that are drawn; `None` where nothing was seen.
    pub fn grid(&self) -> Option<Grid> {
        let placed = |shot: &Shot| -> Vec<[f64; 2]> {
            let place = |&point: &Point| {
                let place = shot.estimate * point;
                [f64::from(place.x), f64::from(place.y)]
            };
            shot.points.iter().map(place).collect()
        };
        let all: Vec<[f64; 2]> = self.shots.iter().flat_map(placed).collect();
        if all.is_empty() {
            return None;
        }
        let (low, high) = crate::report::picture::axes::bounds(all.into_iter());
        let corner = low.map(|side| side as f32 - 4.0 * CELL);
        let cells = |axis: usize| (high[axis] - low[axis]) / f64::from(CELL) + 9.0;
        if cells(0) > MAX_CELLS || cells(1) > MAX_CELLS {
            return None;
        }
        let origin = Pose::new(corner[0], corner[1], 0.0);
        let shape = Shape::new(cells(0) as u32, cells(1) as u32, CELL, origin).ok()?;
        let mut grid = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()]).ok()?;
        let config = UpdateConfig {
            max_range: 32.0,
            ..UpdateConfig::DEFAULT
        };
        for shot in &self.shots {
            let lidar_from_robot = self.robot_from_lidar.inverse();
            let seen = |&point: &Point| {
                let place = lidar_from_robot * point;
                let bearing = libm::atan2f(place.y, place.x);
                let range = 1e3 * libm::hypotf(place.x, place.y);
                (range < 32_000.0)
                    .then(|| ScanPoint::at(Bearing::from_radians(bearing), range as u16))
            };
            let points: Vec<ScanPoint> = shot.points.iter().filter_map(seen).collect();
            let lidar = shot.estimate * self.robot_from_lidar;
            occupancy::update(&mut grid, lidar, &points, &config);
        }
        Some(grid)
    }

    /// The estimated path where it lies on the picture (m).
    pub fn driven(&self) -> Vec<[f64; 2]> {
        let poses = self.at.iter().map(|at| at.estimate);
        poses
            .map(|pose| self.on_picture(Point::new(pose.x, pose.y)))
            .collect()
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

/// A round scale for ellipses that should be so many times as large as they are, and what it is called.
fn scaled(wanted: f64) -> (f64, String) {
    let scales = [
        0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0,
    ];
    let fits = scales.into_iter().rev().find(|scale| *scale <= wanted);
    let scale = fits.unwrap_or(scales[0]);
    let name = if scale > 1.0 {
        format!("95 % ellipse, {scale} times as large")
    } else if scale < 1.0 {
        format!("95 % ellipse, {:.0} times as small", 1.0 / scale)
    } else {
        "95 % ellipse".into()
    };
    (scale, name)
}

/// Standard deviation of a position in the direction in which it is largest (m).
fn sigma(covariance: Covariance) -> f64 {
    let [xx, xy, yy] = [covariance.0.xx, covariance.0.xy, covariance.0.yy].map(f64::from);
    let half = libm::hypot(0.5 * (xx - yy), xy);
    libm::sqrt((0.5 * (xx + yy) + half).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use beamfix::scan::{Bearing, Range};

    #[test]
    fn ellipses_are_drawn_at_a_scale_that_is_told() {
        for (wanted, scale, name) in [
            (7.0, 5.0, "95 % ellipse, 5 times as large"),
            (1.3, 1.0, "95 % ellipse"),
            (0.3, 0.2, "95 % ellipse, 5 times as small"),
            (1e-5, 0.01, "95 % ellipse, 100 times as small"),
        ] {
            assert_eq!(scaled(wanted), (scale, name.to_owned()));
        }
    }

    /// Corrected logs have a robot that moves half a metre in a millisecond.
    #[test]
    fn a_log_whose_times_are_wrong_is_drawn_where_it_was_seen() {
        let beam = |k: u32| Beam {
            bearing: Bearing(0),
            range: Range::from_mm(2000),
            time_us: 1000 * k,
            quality: 0,
        };
        let beams: Vec<Beam> = (0..14).map(beam).collect();
        let mut track = Track::new(TruePose::default(), Pose::IDENTITY, 1);
        let at = |time: f64, x: f32| At {
            time,
            estimate: Pose::new(x, 0.0, 0.3 * x),
            covariance: None,
            is_measured: true,
            truth: None,
            wheels: None,
        };
        track.push(at(0.0, 0.0), &beams);
        let points = track.push(at(0.001, 0.5), &beams);
        // No farther than it moved from where it was seen.
        for point in points {
            let off = libm::hypotf(point.x - 2.0, point.y);
            assert!(off < 0.5 + 2.0 * 0.15 + 1e-3, "{point:?}");
        }
    }
}
