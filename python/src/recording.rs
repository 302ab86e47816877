//! Recordings and their spectra.

use crate::errors::{self, catch_panic};
use crate::workers;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::Arc;
use wiperlab::cli::read::{self, SpectrumOptions};
use wiperlab::recording::files::RecordingFile;
use wiperlab::recording::{self, FrameGrid, Traces};

/// Tracked positions of tip and head in every frame.
#[pyclass(module = "wiperlab", frozen, from_py_object, name = "Recording")]
#[derive(Clone)]
pub struct PyRecording {
    pub inner: Arc<recording::Recording>,
    /// Exposure of a frame, s, if known.
    #[pyo3(get)]
    exposure_s: Option<f64>,
    /// The description, if the recording was read from a folder with one.
    file: Option<Arc<RecordingFile>>,
}

/// Times of the frames: the time of each frame, s, or a constant frame rate, 1/s.
#[derive(FromPyObject)]
enum PyFrameClock<'py> {
    Times(PyReadonlyArray1<'py, f64>),
    Rate(f64),
}

#[pymethods]
impl PyRecording {
    /// Reads the folder of a recording, or a single trace.csv.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let loaded = workers::run_interruptible(py, None, move |_| read::read_recording(&path))?;
        let (recording, file) = loaded.map_err(|failure| errors::failure_error(py, failure))?;
        let exposure_s = file.as_ref().and_then(|file| file.camera.exposure_s);
        Ok(Self { inner: Arc::new(recording), exposure_s, file: file.map(Arc::new) })
    }

    /// Makes a recording from columns with one value per frame; NaN means that a position was not tracked.
    #[staticmethod]
    #[pyo3(signature = (name, clock, columns, *, start_s, frame_rate_sd_hz, exposure_s, synthetic))]
    #[expect(clippy::too_many_arguments, reason = "a Python function has named arguments")]
    fn from_columns(
        py: Python<'_>,
        name: &str,
        clock: PyFrameClock<'_>,
        columns: Bound<'_, PyDict>,
        start_s: f64,
        frame_rate_sd_hz: Option<f64>,
        exposure_s: Option<f64>,
        synthetic: bool,
    ) -> PyResult<Self> {
        catch_panic(py, || {
            let column = |name: &str| -> PyResult<Option<Vec<Option<f64>>>> {
                let Some(found) = columns.get_item(name)? else { return Ok(None) };
                let found: PyReadonlyArray1<'_, f64> = found.extract()?;
                Ok(Some(found.as_array().iter().map(|x| (!x.is_nan()).then_some(*x)).collect()))
            };
            let frames = columns.values().iter().map(|c| c.len()).next().transpose()?.unwrap_or(0);
            let place = |name: &str| Ok::<_, PyErr>(column(name)?.unwrap_or_else(|| vec![None; frames]));
            let traces = Traces {
                tip_x_m: place("tip_x_m")?,
                tip_y_m: place("tip_y_m")?,
                head_x_m: place("head_x_m")?,
                head_y_m: place("head_y_m")?,
                tip_confidence: column("tip_confidence")?,
                head_confidence: column("head_confidence")?,
            };
            let recording = match clock {
                PyFrameClock::Rate(frame_rate_hz) => {
                    let grid = FrameGrid { start_s, frame_rate_hz, frames };
                    recording::Recording::new(name, grid, traces, synthetic)
                }
                PyFrameClock::Times(times_s) => {
                    let times_s = times_s.as_array().to_vec();
                    recording::Recording::from_times(name, times_s, traces, synthetic)
                }
            };
            let recording = recording.and_then(|recording| recording.with_frame_rate_sd(frame_rate_sd_hz));
            let recording = recording.map_err(|error| errors::input_error(py, format!("{name}: {error}")))?;
            Ok(Self { inner: Arc::new(recording), exposure_s, file: None })
        })
    }

    /// Positions by column name, m, one value per frame; NaN in frames in which the point was not tracked.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (name, column) in self.inner.traces().columns() {
            let column = column.iter().map(|x| x.unwrap_or(f64::NAN)).collect();
            all.set_item(name, PyArray1::from_vec(py, column))?;
        }
        Ok(all)
    }

    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, (0..self.inner.grid().frames).map(|i| self.inner.time_s(i)).collect())
    }

    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    #[getter]
    fn frame_rate_hz(&self) -> f64 {
        self.inner.grid().frame_rate_hz
    }

    #[getter]
    fn frame_rate_sd_hz(&self) -> Option<f64> {
        self.inner.frame_rate_sd_hz()
    }

    #[getter]
    fn has_true_times(&self) -> bool {
        self.inner.frame_times_s().is_some()
    }

    #[getter]
    fn start_s(&self) -> f64 {
        self.inner.grid().start_s
    }

    #[getter]
    fn is_synthetic(&self) -> bool {
        self.inner.is_synthetic()
    }

    fn __len__(&self) -> usize {
        self.inner.grid().frames
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.inner == other.inner && self.exposure_s == other.exposure_s
    }
}

/// Analyses a recording. Returns the contents of the files that `wiperlab spectrum` writes, by file name.
#[pyfunction]
#[pyo3(signature = (recording, channel, window, detrend, band_hz, max_components, exposure_s))]
#[expect(clippy::too_many_arguments, reason = "a Python function has named arguments")]
pub fn analyse<'py>(
    py: Python<'py>,
    recording: &PyRecording,
    channel: String,
    window: String,
    detrend: String,
    band_hz: Option<(f64, f64)>,
    max_components: Option<usize>,
    exposure_s: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let exposure_s = exposure_s.or(recording.exposure_s);
    let of = SpectrumOptions { channel, window, detrend, band_hz, max_components, exposure_s };
    let PyRecording { inner, file, .. } = recording.clone();
    let files =
        workers::run_detached(py, move || read::spectrum_files((*inner).clone(), file.as_deref(), &of))?;
    let all = PyDict::new(py);
    for (name, bytes) in files.map_err(|failure| errors::failure_error(py, failure))? {
        all.set_item(name, PyBytes::new(py, &bytes))?;
    }
    Ok(all)
}
