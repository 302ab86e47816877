//! The extension module behind the Python package `wiperlab`: thin classes and functions that exchange text
//! and arrays with that package.

mod errors;
mod job;
mod many;
mod recording;
mod scene;
mod workers;

use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::PathBuf;

/// Runs the program and returns its exit code.
#[pyfunction]
#[pyo3(signature = (arguments, path = None))]
fn run_program(py: Python<'_>, arguments: Vec<OsString>, path: Option<PathBuf>) -> u8 {
    py.detach(|| match path {
        Some(path) => wiperlab::cli::run_embedded(path, arguments),
        None => wiperlab::cli::run(arguments),
    })
}

#[pymodule]
fn _wiperlab(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<scene::PyScene>()?;
    module.add_class::<recording::PyRecording>()?;
    module.add_class::<job::PyJob>()?;
    module.add_function(wrap_pyfunction!(job::describe_verdict, module)?)?;
    module.add_function(wrap_pyfunction!(scene::simulate_scene, module)?)?;
    module.add_function(wrap_pyfunction!(many::simulate_points, module)?)?;
    module.add_function(wrap_pyfunction!(recording::analyse, module)?)?;
    module.add_function(wrap_pyfunction!(run_program, module)?)?;
    Ok(())
}
