//! Reads job.toml and checks it completely before anything runs. `docs/keys.md` lists every key.

/// Returns early from a check with an error about `$key`; the problem is formatted as by [`format!`].
macro_rules! refuse {
    ($key:expr, $($problem:tt)+) => {
        return $crate::toml_file::refuse_key($key, std::fmt::format(format_args!($($problem)+)))
    };
}

mod as_written;
pub mod checks;
mod conditions;
mod parameters;
mod settings;
mod targets;
mod traces;

use super::search::SearchSettings;
use super::target_value::TargetCalibration;
use crate::feature::Feature;
use crate::model::friction::FrictionShape;
use crate::simulate::twin::Camera;
use crate::toml_file::{self, KeyRefusal, TomlError, check_above_zero, check_format, parse_toml};
pub(crate) use conditions::{FeatureCamera, HeadSource, JobCondition, is_same_quantity};
pub use parameters::FreeParameter;
pub(crate) use parameters::{Constants, NuisanceParameter};
use serde::Serialize;
pub(crate) use settings::{Ensemble, IntervalSettings};
pub use targets::{FitTarget, TargetSource, TargetStage};
pub(crate) use traces::{CameraPriorSds, TraceChannel, TraceTarget};

/// Name of a condition, the parameter values that it sets, and whether it is held out of the fit.
type ConditionIdentity<'a> = (&'a str, &'a [(String, f64)], bool);

/// The part of a job on which the cost of a point depends.
#[derive(Serialize)]
pub(super) struct JobIdentity<'a> {
    conditions: Vec<ConditionIdentity<'a>>,
    camera: Option<Camera>,
    parameters: &'a [FreeParameter],
    /// Constants that are free within priors. The entry is omitted if all constants are exact, so that a job
    /// without freed constants keeps its fingerprint.
    #[serde(skip_serializing_if = "Constants::is_none")]
    constants: &'a Constants,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    traces: &'a [TraceTarget],
    /// Cameras on which a fitted feature depends, with the indices of their conditions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cameras: Vec<(usize, FeatureCamera)>,
    #[serde(skip_serializing_if = "Option::is_none")]
    laws: Option<&'a [FrictionShape]>,
    aims: &'a [FitTarget],
    ensemble: Ensemble,
    largest_tilt_rad: Option<f64>,
}

/// A checked job.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Title for pages and figures.
    pub title: String,
    /// Conditions with a recording, then those without one, each in the order of the file; at least one.
    pub conditions: Vec<JobCondition>,
    /// Camera of the conditions that have no recording.
    pub camera: Option<Camera>,
    /// Free parameters.
    pub parameters: Vec<FreeParameter>,
    /// Constants that are free within priors.
    pub constants: Constants,
    /// Laws of friction that are compared with that of the scene; `None` if the job names none, and empty for
    /// no comparison.
    pub laws: Option<Vec<FrictionShape>>,
    /// Fitted traces in the order of the file; empty in a job on features.
    pub traces: Vec<TraceTarget>,
    /// Components first, then features, in the order of the file.
    pub targets: Vec<FitTarget>,
    /// Budgets and seed of the search.
    pub search: SearchSettings,
    /// Ensemble of starting states over which features are averaged.
    pub ensemble: Ensemble,
    /// Largest plausible tilt of neck and lip from the vertical, rad; `None` for no limit.
    pub largest_tilt_rad: Option<f64>,
    /// Settings of the intervals.
    pub intervals: IntervalSettings,
}

impl Job {
    /// Reads and checks a job that fits parameters of a scene; `file` is the name of the job file in error
    /// messages.
    ///
    /// # Errors
    /// [`JobError`] at the first problem.
    pub fn parse(file: &str, text: &str) -> Result<Self, JobError> {
        Self::parse_with_names(file, text, &crate::model::parameters::parameter_names())
    }

    /// Like [`Self::parse`], for a model whose parameters have the names `known`.
    ///
    /// # Errors
    /// [`JobError`] at the first problem.
    pub fn parse_with_names(file: &str, text: &str, known: &[&str]) -> Result<Self, JobError> {
        let written: as_written::JobFile = parse_toml(file, text)?;
        check_format(file, written.format)?;
        Self::validate(&written, known).map_err(|(key, problem)| {
            let file = file.to_owned();
            JobError::Value { file, key, problem }
        })
    }

    /// The JSON Schema of job.toml, for editors and error messages.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        toml_file::schema_of::<as_written::JobFile>()
    }

    /// Names of the free parameters, in job order.
    #[must_use]
    pub fn parameter_names(&self) -> Vec<String> {
        self.parameters.iter().map(|p| p.name.clone()).collect()
    }

    /// Features of the targets, in the order of the targets.
    #[must_use]
    pub fn features(&self) -> Vec<Feature> {
        self.targets.iter().map(|aim| aim.feature.clone()).collect()
    }

    /// Paths of the recordings, relative to the job file. The first recording belongs to the first condition,
    /// and so on.
    pub fn recordings(&self) -> impl Iterator<Item = &str> {
        self.conditions.iter().filter_map(|condition| condition.recording.as_deref())
    }

    /// The part of the job on which the cost of a point depends. Title, seed, budgets, interval settings and
    /// file paths are excluded, so that a fit can continue with a larger budget.
    pub(super) fn identity(&self) -> JobIdentity<'_> {
        JobIdentity {
            conditions: self.conditions.iter().map(|c| (&*c.name, &*c.set, c.held_out)).collect(),
            camera: self.camera,
            parameters: &self.parameters,
            constants: &self.constants,
            traces: &self.traces,
            cameras: self.used_cameras(),
            laws: self.laws.as_deref(),
            aims: &self.targets,
            ensemble: self.ensemble,
            largest_tilt_rad: self.largest_tilt_rad,
        }
    }

    /// Cameras on which a fitted feature depends, with the indices of their conditions.
    fn used_cameras(&self) -> Vec<(usize, FeatureCamera)> {
        let used = |at: usize| {
            let mut aims = self.targets.iter().filter(|aim| aim.feature.condition == at && !aim.held_out);
            aims.any(|aim| self.target_calibration(aim).is_some())
        };
        let cameras = self.conditions.iter().enumerate().filter_map(|(at, c)| Some((at, c.camera?)));
        cameras.filter(|(at, _)| used(*at)).collect()
    }

    /// Dependence of a target on the uncertain calibration of its camera. `None` for a feature that is not a
    /// length, for a target whose value the job gives, and in a job with traces.
    pub(crate) fn target_calibration(&self, aim: &FitTarget) -> Option<TargetCalibration> {
        let measured = matches!(aim.source, TargetSource::Measured { .. }) && self.traces.is_empty();
        let condition = aim.feature.condition;
        let camera = self.conditions.get(condition)?.camera.filter(|_| measured)?;
        let FeatureCamera { scale_sd, offset_sd_m } = camera;
        let length = aim.feature.reading.length_calibration()?;
        let found = TargetCalibration { condition, scale_sd, offset_sd_m, length };
        (found.standard_deviations() != [0.0; 2]).then_some(found)
    }

    fn validate(written: &as_written::JobFile, known: &[&str]) -> Result<Self, KeyRefusal> {
        settings::check_counts(written)?;
        let conditions = conditions::check_conditions(written, known)?;
        let camera = settings::check_camera_table(written)?;
        let traces = traces::check_traces(&written.trace, &conditions)?;
        let parameters = parameters::check_parameters(&written.parameter, known, &traces)?;
        parameters.iter().try_for_each(|p| conditions::check_not_set(&conditions, &p.name))?;
        conditions::check_no_camera_with_traces(written)?;
        let constants = parameters::check_constants(written, &parameters, known)?;
        constants.listed_names().try_for_each(|name| conditions::check_not_set(&conditions, name))?;
        let nyquist_hz = camera.map(|c| c.frame_rate_hz / 2.0);
        let targets = targets::check_targets(written, &conditions, nyquist_hz)?;
        Ok(Self {
            title: written.title.clone(),
            conditions,
            camera,
            parameters,
            constants,
            laws: settings::check_laws(written)?,
            traces,
            targets,
            search: settings::check_search(written)?,
            ensemble: settings::check_ensemble(written)?,
            largest_tilt_rad: settings::check_largest_tilt_rad(written)?,
            intervals: settings::check_intervals(written)?,
        })
    }
}

/// An invalid job.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum JobError {
    /// The file is not TOML of the right structure.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// An invalid value.
    #[error("{file}: {key}: {problem}")]
    Value {
        /// Name of the job file as the user gave it.
        file: String,
        /// The invalid key, preceded by the name of the entry that contains it.
        key: String,
        /// Value found, value expected, and advice.
        problem: String,
    },
}

#[cfg(test)]
mod tests;
