//! Recorded logs: their scans, and trajectories replayed from them.

use std::path::PathBuf;

use anyhow::Context as _;
use beamfix::geometry::Pose;
use beamfix::localization::LocalizerConfig;
use beamfix::matching::correlative::pyramid::Pyramid;
use beamfix::odometry as library;
use beamfix::pipeline::{Estimate as _, Estimator, MapLocalizer, Verdict};
use beamfix::scan::PointsConfig;
use host_tests::formats::field::FieldFile;
use host_tests::formats::order::Order;
use host_tests::formats::{self, Options};
use host_tests::pipeline::{Followed, config, follow, is_measured, sparse_odometry};
use host_tests::{size, sized};
use numpy::{PyArray1, PyArray2};
use pyo3::{
    exceptions::{PyIndexError, PyValueError},
    prelude::*,
};

use crate::beams::{self, Triple};
use crate::{failed, odometry::mount};

/// A recorded log.
#[pyclass(frozen)]
pub struct Log {
    log: formats::Log,
}

#[pymethods]
impl Log {
    fn __len__(&self) -> usize {
        self.log.scans.len()
    }

    fn __repr__(&self) -> String {
        format!("<Log {}: {} scans>", self.log.source, self.log.scans.len())
    }

    /// What the log is and what of it is read.
    #[getter]
    fn source(&self) -> &str {
        &self.log.source
    }

    /// The scan's beams, a row each: bearing (rad), range (m, NaN where there is none), time (s).
    fn beams<'py>(&self, py: Python<'py>, scan: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        beams::array(py, &self.recorded(scan)?.beams)
    }

    /// The log's own time stamp of a scan (s).
    fn time(&self, scan: usize) -> PyResult<f64> {
        self.recorded(scan)?.stamp.parse().map_err(|_| {
            PyValueError::new_err(format!("scan {scan} has no time stamp that is a number"))
        })
    }

    /// The robot by its wheels at a scan (m, m, rad); None where the log does not tell.
    fn wheels(&self, scan: usize) -> PyResult<Option<Triple>> {
        let wheels = self.recorded(scan)?.wheels;
        Ok(wheels.map(|pose| (pose.x, pose.y, pose.theta)))
    }
}

impl Log {
    fn recorded(&self, scan: usize) -> PyResult<&formats::Recorded> {
        self.log.scans.get(scan).ok_or_else(|| {
            PyIndexError::new_err(format!("scan {scan} of {}", self.log.scans.len()))
        })
    }
}

/// A pose for every scan of a log.
#[pyclass(frozen, get_all)]
pub struct Trajectory {
    /// Time stamps of the scans (s).
    times: Py<PyArray1<f64>>,
    /// The robot at each scan's end, a row each: x, y (m), theta (rad).
    poses: Py<PyArray2<f32>>,
    /// Whether a match confirms the pose; where not it is only a guess.
    measured: Py<PyArray1<bool>>,
    /// Hash over all poses, as the tool prints it.
    pose_hash: String,
    /// Keyframes made; 0 in a map.
    keyframes: u32,
    /// Times that a keyframe or the place in the map was given up.
    lost: u32,
    /// What the log is and what of it is read.
    source: String,
}

#[pymethods]
impl Trajectory {
    fn __len__(&self, py: Python<'_>) -> usize {
        self.times.bind(py).len().unwrap_or(0)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!(
            "<Trajectory {}: {} poses, hash {}>",
            self.source,
            self.__len__(py),
            self.pose_hash
        )
    }
}

fn read(
    path: &std::path::Path,
    lidar: Option<String>,
    order: Option<&str>,
    topics: (Option<String>, Option<String>),
    mount: Option<beamfix::scan::Mount>,
) -> PyResult<formats::Log> {
    let beams = match order {
        None => None,
        Some("reversed") => Some(Order::Reversed),
        Some("in-order") => Some(Order::InOrder),
        Some("at-once") => Some(Order::AtOnce),
        Some(other) => {
            return Err(PyValueError::new_err(format!(
                "order {other:?}: \"reversed\", \"in-order\" or \"at-once\" is wanted"
            )));
        }
    };
    let (scan_topic, odom_topic) = topics;
    let options = Options {
        lidar,
        beams,
        scan_topic,
        odom_topic,
        mount,
    };
    formats::read_with(path, &options).map_err(failed)
}

/// Reads a log: CARMEN, .lscan, a ROS 2 bag (MCAP, SQLite or its folder), a capture of the tool, raw bytes of a lidar.
#[pyfunction]
#[pyo3(signature = (path, *, lidar = None, order = None, scan_topic = None, odom_topic = None))]
pub fn read_log(
    path: PathBuf,
    lidar: Option<String>,
    order: Option<&str>,
    scan_topic: Option<String>,
    odom_topic: Option<String>,
) -> PyResult<Log> {
    let log = read(&path, lidar, order, (scan_topic, odom_topic), None)?;
    Ok(Log { log })
}

/// Poses in the order of the scans.
#[derive(Default)]
struct Poses {
    rows: Vec<Pose>,
    measured: Vec<bool>,
    keyframes: u32,
    lost: u32,
}

/// How a log is replayed.
struct Replay<'a> {
    log: &'a formats::Log,
    scans: usize,
    uses_wheels: bool,
    directions: usize,
    map: Option<&'a std::path::Path>,
    start: Option<Pose>,
}

/// Replays a log as `beamfix replay` does: the same poses, the same hash.
///
/// With `map` (a ROS map's YAML file, or a table that `beamfix field` wrote) the robot is localized in it, from `start` on or
/// wherever it finds itself. Otherwise the trajectory is the odometry's. prior is "odometry" (the log's wheels) or "none".
#[pyfunction]
#[pyo3(signature = (path, *, lidar = None, order = None, scan_topic = None, odom_topic = None, mount = None,
    upside_down = false, prior = "odometry", map = None, start = None, scans = None))]
#[expect(clippy::too_many_arguments, reason = "keywords in Python")]
pub fn replay(
    py: Python<'_>,
    path: PathBuf,
    lidar: Option<String>,
    order: Option<&str>,
    scan_topic: Option<String>,
    odom_topic: Option<String>,
    mount: Option<Triple>,
    upside_down: bool,
    prior: &str,
    map: Option<PathBuf>,
    start: Option<Triple>,
    scans: Option<usize>,
) -> PyResult<Trajectory> {
    let uses_wheels = match prior {
        "odometry" => true,
        "none" => false,
        other => {
            return Err(PyValueError::new_err(format!(
                "prior {other:?}: \"odometry\" or \"none\" is wanted"
            )));
        }
    };
    let mount = self::mount(mount, upside_down)?;
    let start = start.map(beams::pose).transpose()?;
    let mut log = read(&path, lidar, order, (scan_topic, odom_topic), mount)?;
    if let Some(mount) = mount {
        log.mount = mount;
    }
    let directions = size::fitting(log.scans.iter().map(|scan| &scan.beams[..]));
    log.thin(directions);
    let how = Replay {
        scans: scans.map_or(log.scans.len(), |most| most.min(log.scans.len())),
        log: &log,
        uses_wheels,
        directions,
        map: map.as_deref(),
        start,
    };
    let followed = py.detach(|| {
        let width = size::beam_width(how.log.scans.iter().map(|scan| &scan.beams[..]));
        match (how.map, width) {
            (Some(_), _) => sized!(directions, localized(&how)),
            (None, Some(width)) => followed(&how, sparse_odometry(how.log.mount, width), |_| 0),
            (None, None) => sized!(directions, tracked(&how)),
        }
    });
    let followed = followed.map_err(failed)?;
    let poses = &followed.estimator;
    let times = log
        .scans
        .iter()
        .map(|scan| scan.stamp.parse().unwrap_or(f64::NAN));
    let rows: Vec<Vec<f32>> = poses
        .rows
        .iter()
        .map(|pose| vec![pose.x, pose.y, pose.theta])
        .collect();
    Ok(Trajectory {
        times: PyArray1::from_iter(py, times.take(rows.len())).unbind(),
        poses: PyArray2::from_vec2(py, &rows)
            .map_err(|error| PyValueError::new_err(error.to_string()))?
            .unbind(),
        measured: PyArray1::from_slice(py, &poses.measured).unbind(),
        pose_hash: followed.hash.to_string(),
        keyframes: poses.keyframes,
        lost: poses.lost,
        source: log.source.clone(),
    })
}

fn tracked<const N: usize>(how: &Replay<'_>) -> anyhow::Result<Followed<Poses>> {
    let odometry = library::Odometry::<N>::new(config(how.log.mount, how.directions));
    followed(how, odometry, |odometry| odometry.counters().lost)
}

/// Replays through an odometry; `lost` counts the keyframes that it has given up.
fn followed<E: Estimator<N, Step = library::Step>, const N: usize>(
    how: &Replay<'_>,
    odometry: E,
    lost: impl Fn(&E) -> u32,
) -> anyhow::Result<Followed<Poses>> {
    let mut poses = Poses::default();
    let ego = (how.scans, how.uses_wheels);
    let followed = follow(how.log, ego, odometry, &mut |_, pose, step| {
        poses.rows.push(pose);
        poses.measured.push(is_measured(step));
        poses.keyframes += u32::from(step.keyframe);
        Ok(())
    })?;
    poses.lost = lost(&followed.estimator);
    Ok(followed.map(|_| poses))
}

fn localized<const N: usize>(how: &Replay<'_>) -> anyhow::Result<Followed<Poses>> {
    let path = how.map.context("a map")?;
    let file = FieldFile::read(path, &mut Vec::new())?;
    let field = file.field()?;
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field, &mut buffer)?;
    let points = PointsConfig {
        mount: how.log.mount,
        ..PointsConfig::DEFAULT
    };
    let localizer = beamfix::localization::Localizer::<96>::new(pyramid, LocalizerConfig::DEFAULT);
    let mut localizer = MapLocalizer::<N, 96>::new(localizer, points);
    if let Some(start) = how.start {
        localizer.start_at(start);
    }
    let mut poses = Poses::default();
    let ego = (how.scans, how.uses_wheels);
    let followed = follow(how.log, ego, localizer, &mut |_, pose, located| {
        poses.rows.push(pose);
        poses.measured.push(located.verdict() == Verdict::Measured);
        Ok(())
    })?;
    poses.lost = followed.estimator.localizer().counters().lost;
    Ok(followed.map(|_| poses))
}
