//! What the page draws, as bytes: text is JSON, places are pairs of `f32` (m, in the world's frame) in a row.

use beamfix::geometry::{Point, Pose};
use beamfix::grid::Grid;
use beamfix::grid::occupancy;
use beamfix::linalg::{Covariance, Sym3};
use beamfix::pipeline::Verdict;
use beamfix::scan::ScanPoint;
use beamfix_sim::TruePose;
use host_tests::{mapping, matcher};
use serde_json::{Value, json};

use crate::twin::{Found, Twin};

/// What may be looked at, by the page's number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// 0: state, as JSON.
    State,
    /// 1: places hit by the last scan, where odometry or localization puts them.
    Scan,
    /// 2: places hit by the keyframe that the last scan is matched to.
    Keyframe,
    /// 3: correspondences, each two places: a point of the scan, and its foot on the keyframe's line.
    Correspondences,
    /// 4: the likelihood field: width, height, side of a cell (m), x, y, heading of the first cell's corner (`f32`), then a
    /// byte each cell.
    Field,
    /// 5: the map of what was seen, like the field: 0 free, 127 unknown, 255 occupied.
    Map,
    /// 6: the world's straight faces, each two places.
    Walls,
    /// 7: the world's round ones: x, y, radius.
    Columns,
    /// 8, 9, 10: where the robot went, by odometry, by localization: not a number where a line ends.
    Trail(usize),
}

impl Part {
    /// The part with this number.
    pub fn of(number: u32) -> Option<Self> {
        Some(match number {
            0 => Self::State,
            1 => Self::Scan,
            2 => Self::Keyframe,
            3 => Self::Correspondences,
            4 => Self::Field,
            5 => Self::Map,
            6 => Self::Walls,
            7 => Self::Columns,
            8..=10 => Self::Trail(number as usize - 8),
            _ => return None,
        })
    }
}

impl Twin {
    /// A part as bytes; `None` where there is none of it.
    pub fn look(&mut self, part: Part) -> Option<Vec<u8>> {
        Some(match part {
            Part::State => self.state().to_string().into_bytes(),
            Part::Scan => {
                let from_lidar = self.drawn_at() * self.seen.scans.mount.robot_from_lidar;
                let points = self.seen.scans.points.as_slice();
                floats(points.iter().flat_map(|point| placed(from_lidar, point)))
            }
            Part::Keyframe => {
                let from_lidar = self.keyframe_at();
                let points = self.seen.scans.reference_points.as_slice();
                floats(points.iter().flat_map(|point| placed(from_lidar, point)))
            }
            Part::Correspondences => self.correspondences(),
            Part::Field => {
                let field = self.field.as_ref()?;
                grid(field.grid(), |byte| byte)
            }
            Part::Map => {
                let map = mapping::drawn(self.mapper().slam_mut(), 0.05).ok()?;
                grid(&map, |byte| match occupancy::cell(byte) {
                    occupancy::Cell::Free => 0,
                    occupancy::Cell::Unknown => 127,
                    occupancy::Cell::Occupied => 255,
                })
            }
            Part::Walls => {
                let segments = self.live()?.underway.world.segments.iter();
                floats(
                    segments
                        .flat_map(|s| [s.from, s.to])
                        .flatten()
                        .map(|v| v as f32),
                )
            }
            Part::Columns => {
                let circles = self.live()?.underway.world.circles.iter();
                let numbers = circles.flat_map(|c| [c.centre[0], c.centre[1], c.radius]);
                floats(numbers.map(|v| v as f32))
            }
            Part::Trail(which) => floats(self.seen.trails.get(which)?.iter().flatten().copied()),
        })
    }

    /// Odometry's frame in the world.
    fn start(&self) -> Pose {
        self.start.into()
    }

    /// Where the last scan is drawn: in the world's map where the robot is found in it, else by odometry.
    fn drawn_at(&self) -> Pose {
        match self.seen.located {
            Some(found) if found.verdict != Verdict::Unknown => found.pose,
            _ => self.start() * self.seen.odometry.pose,
        }
    }

    /// Where the keyframe's lidar is drawn: as far from the scan as odometry has it.
    fn keyframe_at(&self) -> Pose {
        let scans = &self.seen.scans;
        let motion = self.seen.odometry.pose.between(scans.reference_pose);
        self.drawn_at() * motion * scans.mount.robot_from_lidar
    }

    fn correspondences(&self) -> Vec<u8> {
        let scans = &self.seen.scans;
        let mount = scans.mount.robot_from_lidar;
        let motion = scans.reference_pose.between(self.seen.odometry.pose);
        let keyframe_from_lidar = mount.inverse() * motion * mount;
        let at = self.keyframe_at();
        let pairs = scans.points.as_slice().iter().filter_map(|point| {
            let (from, foot) =
                matcher::correspondence(&scans.reference, keyframe_from_lidar, point, GATE);
            Some([from, foot?])
        });
        floats(pairs.flatten().flat_map(|[x, y]| {
            let place = at * Point::new(x as f32, y as f32);
            [place.x, place.y]
        }))
    }

    fn state(&mut self) -> Value {
        let searches = self.searches();
        let loops = self.mapper().slam().counters().loops;
        let seen = &self.seen;
        let start = self.start();
        let in_world = Found {
            pose: start * seen.odometry.pose,
            ..seen.odometry
        };
        let turned = in_world
            .covariance
            .map(|covariance| rotated(covariance, start.theta));
        let mut state = json!({
            "scans": seen.count, "refused": seen.refused, "keyframes": seen.keyframes, "loops": loops,
            "hash": seen.hash.to_string(),
            "odometry": found(&Found { covariance: turned, ..in_world }),
            "mapped": pose(start * seen.mapped),
            "located": seen.located.as_ref().map(found),
            "lost": searches.map(|(lost, _)| lost), "lookups": searches.map(|(_, lookups)| lookups),
        });
        if let Some(live) = self.live() {
            let truth = live.underway.robot.pose;
            state["truth"] = pose(truth.into());
            state["moves"] = json!(live.underway.has_moving());
            state["seconds"] = json!(live.underway.now);
            state["lidar"] = json!(live.model.name);
            if let Some(found) = seen
                .located
                .filter(|found| found.verdict != Verdict::Unknown)
            {
                state["error_m"] = json!(truth.between(TruePose::from(found.pose)).distance());
            }
        }
        if let Some(replay) = self.recorded() {
            state["left"] = json!(replay.log.scans.len() - seen.count);
            state["remarks"] = json!(replay.remarks);
            state["lidar"] = json!(replay.log.lidar);
        }
        state
    }
}

/// Farther from its line (mm) a point has no say in the matcher's last passes.
const GATE: f64 = 128.0;

fn placed(from_lidar: Pose, point: &ScanPoint) -> [f32; 2] {
    let place = from_lidar * Point::new(f32::from(point.x()) * 1e-3, f32::from(point.y()) * 1e-3);
    [place.x, place.y]
}

fn pose(pose: Pose) -> Value {
    json!([pose.x, pose.y, pose.theta])
}

/// A pose, its covariance (xx, xy, yy in m², heading in rad²), and how it was found.
fn found(found: &Found) -> Value {
    let covariance = found.covariance.map(|covariance| {
        let Sym3 { xx, xy, yy, tt, .. } = covariance.0;
        [xx, xy, yy, tt]
    });
    let verdict = match found.verdict {
        Verdict::Measured => "measured",
        Verdict::Predicted => "predicted",
        Verdict::Unknown => "unknown",
    };
    json!({ "pose": pose(found.pose), "covariance": covariance, "verdict": verdict })
}

/// A covariance of a place, by an observer turned by `theta`.
fn rotated(covariance: Covariance, theta: f32) -> Covariance {
    let (sin, cos) = beamfix::math::sin_cos(theta);
    let Sym3 {
        xx, xy, yy, xt, yt, ..
    } = covariance.0;
    let turned = Sym3 {
        xx: cos * cos * xx - 2.0 * cos * sin * xy + sin * sin * yy,
        xy: cos * sin * (xx - yy) + (cos * cos - sin * sin) * xy,
        yy: sin * sin * xx + 2.0 * cos * sin * xy + cos * cos * yy,
        xt: cos * xt - sin * yt,
        yt: sin * xt + cos * yt,
        ..covariance.0
    };
    Covariance(turned)
}

fn floats(numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    numbers.flat_map(f32::to_le_bytes).collect()
}

fn grid<S: AsRef<[u8]>>(grid: &Grid<S>, byte: impl Fn(u8) -> u8) -> Vec<u8> {
    let shape = grid.shape();
    let Pose { x, y, theta } = shape.origin();
    let sides = [shape.width(), shape.height()].map(f32::from);
    let mut bytes = floats([sides[0], sides[1], shape.resolution(), x, y, theta].into_iter());
    bytes.extend(grid.cells().iter().map(|&cell| byte(cell)));
    bytes
}
