//! Maps as arrays.

use std::path::PathBuf;

use beamfix::grid::occupancy;
use host_tests::formats::ros_map;
use numpy::{PyArray2, PyArrayMethods as _};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::beams::Triple;
use crate::failed;

/// An occupancy grid.
#[pyclass(frozen, get_all)]
pub struct Map {
    /// Rows from the lowest y up, as in nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown.
    cells: Py<PyArray2<i8>>,
    /// Side of a cell (m).
    resolution: f32,
    /// The lower left corner of the first cell in the map's frame: x, y (m), theta (rad).
    origin: Triple,
    /// What is odd about the files, a line each.
    remarks: Vec<String>,
}

#[pymethods]
impl Map {
    fn __repr__(&self, py: Python<'_>) -> String {
        let shape = self.cells.bind(py).readonly();
        format!(
            "<Map {:?} cells of {} m>",
            shape.as_array().shape(),
            self.resolution
        )
    }
}

/// Reads a map as ROS's map_server keeps it: a YAML file beside a picture.
#[pyfunction]
pub fn read_map(py: Python<'_>, path: PathBuf) -> PyResult<Map> {
    let mut remarks = Vec::new();
    let map = ros_map::read_remarking(&path, &mut remarks).map_err(failed)?;
    let shape = *map.shape();
    let rows: Vec<Vec<i8>> = map
        .cells()
        .chunks(usize::from(shape.width()))
        .map(|row| row.iter().map(|&byte| state(byte)).collect())
        .collect();
    let origin = shape.origin();
    Ok(Map {
        cells: PyArray2::from_vec2(py, &rows)
            .map_err(|error| PyValueError::new_err(error.to_string()))?
            .unbind(),
        resolution: shape.resolution(),
        origin: (origin.x, origin.y, origin.theta),
        remarks,
    })
}

/// A cell's byte as ROS has it.
const fn state(byte: u8) -> i8 {
    if occupancy::is_occupied(byte) {
        100
    } else if occupancy::is_free(byte) {
        0
    } else {
        -1
    }
}
