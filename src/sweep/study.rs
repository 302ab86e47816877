//! sweep.toml: which parameters are varied and what is mapped, checked completely before anything runs.

mod as_written;
mod axis;
mod map;

pub use map::{SHEET_NAME, SweepMap};

use super::grid::{self, AxisValues, SweepAxis};
use super::sample::SamplePlan;
use crate::feature::Reading;
use crate::journal::fingerprint;
use crate::simulate::scene::{Scene, SceneError};
use crate::toml_file::{KeyRefusal, TomlError, check_format, parse_toml, refuse_key};
use crate::twin::Camera;
use serde::Serialize;

/// Most frames of a run: a mistyped rate is refused instead of filling memory, once for every thread.
pub const MOST_FRAMES: f64 = 1e6;

/// Most points of a map: 200 by 200 cells are as many as a figure in one column can show.
const MOST_MAPPED: usize = 40_000;

/// A checked study.
#[derive(Debug, Clone)]
pub struct Study {
    /// Title for figures.
    pub title: String,
    /// Path of the scene, relative to the file.
    pub scene: String,
    /// The camera through which the traces are read; no noise.
    pub camera: Camera,
    /// The parameters that are varied; the first one of a grid is the slowest.
    pub axes: Vec<SweepAxis>,
    /// How points are drawn, where they are not on a grid.
    pub sample: Option<SamplePlan>,
    /// What is mapped.
    pub maps: Vec<SweepMap>,
}

/// Why a study was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// It is not TOML of the right shape.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A value that cannot be used.
    #[error("{file}: {key}: {problem}")]
    Value {
        /// File as named by the user.
        file: String,
        /// The key, with the entry that it belongs to.
        key: String,
        /// What was found, what was expected, and what to do.
        problem: String,
    },
    /// The scene refuses a point of the grid.
    #[error("{file}: the point with {point}: {problem}")]
    Point {
        /// File as named by the user.
        file: String,
        /// Names and values.
        point: String,
        /// The scene's refusal.
        problem: Box<SceneError>,
    },
}

impl Study {
    /// Reads and checks a study; `file` is its name in refusals.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn parse(file: &str, text: &str) -> Result<Self, StudyError> {
        let written: as_written::StudyFile = parse_toml(file, text)?;
        check_format(file, written.format)?;
        Self::from_file(&written).map_err(|(key, problem)| StudyError::Value {
            file: file.to_owned(),
            key,
            problem,
        })
    }

    /// The same without axes, for points that come from elsewhere: it has one point, its scene.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn parse_maps(file: &str, text: &str) -> Result<Self, StudyError> {
        let written: as_written::StudyFile = parse_toml(file, text)?;
        check_format(file, written.format)?;
        let value = |(key, problem): KeyRefusal| StudyError::Value { file: file.to_owned(), key, problem };
        Self::from_axes(&written, Vec::new()).map_err(value)
    }

    /// Number of points.
    #[must_use]
    pub fn point_count(&self) -> usize {
        match self.sample {
            Some(sample) => sample.points,
            None => self.axes.iter().map(|axis| axis.values.len()).product(),
        }
    }

    /// Whether every map is drawn over the axes, point by point.
    #[must_use]
    pub fn is_mapped(&self) -> bool {
        self.sample.is_none() && self.axes.len() <= 2 && self.point_count() <= MOST_MAPPED
    }

    /// Whether there is a sheet with every map: one alone that is drawn has its own figure.
    #[must_use]
    pub fn has_sheet(&self) -> bool {
        self.maps.len() > 1 || !self.is_mapped()
    }

    /// Value of every axis at point `index`.
    #[must_use]
    pub fn point_values(&self, index: usize) -> Vec<f64> {
        let axes = self.axes.iter().map(|axis| AxisValues { of: &axis.values, spacing: axis.spacing });
        grid::point_values(&axes.collect::<Vec<_>>(), self.sample.as_ref(), index)
    }

    /// The scene of point `index`.
    ///
    /// # Errors
    /// The scene's refusal of a value.
    pub fn scene_of_point(&self, scene: &Scene, index: usize) -> Result<Scene, SceneError> {
        self.axes
            .iter()
            .zip(self.point_values(index))
            .try_fold(scene.clone(), |scene, (axis, value)| scene.with_parameter(axis.parameter.name, value))
    }

    /// Checks a study against its scene: its points are scenes (each of a small study, and as many of a large
    /// one, spread over all), windows in seconds lie in the run, and the camera fits it.
    ///
    /// # Errors
    /// [`StudyError`] at the first problem.
    pub fn check_scene(&self, file: &str, scene: &Scene) -> Result<(), StudyError> {
        let value = |(key, problem): KeyRefusal| StudyError::Value { file: file.to_owned(), key, problem };
        self.check_frames(scene).map_err(value)?;
        self.maps.iter().try_for_each(|map| map.check_window(scene)).map_err(value)?;
        let point = |index: usize| {
            let named = self
                .point_values(index)
                .into_iter()
                .zip(&self.axes)
                .map(|(value, axis)| format!("{} = {value}", axis.parameter.name));
            named.collect::<Vec<_>>().join(" and ")
        };
        let step = self.point_count().div_ceil(MOST_MAPPED).max(1);
        (0..self.point_count()).step_by(step).try_for_each(|index| {
            let refused = |problem| StudyError::Point {
                file: file.to_owned(),
                point: point(index),
                problem: Box::new(problem),
            };
            self.scene_of_point(scene, index).map(|_| ()).map_err(refused)
        })
    }

    /// SHA-256 over everything that decides the outcome, from [`fingerprint`]: values of the study and its
    /// scene, and the version of the program.
    #[must_use]
    pub fn fingerprint(&self, scene: &Scene) -> String {
        fingerprint(&StudyFingerprint {
            version: env!("CARGO_PKG_VERSION"),
            scene,
            camera: self.camera,
            axes: self.axes.iter().map(|axis| (axis.parameter.name, axis.values.as_slice())).collect(),
            sample: self.sample.map(|sample| (sample, self.axes.iter().map(|axis| axis.spacing).collect())),
            readings: self.maps.iter().map(|map| &map.reading).collect(),
        })
    }

    /// The JSON Schema of a study: for editors, and for messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        crate::toml_file::schema_of::<as_written::StudyFile>()
    }

    fn from_file(written: &as_written::StudyFile) -> Result<Self, KeyRefusal> {
        if written.scene.trim().is_empty() {
            return refuse_key(
                "scene",
                format!("found \"{}\", expected the path of a scene, relative to this file", written.scene),
            );
        }
        let axes = axis::check_axes(&written.axis, written.sample.as_ref())?;
        Self::from_axes(written, axes)
    }

    fn from_axes(written: &as_written::StudyFile, axes: Vec<SweepAxis>) -> Result<Self, KeyRefusal> {
        let camera = check_study_camera(&written.camera)?;
        let maps = map::check_maps(&written.map, camera.frame_rate_hz / 2.0)?;
        Ok(Self {
            title: written.title.clone(),
            scene: written.scene.clone(),
            camera,
            axes,
            sample: written.sample,
            maps,
        })
    }

    fn check_frames(&self, scene: &Scene) -> Result<(), KeyRefusal> {
        let frames = (scene.run.stop_s - scene.start_s) * self.camera.frame_rate_hz;
        if (1.0..=MOST_FRAMES).contains(&frames) {
            return Ok(());
        }
        let run = format!("{} s to {} s", scene.start_s, scene.run.stop_s);
        refuse_key(
            "camera.frame_rate_hz",
            format!(
                "found {frames:.3e} frames in the run from {run}, expected 1 to {MOST_FRAMES:e}; correct \
                 the rate or the run"
            ),
        )
    }
}

fn check_study_camera(written: &Camera) -> Result<Camera, KeyRefusal> {
    let Camera { frame_rate_hz, exposure_s } = *written;
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return refuse_key(
            "camera.frame_rate_hz",
            format!("found {frame_rate_hz}, expected a finite number above 0"),
        );
    }
    if !(exposure_s >= 0.0 && exposure_s * frame_rate_hz <= 1.0) {
        return refuse_key(
            "camera.exposure_s",
            format!("found {exposure_s}, expected 0 to {} (one frame)", 1.0 / frame_rate_hz),
        );
    }
    Ok(Camera { frame_rate_hz, exposure_s })
}

/// What decides the outcome of a study.
#[derive(Serialize)]
struct StudyFingerprint<'a> {
    version: &'static str,
    scene: &'a Scene,
    camera: Camera,
    axes: Vec<(&'static str, &'a [f64])>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sample: Option<(SamplePlan, Vec<grid::AxisSpacing>)>,
    readings: Vec<&'a Reading>,
}

#[cfg(test)]
mod tests;
