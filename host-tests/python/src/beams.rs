//! Beams from and to arrays.

use beamfix::geometry::Pose;
use beamfix::linalg::Covariance;
use beamfix::scan::{Beam, Bearing, Range, Scan};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::{exceptions::PyValueError, prelude::*};

/// Room for the beams of a scan: as much as the largest configuration has.
pub const MOST: usize = 1024;

/// A pose as Python has it: x, y (m), theta (rad).
pub type Triple = (f32, f32, f32);

/// The pose of a triple, which must be finite.
pub fn pose((x, y, theta): Triple) -> PyResult<Pose> {
    let pose = Pose::new(x, y, theta);
    if pose.is_finite() {
        Ok(pose)
    } else {
        Err(PyValueError::new_err("a pose must be three finite numbers"))
    }
}

/// Beams of an array with a row each: bearing, range and perhaps time.
pub fn beams(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Beam>> {
    let array = array.as_array();
    if array.nrows() > MOST || !(2..=3).contains(&array.ncols()) {
        return Err(PyValueError::new_err(format!(
            "an array of shape (n, 2) or (n, 3) with at most {MOST} rows is wanted: bearing (rad), range (m), time (s); this one has shape ({}, {})",
            array.nrows(),
            array.ncols()
        )));
    }
    let beam = |row: numpy::ndarray::ArrayView1<'_, f64>| {
        let seconds = row.get(2).copied().unwrap_or(0.0);
        if !row[0].is_finite() || !seconds.is_finite() {
            return Err(PyValueError::new_err(
                "bearings and times must be finite; a beam without a return has no range",
            ));
        }
        // The clock wraps at 2³² µs, as a lidar's does.
        let micros = (seconds * 1e6).round() as i64;
        Ok(Beam {
            bearing: Bearing::from_radians(row[0].rem_euclid(std::f64::consts::TAU) as f32),
            range: Range::from_metres(row[1] as f32),
            time_us: micros as u32,
            quality: 0,
        })
    };
    array.rows().into_iter().map(beam).collect()
}

/// An array with a row for each beam: bearing, range (NaN where there is none), time.
pub fn array<'py>(py: Python<'py>, beams: &[Beam]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let rows: Vec<Vec<f64>> = beams
        .iter()
        .map(|beam| {
            vec![
                f64::from(beam.bearing.radians()),
                beam.range.mm().map_or(f64::NAN, |mm| f64::from(mm) * 1e-3),
                f64::from(beam.time_us) * 1e-6,
            ]
        })
        .collect();
    PyArray2::from_vec2(py, &rows).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// A scan of these beams.
pub fn scan<const N: usize>(beams: &[Beam], scan: &mut Scan<N>) -> PyResult<()> {
    scan.clear();
    for (k, &beam) in beams.iter().enumerate() {
        scan.push(beam)
            .map_err(|error| PyValueError::new_err(format!("beam {k}: {error:?}")))?;
    }
    Ok(())
}

/// A pose as an array of three.
pub fn pose_array(py: Python<'_>, pose: Pose) -> Bound<'_, PyArray1<f32>> {
    PyArray1::from_slice(py, &[pose.x, pose.y, pose.theta])
}

/// A covariance as a symmetric array of three by three over x, y, theta.
pub fn covariance_array<'py>(
    py: Python<'py>,
    covariance: &Covariance,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let [xx, xy, yy, xt, yt, tt] = covariance.to_array();
    let rows = [vec![xx, xy, xt], vec![xy, yy, yt], vec![xt, yt, tt]];
    PyArray2::from_vec2(py, &rows).map_err(|error| PyValueError::new_err(error.to_string()))
}
