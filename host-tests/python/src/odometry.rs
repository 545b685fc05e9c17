//! Scans, one after the other, to poses.

use beamfix::geometry::{EgoMotion, Pose};
use beamfix::odometry as library;
use beamfix::scan::{Mount, Scan};
use host_tests::pipeline;
use host_tests::report::hash::PoseHash;
use numpy::{PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray2};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::beams::{self, MOST, Triple};
use crate::matching::Match;

/// What a scan told about the robot.
#[pyclass(frozen, get_all)]
pub struct Step {
    /// The robot at the scan's end, in the frame in which it started: x, y (m), theta (rad).
    pose: Py<PyArray1<f32>>,
    /// Covariance of the pose since the start (m², m·rad, rad²).
    covariance: Py<PyArray2<f32>>,
    /// The match that the pose is from; None where the pose is only predicted.
    r#match: Option<Py<Match>>,
    /// Why there is no match; None where there is one.
    refused: Option<String>,
    /// Whether the scan is the new keyframe.
    keyframe: bool,
}

#[pymethods]
impl Step {
    fn __repr__(&self, py: Python<'_>) -> String {
        let pose = self.pose.bind(py).readonly();
        let refused = self.refused.as_deref().unwrap_or("matched");
        format!("<Step {}: {refused}>", pose.as_array())
    }
}

/// Lidar odometry: a pose for every scan.
///
/// `directions` is the number of beams of a whole turn of the lidar, `mount` the lidar's place on the robot.
#[pyclass]
pub struct Odometry {
    odometry: Box<library::Odometry<MOST>>,
    scan: Box<Scan<MOST>>,
    hash: PoseHash,
}

#[pymethods]
impl Odometry {
    #[new]
    #[pyo3(signature = (directions = 360, mount = (0.0, 0.0, 0.0), upside_down = false))]
    fn new(directions: usize, mount: Triple, upside_down: bool) -> PyResult<Self> {
        if !(16..=MOST).contains(&directions) {
            return Err(PyValueError::new_err(format!(
                "directions {directions}: 16 to {MOST} are wanted"
            )));
        }
        let mount = Mount {
            robot_from_lidar: beams::pose(mount)?,
            upside_down,
        };
        let config = pipeline::config(mount, directions);
        Ok(Self {
            odometry: Box::new(library::Odometry::new(config)),
            scan: Box::new(Scan::new()),
            hash: PoseHash::new(),
        })
    }

    /// Takes a scan: rows of bearing (rad), range (m) and time (s) in the order of measurement. `wheels` is the robot's motion
    /// since the last scan's end by its wheels (m, m, rad), `rotation` by its gyroscope (rad).
    #[pyo3(signature = (scan, wheels = None, rotation = None))]
    fn update(
        &mut self,
        py: Python<'_>,
        scan: PyReadonlyArray2<'_, f64>,
        wheels: Option<Triple>,
        rotation: Option<f32>,
    ) -> PyResult<Step> {
        let wheels = wheels.map(beams::pose).transpose()?;
        beams::scan(&beams::beams(&scan)?, &mut self.scan)?;
        let step = self
            .odometry
            .update(&self.scan, EgoMotion { wheels, rotation });
        self.hash.push(step.pose);
        Ok(Step {
            pose: beams::pose_array(py, step.pose).unbind(),
            covariance: beams::covariance_array(py, &step.covariance)?.unbind(),
            refused: step.outcome.err().map(|refusal| refusal.to_string()),
            r#match: match &step.outcome {
                Ok(found) => Some(Py::new(py, Match::new(py, found)?)?),
                Err(_) => None,
            },
            keyframe: step.keyframe,
        })
    }

    /// Hash over all poses so far: the same as the tool's and a board's for the same scans.
    #[getter]
    fn pose_hash(&self) -> String {
        self.hash.to_string()
    }

    /// Scans, refused ones, keyframes, and keyframes given up since the start.
    #[getter]
    fn counters(&self) -> (u32, u32, u32, u32) {
        let counters = self.odometry.counters();
        (
            counters.scans,
            counters.refused,
            counters.keyframes,
            counters.lost,
        )
    }
}

/// A mount of a triple, if there is one.
pub fn mount(mount: Option<Triple>, upside_down: bool) -> PyResult<Option<Mount>> {
    let robot_from_lidar: Option<Pose> = mount.map(beams::pose).transpose()?;
    Ok(robot_from_lidar.map(|robot_from_lidar| Mount {
        robot_from_lidar,
        upside_down,
    }))
}
