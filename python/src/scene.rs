//! Scenes and their runs.

use crate::errors::{self, catch_panic};
use crate::workers;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use wiperlab::cli::read;
use wiperlab::simulate::outputs::{
    EnergyAudit, SampleObserver, SimulationSummary, Transitions, recorded_points_m, sample_times,
};
use wiperlab::simulate::predicted_error::run_with_predicted_errors;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::{ModelSample, Observer, SolutionSegment, SolverOptions, Transition, run_scene_with};

/// Parts from which a scene is restored: the name and the text of its file, the folder of the recording that
/// drives its head, and the parameter values that were replaced after reading.
type SceneParts = (String, String, Option<PathBuf>, Vec<(String, f64)>);

/// A blade with its friction, its drive and the settings of its run.
#[pyclass(module = "wiperlab", frozen, from_py_object, name = "Scene")]
#[derive(Clone)]
pub struct PyScene {
    pub inner: Arc<Scene>,
    file: String,
    text: String,
    driver: Option<PathBuf>,
    set: Vec<(String, f64)>,
}

impl PyScene {
    fn from_source(py: Python<'_>, (file, text, driver, set): SceneParts) -> PyResult<Self> {
        let recording = |named: &str| {
            let path =
                driver.clone().map_or_else(|| read::resolve_existing_path(Path::new(&file), named), Ok)?;
            read::read_recording(&path).map(|(recording, _)| recording).map_err(|error| error.to_string())
        };
        let scene = Scene::parse_with_recording(&file, &text, recording);
        let scene = scene.map_err(|error| errors::input_error(py, error))?;
        Ok(Self { inner: replace_values(py, scene, &set)?, file, text, driver, set })
    }
}

fn replace_values(py: Python<'_>, scene: Scene, values: &[(String, f64)]) -> PyResult<Arc<Scene>> {
    let with = |scene: Scene, (name, value): &(String, f64)| scene.with_parameter(name, *value);
    values.iter().try_fold(scene, with).map(Arc::new).map_err(|error| errors::input_error(py, error))
}

#[pymethods]
impl PyScene {
    /// Reads a scene file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        catch_panic(py, || {
            let refused = |failure| errors::failure_error(py, failure);
            let (_, driver) = read::read_scene(&path).map_err(refused)?;
            let driver = driver.and_then(|path| std::path::absolute(path).ok());
            let text = read::read_toml_text(&path).map_err(refused)?;
            Self::from_source(py, (path.display().to_string(), text, driver, Vec::new()))
        })
    }

    /// Reads the text of a scene file.
    #[staticmethod]
    #[pyo3(signature = (text, file = "scene.toml"))]
    fn parse(py: Python<'_>, text: &str, file: &str) -> PyResult<Self> {
        catch_panic(py, || Self::from_source(py, (file.to_owned(), text.to_owned(), None, Vec::new())))
    }

    /// Restores a scene from its parts.
    #[staticmethod]
    fn of_parts(py: Python<'_>, parts: SceneParts) -> PyResult<Self> {
        catch_panic(py, || Self::from_source(py, parts))
    }

    /// A copy of the scene in which the given parameters have other values.
    fn replace(&self, py: Python<'_>, values: Vec<(String, f64)>) -> PyResult<Self> {
        catch_panic(py, || {
            let inner = replace_values(py, (*self.inner).clone(), &values)?;
            Ok(Self { inner, set: [&self.set[..], &values].concat(), ..self.clone() })
        })
    }

    /// Value of a parameter in its SI unit, converted if the file states an equivalent parameter; `None` for
    /// a part that the scene does not have.
    fn value(&self, name: &str) -> Option<f64> {
        self.inner.value(name)
    }

    /// The numbers of the scene file as written there, each with the name of its parameter.
    fn written_values(&self) -> Vec<(&'static str, f64)> {
        self.inner.written_values().collect()
    }

    #[getter]
    fn title(&self) -> &str {
        self.inner.title()
    }

    #[getter]
    fn start_s(&self) -> f64 {
        self.inner.start_s
    }

    #[getter]
    fn stop_s(&self) -> f64 {
        self.inner.run.stop_s
    }

    #[getter]
    fn sample_rate_hz(&self) -> f64 {
        self.inner.run.sample_rate_hz
    }

    /// One sentence for each implausible value of the scene.
    #[getter]
    fn findings(&self) -> Vec<String> {
        self.inner.find_implausible().iter().map(ToString::to_string).collect()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.inner == other.inner
    }

    /// The parts from which the scene can be restored: the name and the text of its file, the folder of the
    /// recording that drives its head, and the replaced parameter values.
    fn parts(&self) -> SceneParts {
        (self.file.clone(), self.text.clone(), self.driver.clone(), self.set.clone())
    }
}

/// Stops a run of the model when the flag is true.
pub struct StopFlag<'a>(pub &'a AtomicBool);

impl StopFlag<'_> {
    pub fn flow(&self) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl Observer for StopFlag<'_> {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
    fn control_flow(&self) -> ControlFlow<()> {
        StopFlag::flow(self)
    }
}

/// Names of the numeric columns of a run; they are the columns of trace.csv and state.csv.
const COLUMNS: &str = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m,neck_angle_rad,lip_angle_rad,neck_rate_rad_per_s,\
                       lip_rate_rad_per_s,head_drop_m,tip_velocity_m_per_s,normal_force_n,friction_force_n";

/// Names of the numeric columns of a run of a slider.
const SLIDER_COLUMNS: &str = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m,deflection_m,tip_velocity_m_per_s,normal_force_n,friction_force_n";

/// Results of a run: columns of the samples, contact mode of each sample, columns of the transitions, and the
/// summary as JSON.
type RunArrays<'py> = (Bound<'py, PyDict>, Vec<&'static str>, Bound<'py, PyDict>, String);

/// Runs a scene and samples its motion at the sample rate of the scene or, if `times_s` is given, at these
/// instants, s, in ascending order. With `predict_errors`, the transitions have their predicted errors, NaN
/// where there is none.
#[pyfunction]
#[pyo3(signature = (scene, times_s = None, predict_errors = false))]
pub fn simulate_scene<'py>(
    py: Python<'py>,
    scene: &PyScene,
    times_s: Option<PyReadonlyArray1<'py, f64>>,
    predict_errors: bool,
) -> PyResult<RunArrays<'py>> {
    let given = times_s.map(|times| times.as_array().iter().copied().collect());
    let times: Vec<f64> = given.unwrap_or_else(|| sample_times(&scene.inner).collect());
    let scene = Arc::clone(&scene.inner);
    let is_slider = scene.linkage.is_slider();
    let names = if is_slider { SLIDER_COLUMNS } else { COLUMNS };
    let (columns, modes, transitions, errors, summary) = workers::run_interruptible(py, None, move |stop| {
        let mut columns: Vec<Vec<f64>> = names.split(',').map(|_| Vec::with_capacity(times.len())).collect();
        let mut modes = Vec::with_capacity(times.len());
        let sampler = SampleObserver::new(times.into_iter(), |sample: &ModelSample| {
            let ModelSample { time_s, pose, head_drop_m, tip_velocity_m_per_s, normal_n, friction_n, .. } =
                *sample;
            let [tip_x, tip_y, head_x, head_y] = recorded_points_m(&scene.linkage, sample);
            let angles = [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
            let own = if is_slider { vec![tip_x - head_x] } else { [&angles[..], &[head_drop_m]].concat() };
            let rest = [tip_velocity_m_per_s, normal_n, friction_n];
            let row = [time_s, tip_x, tip_y, head_x, head_y].into_iter().chain(own).chain(rest);
            columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
            modes.push(sample.mode.name());
        });
        let (mut audit, mut transitions) = (EnergyAudit::default(), Transitions::default());
        let (effort, clock) = (SolverOptions::from_scene(&scene), std::time::Instant::now());
        let mut observers = ((sampler, StopFlag(stop)), (&mut audit, &mut transitions));
        let mut errors_s = Vec::new();
        let receive = |_: &Transition, error_s: Option<f64>| errors_s.push(error_s.unwrap_or(f64::NAN));
        let predicted =
            predict_errors.then(|| run_with_predicted_errors(&scene, effort, &mut observers, receive));
        let run = match &predicted {
            Some(predicted) => predicted.run,
            None => run_scene_with(&scene, effort, &mut observers),
        };
        let wall_s = clock.elapsed().as_secs_f64();
        let mut summary = SimulationSummary::new(&scene, &run, &audit, wall_s, &effort);
        if let Some(predicted) = &predicted {
            summary.predicted_time_error_s = predicted.largest_error_s;
            summary.undetermined_after_s = Some(predicted.undetermined_after_s);
        }
        (columns, modes, transitions.0, predicted.map(|_| errors_s), serde_json::to_string(&summary))
    })?;
    let summary = summary.map_err(|error| errors::internal_error(py, error))?;
    let samples = PyDict::new(py);
    for (name, column) in names.split(',').zip(columns) {
        samples.set_item(name, PyArray1::from_vec(py, column))?;
    }
    let events = PyDict::new(py);
    let times = transitions.iter().map(|transition| transition.time_s).collect();
    events.set_item("time_s", PyArray1::from_vec(py, times))?;
    events.set_item("from", transitions.iter().map(|t| t.from.name()).collect::<Vec<_>>())?;
    events.set_item("to", transitions.iter().map(|t| t.to.name()).collect::<Vec<_>>())?;
    events.set_item("cause", transitions.iter().map(|t| t.cause.name()).collect::<Vec<_>>())?;
    if let Some(errors_s) = errors {
        events.set_item("predicted_time_error_s", PyArray1::from_vec(py, errors_s))?;
    }
    Ok((samples, modes, events, summary))
}
