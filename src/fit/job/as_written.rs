//! The contents of job.toml as written in the file. Only types and keys are checked here, not whether values
//! are consistent.

use crate::feature::{Keys, define_entry, with_reading_keys};
use crate::fit::bounds::BoundsSpacing;
use crate::simulate::twin::Camera;
use crate::toml_file::NumberPair;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

/// A fit: the scene, its free parameters, and the recordings or published numbers that the model must meet.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "job.toml")]
pub(crate) struct JobFile {
    /// Version of the format: 1.
    pub format: u32,
    /// Title for pages and figures.
    pub title: String,
    /// Path of the scene that gives all values that the job does not; relative to this file.
    pub scene: String,
    /// Seed of the search, a whole number.
    pub seed: u64,
    /// Starting states over which the features of the model are averaged.
    pub ensemble: Option<JobEnsembleTable>,
    /// Recordings that are fitted.
    #[serde(default)]
    pub recording: Vec<JobRecordingTable>,
    /// Operating conditions without a recording.
    #[serde(default)]
    pub condition: Vec<JobConditionTable>,
    /// Camera of the conditions without a recording.
    pub camera: Option<Camera>,
    /// Free parameters.
    #[serde(default)]
    pub parameter: Vec<JobParameterTable>,
    /// Constants of the scene that are free within priors, in a job with [[trace]]: "exact" for none, "3 %"
    /// for all, or a list; if left out, every constant within the default prior of its kind.
    pub nuisance: Option<JobNuisanceEntry>,
    /// Laws of friction, "exponential", "stribeck" or "rational", that are compared with the law of the
    /// scene, in a job with [[trace]]. The law of the scene with two further terms, a limit at rest and a
    /// rise with speed, is always compared, unless the list is empty.
    pub laws: Option<Vec<String>>,
    /// Recordings of which every frame is fitted.
    #[serde(default)]
    pub trace: Vec<JobTraceTable>,
    /// Limits of plausible runs.
    pub plausible: Option<JobPlausibleTable>,
    /// Frequencies that the model must meet.
    #[serde(default)]
    pub component: Vec<JobComponentTable>,
    /// Other features that the model must meet, one entry each.
    #[serde(default)]
    pub feature: Vec<Feature>,
    /// Budgets of a search on features.
    pub search: Option<JobSearchTable>,
    /// Methods for the intervals.
    pub intervals: Option<JobIntervalsTable>,
}

/// Starting states over which the features of the model are averaged.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobEnsembleTable {
    /// Number of starting states, 1 to 64; 1 if left out.
    pub members: Option<usize>,
    /// Relative spread of the starting states, above 0 and at most 1; 0.1 if left out.
    pub spread: Option<f64>,
}

/// A recording that is fitted.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobRecordingTable {
    /// Name of the recording, different from every other; "recording N" if left out.
    pub name: Option<String>,
    /// Folder of the recording, or its trace.csv; relative to this file.
    pub path: String,
    /// Path of the scene of this recording; that of the job if left out.
    pub scene: Option<String>,
    /// Drive of the model: "scene" for that of the scene; "recording" for the recorded head, which then
    /// replaces [drive] and the times of the run; "scene" if left out.
    pub drive: Option<String>,
    /// Operating condition: values that replace those of the scene, by parameter name, SI.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: toml::Table,
    /// Whether its features are only predicted, not fitted; false if left out.
    #[serde(default)]
    pub held_out: bool,
    /// "exact", or a table of the camera's uncertain calibration; only without [[trace]].
    pub camera: Option<RecordingCamera>,
}

/// An operating condition without a recording, for which only published numbers are known.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobConditionTable {
    /// Name of the condition, different from every other.
    pub name: String,
    /// Path of the scene of this condition; that of the job if left out.
    pub scene: Option<String>,
    /// Values that replace those of the scene, by parameter name, SI.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: toml::Table,
    /// Whether its features are only predicted, not fitted; false if left out.
    #[serde(default)]
    pub held_out: bool,
}

/// A free parameter.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobParameterTable {
    /// Key of the scene with its table, such as "friction.a".
    pub name: String,
    /// Lower bound, SI.
    pub lower: f64,
    /// Upper bound, SI.
    pub upper: f64,
    /// Scale on which the search moves, "log" or "linear".
    pub scale: BoundsSpacing,
    /// Prior knowledge of the parameter; none if left out.
    pub prior: Option<JobPriorTable>,
    /// "job" for one value in all recordings, or "recording" for one in each; "job" if left out.
    #[serde(default)]
    pub scope: ParameterScope,
}

/// The recordings that share the value of a parameter.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ParameterScope {
    /// All recordings share one value.
    #[default]
    Job,
    /// Each recording has its own value.
    Recording,
}

/// Prior knowledge of a parameter: a normal distribution.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobPriorTable {
    /// Mean of the prior, within the bounds, SI.
    pub mean: f64,
    /// Standard deviation of the prior, in the unit of the parameter.
    pub sd: Option<f64>,
    /// Standard deviation relative to the mean, instead of sd.
    pub sd_relative: Option<f64>,
}

/// Limits of plausible runs.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobPlausibleTable {
    /// Largest angle of neck and lip from the vertical, degrees; a run that exceeds it fails.
    pub largest_tilt_deg: Option<f64>,
}

/// A frequency that the model must meet.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobComponentTable {
    /// Name of the component, different from every other component and feature.
    pub name: String,
    /// Channel, one of "deflection", "head-drop", "tip-x" and "head-x".
    pub channel: String,
    /// Frames in which the frequency is measured, as for `wiperlab spectrum`.
    pub window: String,
    /// Lowest and highest frequency of the band, Hz.
    pub band_hz: NumberPair,
    /// Trend that is removed first; "cubic" if left out.
    pub detrend: Option<String>,
    /// Published target, Hz; measured on the recording if left out.
    pub target_hz: Option<f64>,
    /// Standard deviation of the published target, or smallest one of a measured target, Hz.
    pub target_sd_hz: Option<f64>,
    /// Largest relative error that passes; 0.02 if left out.
    pub tolerance_relative: Option<f64>,
    /// Name or number of the recording or condition; 1 if left out.
    pub recording: Option<ConditionReference>,
}

with_reading_keys!(define_entry {
    "A feature that the model must meet."
    Feature {
        /// Name of the feature, different from every other component and feature; the kind if left out.
        name: Option<String>,
        /// Smallest standard deviation, as a fraction of the measured value.
        sd_relative: Option<f64>,
        /// Published target, SI; measured on the recording if left out.
        target: Option<f64>,
        /// Standard deviation of the published target, SI.
        target_sd: Option<f64>,
        /// Name or number of the recording or condition; 1 if left out.
        recording: Option<ConditionReference>,
    }
});

impl JobComponentTable {
    pub(crate) fn reading_keys(&self) -> Keys {
        Keys {
            channel: Some(self.channel.clone()),
            window: Some(self.window.clone()),
            band_hz: Some(self.band_hz),
            detrend: self.detrend.clone(),
            ..Keys::default()
        }
    }
}

/// Budgets of a search on features.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobSearchTable {
    /// Number of evaluations of the first stage.
    pub global_evaluations: Option<usize>,
    /// Number of evaluations of the second stage.
    pub local_evaluations: Option<usize>,
    /// Number of points in a cloud; 24 if left out.
    pub particles: Option<usize>,
    /// Number of generations without progress after which a cloud stops; 20 if left out.
    pub stagnation_generations: Option<usize>,
    /// Number of points from which local searches start, 1 to 64; 6 if left out.
    pub starts: Option<usize>,
}

/// Methods for the intervals.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobIntervalsTable {
    /// Whether intervals from profiles of the cost are computed; true if left out.
    pub profile: Option<bool>,
    /// Number of fits to twins of the best model, 0 to 1000; if left out, 40, or 0 with [[trace]].
    pub bootstrap: Option<usize>,
}

/// A recording of which every frame is fitted.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobTraceTable {
    /// Name or number of the recording; 1 if left out.
    pub recording: Option<ConditionReference>,
    /// Fitted channels: "tip-x", "head-drop" or "deflection"; if left out, the first two where the
    /// recording has them.
    pub channels: Option<Vec<String>>,
    /// Length of the segments in each stage, in ascending order, s.
    pub segment_s: Option<Vec<f64>>,
    /// Frames that are fitted; all if left out.
    pub window: Option<String>,
    /// Standard deviation of a tracked coordinate, m; measured if left out.
    pub noise_m: Option<f64>,
    /// Drive of the model: "recording" for the recorded head, "scene" for that of the scene; if left out,
    /// "recording" where the head is tracked.
    pub drive: Option<String>,
    /// Uncertain calibration of the camera.
    #[serde(default)]
    pub camera: JobTraceCameraTable,
}

/// Standard deviations of the uncertain numbers of a camera; 0 fixes a number.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobTraceCameraTable {
    /// Standard deviation of its tilt, degrees; 0.3 if left out.
    pub tilt_sd_deg: Option<f64>,
    /// Relative standard deviation of its scale; 0.005 if left out.
    pub scale_sd: Option<f64>,
    /// Standard deviation of the distance of a marker from the point that it marks, m; 0.001 if left out.
    pub offset_sd_m: Option<f64>,
    /// Standard deviation of the speed at which these distances drift, m/s; 0 if left out.
    pub drift_sd_m_per_s: Option<f64>,
    /// Standard deviation of its clock against the drive, s; if left out, 0, or 0.001 with drive = "scene".
    pub clock_sd_s: Option<f64>,
}

/// The camera of a recording for features: `"exact"`, or a table of its uncertain calibration.
#[derive(Debug, JsonSchema)]
#[schemars(untagged, extend("x-expected" = "\"exact\", or a table such as { scale_sd = 0.005, offset_sd_m = 0.001 }"))]
pub(crate) enum RecordingCamera {
    Word(String),
    Doubt(JobTraceCameraTable),
}

impl<'de> Deserialize<'de> for RecordingCamera {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RecordingCameraVisitor)
    }
}

struct RecordingCameraVisitor;

impl<'de> Visitor<'de> for RecordingCameraVisitor {
    type Value = RecordingCamera;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"exact\", or a table such as { scale_sd = 0.005, offset_sd_m = 0.001 }")
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<RecordingCamera, E> {
        Ok(RecordingCamera::Word(value.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RecordingCamera, A::Error> {
        JobTraceCameraTable::deserialize(MapAccessDeserializer::new(map)).map(RecordingCamera::Doubt)
    }
}

/// Constants that are free within a prior: all of them with one deviation, or those of a list.
#[derive(Debug, JsonSchema)]
#[schemars(untagged, extend("x-expected" = "\"exact\", a percentage such as \"3 %\", or a list such as [{ name = \"blade.lip_mass_kg\", sd = \"5 %\" }]"))]
pub(crate) enum JobNuisanceEntry {
    All(String),
    Listed(Vec<ListedNuisance>),
}

/// A constant of the scene that is free within a prior.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ListedNuisance {
    /// Key of the scene with its table, such as "blade.lip_mass_kg".
    pub name: String,
    /// Standard deviation, such as "5 %".
    pub sd: Option<String>,
    /// Standard deviation as a fraction, instead of sd.
    pub sd_relative: Option<f64>,
}

impl<'de> Deserialize<'de> for JobNuisanceEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NuisanceVisitor)
    }
}

struct NuisanceVisitor;

impl<'de> Visitor<'de> for NuisanceVisitor {
    type Value = JobNuisanceEntry;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"exact\", a percentage such as \"3 %\", or a list such as [{ name = \"blade.lip_mass_kg\", sd = \"5 %\" }]")
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<JobNuisanceEntry, E> {
        Ok(JobNuisanceEntry::All(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<JobNuisanceEntry, A::Error> {
        let mut listed = Vec::new();
        while let Some(one) = list.next_element()? {
            listed.push(one);
        }
        Ok(JobNuisanceEntry::Listed(listed))
    }
}

/// A recording or condition: its number, counted from 1, or its name.
#[derive(Debug, JsonSchema)]
#[schemars(untagged, extend("x-expected" = "the number of a recording, counted from 1, or its name"))]
pub(crate) enum ConditionReference {
    Number(usize),
    Name(String),
}

impl<'de> Deserialize<'de> for ConditionReference {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ConditionReferenceVisitor)
    }
}

struct ConditionReferenceVisitor;

impl Visitor<'_> for ConditionReferenceVisitor {
    type Value = ConditionReference;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the number of a recording, counted from 1, or its name")
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<ConditionReference, E> {
        // a negative number becomes 0, which is refused later with the list of the numbers that exist
        Ok(ConditionReference::Number(usize::try_from(value).unwrap_or(0)))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<ConditionReference, E> {
        Ok(ConditionReference::Name(value.to_owned()))
    }
}
