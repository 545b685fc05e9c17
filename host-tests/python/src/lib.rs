//! The Python package `beamfix`: bytes to beams, scans to poses, logs to trajectories, maps to arrays.
//!
//! Everything here calls the library's own pipeline, so poses have the bits that a board computes. Arrays of beams have a
//! row for each beam: bearing (rad, counter-clockwise), range (m; NaN, infinite or at most 0 where there is none) and,
//! optionally, the time (s).

mod beams;
mod decoding;
mod logs;
mod maps;
mod matching;
mod odometry;

use pyo3::{create_exception, exceptions::PyValueError, prelude::*};

create_exception!(
    beamfix,
    Refused,
    PyValueError,
    "A match that was refused: too few beams, an ambiguous or degenerate scene, no convergence."
);

/// An error of the host side as Python's.
fn failed(error: impl Into<anyhow::Error>) -> PyErr {
    PyValueError::new_err(format!("{:#}", error.into()))
}

/// The extension module `beamfix._beamfix`.
#[pymodule]
fn _beamfix(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Refused", module.py().get_type::<Refused>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<decoding::Decoded>()?;
    module.add_class::<matching::Match>()?;
    module.add_class::<odometry::Odometry>()?;
    module.add_class::<odometry::Step>()?;
    module.add_class::<logs::Log>()?;
    module.add_class::<logs::Trajectory>()?;
    module.add_class::<maps::Map>()?;
    module.add_function(wrap_pyfunction!(decoding::lidars, module)?)?;
    module.add_function(wrap_pyfunction!(decoding::decode, module)?)?;
    module.add_function(wrap_pyfunction!(matching::r#match, module)?)?;
    module.add_function(wrap_pyfunction!(logs::read_log, module)?)?;
    module.add_function(wrap_pyfunction!(logs::replay, module)?)?;
    module.add_function(wrap_pyfunction!(maps::read_map, module)?)?;
    Ok(())
}
