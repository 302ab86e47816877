//! Fit jobs for Python, with the posterior density of their unknown parameters, and the verdict on their
//! results.

use crate::errors;
use crate::workers;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use wiperlab::cli::read;
use wiperlab::fit::posterior::Posterior;
use wiperlab::fit::result::FitResult;

/// A fit job with its scenes and recordings.
#[pyclass(module = "wiperlab", frozen, subclass, name = "Job")]
pub struct PyJob {
    posterior: Arc<Posterior>,
    path: PathBuf,
}

/// The verdict on a fit in words: the first sentence, and the reasons that it leaves out. `text` is the
/// contents of its `result.json`, and `file` is the name of this file in error messages. Raises an
/// `InputError` if the text is not the result of a fit.
#[pyfunction]
pub fn describe_verdict(py: Python<'_>, file: &str, text: &str) -> PyResult<(String, Vec<String>)> {
    let result = FitResult::parse(file, text).map_err(|error| errors::input_error(py, error))?;
    Ok(result.describe_verdict())
}

type PointArray<'py> = PyReadonlyArray1<'py, f64>;

impl PyJob {
    fn read_point(&self, py: Python<'_>, of: &PointArray<'_>) -> PyResult<Vec<f64>> {
        let (found, expected) = (of.as_array().len(), self.posterior.unknowns().len());
        if found != expected {
            let problem = format!("found {found} numbers, expected {expected}: {}", self.names().join(", "));
            return Err(errors::input_error(py, problem));
        }
        Ok(of.as_array().iter().copied().collect())
    }

    fn evaluate_at<T: Send>(
        &self,
        py: Python<'_>,
        of: &PointArray<'_>,
        what: impl Fn(&Posterior, &[f64]) -> T + Send,
    ) -> PyResult<T> {
        let (point, posterior) = (self.read_point(py, of)?, Arc::clone(&self.posterior));
        workers::run_interruptible(py, None, move |_| what(&posterior, &point))
    }
}

#[pymethods]
impl PyJob {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = workers::run_interruptible(py, None, {
            let path = path.clone();
            move |_| read::read_problem(&path).map(Posterior::new)
        })?;
        let posterior = read.map_err(|failure| errors::failure_error(py, failure))?;
        let refused = |error| errors::input_error(py, format!("{}: {error}", path.display()));
        let posterior = Arc::new(posterior.map_err(refused)?);
        // kept as an absolute path: another process may read the job again from another working directory
        let path = std::path::absolute(&path).unwrap_or(path);
        Ok(Self { posterior, path })
    }

    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    #[getter]
    fn title(&self) -> &str {
        &self.posterior.problem().job().title
    }

    /// SHA-256 of all inputs that determine the cost of a set of parameter values.
    #[getter]
    fn fingerprint(&self) -> &str {
        self.posterior.problem().fingerprint()
    }

    #[getter]
    fn names(&self) -> Vec<String> {
        self.posterior.unknowns().iter().map(|unknown| unknown.name.clone()).collect()
    }

    #[getter]
    fn bounds(&self) -> Vec<(f64, f64)> {
        self.posterior.unknowns().iter().map(|unknown| (unknown.bounds[0], unknown.bounds[1])).collect()
    }

    fn prior_transform<'py>(
        &self,
        py: Python<'py>,
        unit: PointArray<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let unit = self.read_point(py, &unit)?;
        if let Some(found) = unit.iter().find(|u| !(0.0..=1.0).contains(*u)) {
            return Err(errors::input_error(py, format!("found {found}, expected numbers from 0 to 1")));
        }
        Ok(PyArray1::from_vec(py, self.posterior.prior_transform(&unit)))
    }

    fn log_prior(&self, py: Python<'_>, x: PointArray<'_>) -> PyResult<f64> {
        self.evaluate_at(py, &x, Posterior::log_prior)
    }

    fn log_likelihood(&self, py: Python<'_>, x: PointArray<'_>) -> PyResult<f64> {
        self.evaluate_at(py, &x, Posterior::log_likelihood)
    }

    fn log_posterior(&self, py: Python<'_>, x: PointArray<'_>) -> PyResult<f64> {
        self.evaluate_at(py, &x, Posterior::log_density)
    }

    fn residuals<'py>(&self, py: Python<'py>, x: PointArray<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = self.evaluate_at(py, &x, Posterior::residuals)?;
        Ok(PyArray1::from_vec(py, found.into_iter().map(|r| r.unwrap_or(f64::NAN)).collect()))
    }
}
