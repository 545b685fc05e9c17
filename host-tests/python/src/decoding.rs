//! Raw bytes of a lidar to arrays.

use beamfix::lidar::Model;
use host_tests::decode as host;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::failed;

/// Names of all lidars that are known.
#[pyfunction]
pub fn lidars() -> Vec<&'static str> {
    Model::ALL.iter().map(|model| model.name).collect()
}

/// What was in the bytes of a lidar. Each array has an element for each measurement.
#[pyclass(frozen, get_all)]
pub struct Decoded {
    /// Name of the lidar.
    lidar: String,
    /// Frames that passed every check.
    packets: u32,
    /// Complete frames that failed their check code.
    check_errors: u32,
    /// Bytes that belong to no accepted frame.
    skipped_bytes: u32,
    /// Number of the revolution.
    scan: Py<PyArray1<u32>>,
    /// Time (s, the sensor's clock where it has one).
    time: Py<PyArray1<f64>>,
    /// Angle in the sensor's own sense (degrees).
    angle_deg: Py<PyArray1<f32>>,
    /// Bearing (rad, counter-clockwise), as a matcher takes it.
    bearing: Py<PyArray1<f32>>,
    /// Range (m); NaN where there is none.
    range: Py<PyArray1<f32>>,
    /// Strength of the return in the sensor's own unit.
    quality: Py<PyArray1<u16>>,
}

#[pymethods]
impl Decoded {
    fn __len__(&self, py: Python<'_>) -> usize {
        self.scan.bind(py).len().unwrap_or(0)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!(
            "<Decoded {}: {} packets, {} measurements, {} check errors>",
            self.lidar,
            self.packets,
            self.__len__(py),
            self.check_errors
        )
    }
}

/// Decodes raw bytes of a lidar. `lidar` is a name of `lidars()`, or "auto": the one whose frames are in the bytes.
#[pyfunction]
#[pyo3(signature = (data, lidar = "auto"))]
pub fn decode(py: Python<'_>, data: &[u8], lidar: &str) -> PyResult<Decoded> {
    let name = host::model(lidar, data).map_err(failed)?.name;
    let mut rows = Vec::new();
    let summary = host::decode(name, data, &mut |row| rows.push(row)).map_err(failed)?;
    let floats = |of: fn(&host::Row) -> f32| PyArray1::from_iter(py, rows.iter().map(of)).unbind();
    Ok(Decoded {
        lidar: name.to_owned(),
        packets: summary.packets,
        check_errors: summary.check_errors,
        skipped_bytes: summary.skipped_bytes,
        scan: PyArray1::from_iter(py, rows.iter().map(|row| row.scan)).unbind(),
        time: PyArray1::from_iter(py, rows.iter().map(|row| row.time_us as f64 * 1e-6)).unbind(),
        angle_deg: floats(|row| row.angle_deg),
        bearing: floats(|row| row.beam.bearing.radians()),
        range: floats(|row| row.range_mm.map_or(f32::NAN, |mm| mm * 1e-3)),
        quality: PyArray1::from_iter(py, rows.iter().map(|row| row.quality)).unbind(),
    })
}
