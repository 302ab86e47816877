//! Runs a scene with many sets of parameter values.

use crate::errors;
use crate::scene::{PyScene, StopFlag};
use crate::workers;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::Arc;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::scene::error::SceneError;
use wiperlab::sweep::{PointOutcome, Study};

/// Runs the scene once for each row of `points`; a row contains one value for each parameter in `names`.
/// Returns a table of the readings that the text `maps` defines, with one row per run and one column per
/// reading (NaN if a reading is missing), and for each run how it ended.
#[pyfunction]
#[pyo3(signature = (scene, names, points, maps, workers = None))]
pub fn simulate_points<'py>(
    py: Python<'py>,
    scene: &PyScene,
    names: Vec<String>,
    points: PyReadonlyArray2<'py, f64>,
    maps: &str,
    workers: Option<usize>,
) -> PyResult<(Bound<'py, PyAny>, Vec<&'static str>)> {
    let points = points.as_array();
    if points.ncols() != names.len() {
        let found = format!("found {} columns, expected {}: one for each name", points.ncols(), names.len());
        return Err(errors::input_error(py, format!("X: {found}")));
    }
    let study = Study::parse_maps("read", maps).map_err(|error| errors::input_error(py, error))?;
    let scene = Arc::clone(&scene.inner);
    // an unknown name makes the whole call fail; a value that the scene refuses makes only its own row fail
    if let Some(name) = names.iter().find(|name| scene.value(name).is_none()) {
        let refused = scene.with_parameter(name, 1.0).err().map_or_else(String::new, |e| e.to_string());
        return Err(errors::input_error(py, format!("names: {refused}")));
    }
    study.check_scene("read", &scene).map_err(|error| errors::input_error(py, error))?;
    let rows: Vec<Vec<f64>> = points.rows().into_iter().map(|row| row.to_vec()).collect();
    let maps = study.maps.len();
    let outcomes: Option<Vec<PointOutcome>> = workers::run_interruptible(py, workers, move |stop| {
        let at = |row: &Vec<f64>| -> Result<Scene, SceneError> {
            let set = |scene: Scene, (name, value): (&String, &f64)| scene.with_parameter(name, *value);
            names.iter().zip(row).try_fold((*scene).clone(), set)
        };
        let run = |row| PointOutcome::run_point_scene(&study, || at(row), || StopFlag(stop).flow());
        rows.par_iter().map(|row| StopFlag(stop).flow().is_continue().then(|| run(row))).collect()
    })?;
    // `None` would mean an interrupted run, for which an exception was already raised
    let outcomes = outcomes.unwrap_or_default();
    let values = outcomes.iter().flat_map(|outcome| &outcome.values);
    let values: Vec<f64> = values.map(|value| *value.as_ref().unwrap_or(&f64::NAN)).collect();
    let status = outcomes.iter().map(PointOutcome::status).collect();
    let table = PyArray1::from_vec(py, values).reshape([outcomes.len(), maps])?;
    Ok((table.into_any(), status))
}
