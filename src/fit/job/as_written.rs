//! job.toml as people write it: types and keys only, nothing checked against anything else.

use crate::feature::{Keys, define_entry, with_reading_keys};
use crate::fit::bounds::BoundsSpacing;
use crate::simulate::twin::Camera;
use crate::toml_file::NumberPair;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

/// What is fitted to what.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "job.toml")]
pub(crate) struct JobFile {
    /// Version of the format: 1.
    pub format: u32,
    /// Title for pages and figures.
    pub title: String,
    /// Scene that gives all values that the job does not; relative to this file.
    pub scene: String,
    /// Seed of the search, a whole number.
    pub seed: u64,
    /// Starting states over which the model is averaged.
    pub ensemble: Option<JobEnsembleTable>,
    /// Recordings that are fitted.
    #[serde(default)]
    pub recording: Vec<JobRecordingTable>,
    /// Operating conditions with published numbers only.
    #[serde(default)]
    pub condition: Vec<JobConditionTable>,
    /// Camera of a condition without a recording.
    pub camera: Option<Camera>,
    /// Free parameters.
    #[serde(default)]
    pub parameter: Vec<JobParameterTable>,
    /// Constants of the scene that are freed within priors, with [[trace]]: "3 %", or a list.
    pub nuisance: Option<JobNuisanceEntry>,
    /// Recordings whose frames are fitted.
    #[serde(default)]
    pub trace: Vec<JobTraceTable>,
    /// Which runs count.
    pub plausible: Option<JobPlausibleTable>,
    /// Frequencies that the model must meet.
    #[serde(default)]
    pub component: Vec<JobComponentTable>,
    /// Other features that the model must meet.
    #[serde(default)]
    pub feature: Vec<Feature>,
    /// Budgets of a search on features.
    pub search: Option<JobSearchTable>,
    /// How intervals are found.
    pub intervals: Option<JobIntervalsTable>,
}

/// Starting states over which the model is averaged.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobEnsembleTable {
    /// Number of starting states, 1 to 64; 1 if left out.
    pub members: Option<usize>,
    /// Their relative spread, above 0 and at most 1; 0.1 if left out.
    pub spread: Option<f64>,
}

/// A recording that is fitted.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobRecordingTable {
    /// Different from every other; "recording N" if left out.
    pub name: Option<String>,
    /// Folder of the recording, or its trace.csv; relative to this file.
    pub path: String,
    /// Its own scene; that of the job if left out.
    pub scene: Option<String>,
    /// "scene" for the drive of the scene, "recording" for its own head, which then replaces [drive] and the
    /// times of the run; "scene" if left out.
    pub drive: Option<String>,
    /// Operating condition: values of the scene by parameter name, SI.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: toml::Table,
    /// Predict it, do not fit it; false if left out.
    #[serde(default)]
    pub held_out: bool,
    /// "exact", or what is not known of the camera; only without [[trace]].
    pub camera: Option<RecordingCamera>,
}

/// An operating condition with published numbers only.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobConditionTable {
    /// Different from every other.
    pub name: String,
    /// Its own scene; that of the job if left out.
    pub scene: Option<String>,
    /// Values of the scene by parameter name, SI.
    #[serde(default)]
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub set: toml::Table,
    /// Predict it, do not fit it; false if left out.
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
    /// How the search moves along it.
    pub scale: BoundsSpacing,
    /// What is known beforehand; nothing if left out.
    pub prior: Option<JobPriorTable>,
}

/// What is known of a parameter beforehand.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobPriorTable {
    /// Mean, within the bounds, SI.
    pub mean: f64,
    /// Standard deviation in the unit of the parameter.
    pub sd: Option<f64>,
    /// Standard deviation relative to the mean, in place of sd.
    pub sd_relative: Option<f64>,
}

/// Which runs count.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobPlausibleTable {
    /// A run in which neck or lip leans farther from the vertical fails, degrees.
    pub largest_tilt_deg: Option<f64>,
}

/// A frequency that the model must meet.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobComponentTable {
    /// Different from every other component and feature.
    pub name: String,
    /// "deflection", "head-drop", "tip-x" or "head-x".
    pub channel: String,
    /// Frames from which it is read, as of `wiperlab spectrum`.
    pub window: String,
    /// Lowest and highest frequency, Hz.
    pub band_hz: NumberPair,
    /// What is removed first; "cubic" if left out.
    pub detrend: Option<String>,
    /// Published target, Hz; measured on the recording if left out.
    pub target_hz: Option<f64>,
    /// Its standard deviation, or the least one of a measured target, Hz.
    pub target_sd_hz: Option<f64>,
    /// Largest relative error that passes; 0.02 if left out.
    pub tolerance_relative: Option<f64>,
    /// Name or number of the recording; 1 if left out.
    pub recording: Option<ConditionReference>,
}

with_reading_keys!(define_entry {
    "A feature that the model must meet."
    Feature {
        /// Different from every other component and feature; the kind if left out.
        name: Option<String>,
        /// Least deviation as a fraction of the measured value.
        sd_relative: Option<f64>,
        /// A published value, SI.
        target: Option<f64>,
        /// Its standard deviation, SI.
        target_sd: Option<f64>,
        /// Name or number of the recording; 1 if left out.
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
    /// Evaluations of the first stage.
    pub global_evaluations: Option<usize>,
    /// Evaluations of the second stage.
    pub local_evaluations: Option<usize>,
    /// Points in a cloud; 24 if left out.
    pub particles: Option<usize>,
    /// Generations without progress after which a cloud stops; 20 if left out.
    pub stagnation_generations: Option<usize>,
    /// Points from which a local search starts, 1 to 64; 6 if left out.
    pub starts: Option<usize>,
}

/// How intervals are found.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobIntervalsTable {
    /// Intervals from profiles of the cost; true if left out.
    pub profile: Option<bool>,
    /// Fits to twins of the best model, 0 to 1000.
    pub bootstrap: Option<usize>,
}

/// A recording of which every frame is fitted.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobTraceTable {
    /// Name or number of the recording; 1 if left out.
    pub recording: Option<ConditionReference>,
    /// "tip-x", "head-drop" or "deflection"; what it has of the first two if left out.
    pub channels: Option<Vec<String>>,
    /// Lengths of the segments of each stage, rising, s.
    pub segment_s: Option<Vec<f64>>,
    /// Frames that are fitted; all if left out.
    pub window: Option<String>,
    /// Standard deviation of a tracked coordinate, m; measured if left out.
    pub noise_m: Option<f64>,
    /// "recording" for its own head, "scene" for that of the scene.
    pub drive: Option<String>,
    /// What is not known of its camera.
    #[serde(default)]
    pub camera: JobTraceCameraTable,
}

/// What is not known of a camera: standard deviations; 0 holds one.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct JobTraceCameraTable {
    /// Of its tilt, degrees; 0.3 if left out.
    pub tilt_sd_deg: Option<f64>,
    /// Of its scale, relative; 0.005 if left out.
    pub scale_sd: Option<f64>,
    /// Of the place of a marker against the point that it stands for, m; 0.001 if left out.
    pub offset_sd_m: Option<f64>,
    /// Of the speed at which these places drift, m/s; 0 if left out.
    pub drift_sd_m_per_s: Option<f64>,
    /// Of its clock against the drive, s; 0, or 0.001 with drive = "scene".
    pub clock_sd_s: Option<f64>,
}

/// The camera of a recording from which features are read: `"exact"`, or what is not known of it.
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

/// Constants that are freed with a prior: all of them with one deviation, or those of a list.
#[derive(Debug, JsonSchema)]
#[schemars(untagged, extend("x-expected" = "a percentage such as \"3 %\", or a list such as [{ name = \"blade.lip_mass_kg\", sd = \"5 %\" }]"))]
pub(crate) enum JobNuisanceEntry {
    All(String),
    Listed(Vec<ListedNuisance>),
}

/// A constant of the scene that is freed within a prior.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ListedNuisance {
    /// Key of the scene with its table, such as "blade.lip_mass_kg".
    pub name: String,
    /// Standard deviation, such as "5 %".
    pub sd: Option<String>,
    /// The same as a fraction, in place of sd.
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
        f.write_str("a percentage such as \"3 %\", or a list such as [{ name = \"blade.lip_mass_kg\", sd = \"5 %\" }]")
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

/// A recording or condition by its number, counted from 1, or its name.
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
        // one below 1 is no number of a recording either way, and 0 is refused with the numbers that there
        // are
        Ok(ConditionReference::Number(usize::try_from(value).unwrap_or(0)))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<ConditionReference, E> {
        Ok(ConditionReference::Name(value.to_owned()))
    }
}
