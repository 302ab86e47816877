//! Many runs of a scene with other values of its parameters.

use crate::errors;
use crate::scene::{Asked, Scene};
use crate::workers;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::Arc;
use wiperlab::simulate::scene::{Scene as Model, SceneError};
use wiperlab::sweep::{Outcome, Study};

/// Runs the scene with every row of `points` for the named parameters and reads what the maps of a study say:
/// a row of values for each, not a number where there is none, and how each run ended.
#[pyfunction]
#[pyo3(signature = (scene, names, points, maps, workers = None))]
pub fn simulate_points<'py>(
    py: Python<'py>,
    scene: &Scene,
    names: Vec<String>,
    points: PyReadonlyArray2<'py, f64>,
    maps: &str,
    workers: Option<usize>,
) -> PyResult<(Bound<'py, PyAny>, Vec<&'static str>)> {
    let points = points.as_array();
    if points.ncols() != names.len() {
        let found = format!("found {} columns, expected {}: one for each name", points.ncols(), names.len());
        return Err(errors::input(py, format!("X: {found}")));
    }
    let study = Study::parse_maps("read", maps).map_err(|error| errors::input(py, error))?;
    let scene = Arc::clone(&scene.inner);
    // (an unknown name is a mistake in the call; a value that a scene refuses is the outcome of its point)
    if let Some(name) = names.iter().find(|name| scene.value(name).is_none()) {
        let refused = scene.with(name, 1.0).err().map_or_else(String::new, |error| error.to_string());
        return Err(errors::input(py, format!("names: {refused}")));
    }
    study.check_scene("read", &scene).map_err(|error| errors::input(py, error))?;
    let rows: Vec<Vec<f64>> = points.rows().into_iter().map(|row| row.to_vec()).collect();
    let maps = study.maps.len();
    let outcomes: Option<Vec<Outcome>> = workers::run(py, workers, move |stop| {
        let at = |row: &Vec<f64>| -> Result<Model, SceneError> {
            let set = |scene: Model, (name, value): (&String, &f64)| scene.with(name, *value);
            names.iter().zip(row).try_fold((*scene).clone(), set)
        };
        let run = |row| Outcome::of_scene(&study, || at(row), || Asked(stop).flow());
        rows.par_iter().map(|row| Asked(stop).flow().is_continue().then(|| run(row))).collect()
    })?;
    // (what was asked to stop has raised)
    let outcomes = outcomes.unwrap_or_default();
    let values = outcomes.iter().flat_map(|outcome| &outcome.values);
    let values: Vec<f64> = values.map(|value| *value.as_ref().unwrap_or(&f64::NAN)).collect();
    let status = outcomes.iter().map(Outcome::status).collect();
    let table = PyArray1::from_vec(py, values).reshape([outcomes.len(), maps])?;
    Ok((table.into_any(), status))
}
