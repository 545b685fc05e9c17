//! Two scans to a pose.

use beamfix::geometry::{Pose, Twist};
use beamfix::matching::icp::{self, IcpConfig, Reference, Search};
use beamfix::matching::{self as library, MatchError};
use beamfix::scan::{Beam, Points, PointsConfig, Scan};
use host_tests::{size, sized};
use numpy::{PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray2};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::Refused;
use crate::beams::{self, Triple};

/// A pose found by matching two scans, and how far it can be trusted.
#[pyclass(frozen, get_all)]
pub struct Match {
    /// Pose of the second scan's lidar in the frame of the first one's: x, y (m), theta (rad).
    pose: Py<PyArray1<f32>>,
    /// Covariance over x, y, theta (m², m·rad, rad²).
    covariance: Py<PyArray2<f32>>,
    /// How well the pose explains the scan: about 1 where every beam agrees.
    score: f32,
    /// Root mean square distance of the agreeing beams from the reference (m).
    residual: f32,
    /// Beams that agree.
    inliers: u16,
    /// Beams that met a part of the reference that could have answered.
    overlap: u16,
    /// Beams that had a range.
    beams: u16,
    /// Passes over the beams, of all starts.
    iterations: u8,
    /// Unit vector over x, y and heading times `lever` that the scene hardly determines; None if there is none.
    degenerate_direction: Option<(f32, f32, f32)>,
    /// What makes a heading comparable with a distance in `degenerate_direction` (m).
    lever: Option<f32>,
}

impl Match {
    /// The library's match as Python's.
    pub fn new(py: Python<'_>, found: &library::Match) -> PyResult<Self> {
        let open = found.degenerate_direction;
        Ok(Self {
            pose: beams::pose_array(py, found.pose).unbind(),
            covariance: beams::covariance_array(py, &found.covariance)?.unbind(),
            score: found.score,
            residual: found.residual,
            inliers: found.inliers,
            overlap: found.overlap,
            beams: found.beams,
            iterations: found.iterations,
            degenerate_direction: open.map(|open| open.direction.into()),
            lever: open.map(|open| open.lever),
        })
    }
}

#[pymethods]
impl Match {
    fn __repr__(&self, py: Python<'_>) -> String {
        let pose = self.pose.bind(py).readonly();
        format!(
            "<Match {}: score {:.2}, {} of {} beams>",
            pose.as_array(),
            self.score,
            self.inliers,
            self.beams
        )
    }
}

/// Pose of the lidar that took `scan` in the frame of the one that took `reference`.
///
/// Both are arrays with a row for each beam in the order of measurement: bearing (rad, counter-clockwise), range (m; NaN,
/// infinite or at most 0 where there is none). `guess` is where the search starts. With mode "local" the guess may be off by
/// a few centimetres and degrees, with "global" by 40 cm and 45 degrees. Raises Refused, with the reason, where no pose can
/// be trusted.
#[pyfunction]
#[pyo3(signature = (reference, scan, guess = (0.0, 0.0, 0.0), mode = "local"))]
pub fn r#match(
    py: Python<'_>,
    reference: PyReadonlyArray2<'_, f64>,
    scan: PyReadonlyArray2<'_, f64>,
    guess: Triple,
    mode: &str,
) -> PyResult<Match> {
    let search = match mode {
        "local" => Search::Local,
        "global" => Search::Global,
        other => {
            return Err(PyValueError::new_err(format!(
                "mode {other:?}: \"local\" or \"global\" is wanted"
            )));
        }
    };
    let config = IcpConfig {
        search,
        ..IcpConfig::DEFAULT
    };
    let guess = beams::pose(guess)?;
    let (reference, scan) = (beams::beams(&reference)?, beams::beams(&scan)?);
    // As many directions as the scans have beams: a reference leaves those between two beams empty.
    let size = size::fitting([&reference[..], &scan[..]].into_iter());
    let found = sized!(size, align(&reference, &scan, guess, &config))?;
    let found = found.map_err(|error| Refused::new_err(error.to_string()))?;
    Match::new(py, &found)
}

/// Apart, so that what it costs can be told from what arrays cost.
#[inline(never)]
fn align<const N: usize>(
    reference: &[Beam],
    scan: &[Beam],
    guess: Pose,
    config: &IcpConfig,
) -> PyResult<Result<library::Match, MatchError>> {
    let mut points = Points::<N>::new();
    let mut lines = Reference::<N>::new();
    let mut taken = Scan::<N>::new();
    beams::scan(reference, &mut taken)?;
    points.assign(&taken, Twist::ZERO, &PointsConfig::DEFAULT);
    lines.assign(points.as_slice());
    beams::scan(scan, &mut taken)?;
    points.assign(&taken, Twist::ZERO, &PointsConfig::DEFAULT);
    Ok(icp::align(&lines, points.as_slice(), guess, config))
}
