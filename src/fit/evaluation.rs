//! One evaluation of the cost: a point, the features of the model there, and their cost.

use crate::simulate::RunStatus;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;

/// A feature of the model at one point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Value of the feature, in its own SI unit; finite.
    pub value: f64,
    /// Standard deviation of the feature over the starting states, in the unit of the feature; 0 for a single
    /// state.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spread: f64,
    /// Level of the strongest spectral peak of the band relative to the peak that is assigned to the feature,
    /// dB. It is 0 if the assigned peak is the strongest, and for features without peaks.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub below_db: f64,
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// A feature of a model run: its value, or the reason why it has none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Observed {
    /// The feature has a value.
    Value(Observation),
    /// The feature has no value, for this reason.
    Missing(String),
}

impl Observed {
    /// Observation from a single run, with zero spread. A frequency counts as the frequency of the strongest
    /// peak.
    #[must_use]
    pub fn from_value(value: f64) -> Self {
        Self::Value(Observation { value, spread: 0.0, below_db: 0.0 })
    }

    /// The observation, if the feature has a value.
    pub(crate) fn observation(&self) -> Option<&Observation> {
        match self {
            Self::Value(observation) => Some(observation),
            Self::Missing(_) => None,
        }
    }

    /// The value of the feature, if it has one.
    pub(crate) fn value(&self) -> Option<f64> {
        self.observation().map(|observation| observation.value)
    }
}

/// One evaluation of the cost.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evaluation {
    /// Point in the unit box, one coordinate per parameter.
    pub unit: Vec<f64>,
    /// Parameter values in job order, in their SI units.
    pub values: Vec<f64>,
    /// Cost, finite and not negative.
    pub cost: f64,
    /// Cost in the first stage of the search: without the features that count in the last stage only, and
    /// with relative standard deviations of at least `FIRST_STAGE_SD_RELATIVE`.
    pub global_cost: f64,
    /// Features in the order of the targets; empty when the run failed.
    pub features: Vec<Observed>,
    /// Reason why the run failed, if it did.
    pub failure: Option<RunFailure>,
}

/// An evaluation without costs. The costs also depend on the scatter of the features, which the search
/// estimates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluationOutcome {
    /// Point in the unit box, one coordinate per parameter.
    pub unit: Vec<f64>,
    /// Parameter values in job order, in their SI units. They follow from the point and are not stored.
    #[serde(skip)]
    pub values: Vec<f64>,
    /// Features in the order of the targets; empty when the run failed.
    pub features: Vec<Observed>,
    /// Reason why the run failed, if it did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<RunFailure>,
}

impl From<Evaluation> for EvaluationOutcome {
    fn from(evaluation: Evaluation) -> Self {
        let Evaluation { unit, values, features, failure, .. } = evaluation;
        Self { unit, values, features, failure }
    }
}

/// Kind of reason why a run gave no features; failures are counted by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureReason {
    /// The run ended before its stop time.
    Ended(RunStatus),
    /// The scene refuses the parameters.
    Refused,
    /// Neck or lip leans farther from the vertical than the job allows.
    Tilt,
    /// The motion is not finite.
    NotFinite,
    /// A feature is not a number.
    NotANumber,
    /// The number of features differs from the number in the job.
    FeatureCount,
    /// The model panicked.
    Panic,
}

impl FailureReason {
    const ALL: [Self; 13] = [
        Self::Ended(RunStatus::ContactLost),
        Self::Ended(RunStatus::Jammed),
        Self::Ended(RunStatus::Indeterminate),
        Self::Ended(RunStatus::Chattering),
        Self::Ended(RunStatus::Diverged),
        Self::Ended(RunStatus::WorkLimit),
        Self::Ended(RunStatus::Interrupted),
        Self::Refused,
        Self::Tilt,
        Self::NotFinite,
        Self::NotANumber,
        Self::FeatureCount,
        Self::Panic,
    ];

    /// Name of the reason in files, such as `contact-lost`.
    pub(crate) fn as_str(self) -> &'static str {
        match self {
            Self::Ended(status) => status.name(),
            Self::Refused => "refused",
            Self::Tilt => "tilt",
            Self::NotFinite => "not-finite",
            Self::NotANumber => "not-a-number",
            Self::FeatureCount => "feature-count",
            Self::Panic => "panic",
        }
    }
}

impl fmt::Display for FailureReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Ordered by name, so that counts in files are in alphabetical order.
impl Ord for FailureReason {
    fn cmp(&self, other: &Self) -> Ordering {
        self.as_str().cmp(other.as_str())
    }
}

impl PartialOrd for FailureReason {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Serialize for FailureReason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for FailureReason {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = String::deserialize(deserializer)?;
        let known = Self::ALL.into_iter().find(|reason| reason.as_str() == word);
        known.ok_or_else(|| {
            let words = Self::ALL.map(Self::as_str).join(", ");
            D::Error::custom(format!("found the reason \"{word}\", expected one of {words}"))
        })
    }
}

/// A model run that gave no features.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(deny_unknown_fields)]
#[error("{reason}: {message}")]
pub struct RunFailure {
    /// Kind of failure.
    pub reason: FailureReason,
    /// Description of the failure.
    pub message: String,
    /// Fraction of the run that was completed, 0 to 1.
    pub progress: f64,
}

impl RunFailure {
    /// A failure after the fraction `progress` of the run.
    #[must_use]
    pub fn new(reason: FailureReason, message: impl Into<String>, progress: f64) -> Self {
        let progress = if progress.is_finite() { progress.clamp(0.0, 1.0) } else { 0.0 };
        Self { reason, message: message.into(), progress }
    }
}

/// Purpose of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EvaluationStage {
    /// Probes before the search, which test the identifiability of the parameters.
    Gate,
    /// Clouds of points over the whole box.
    Global,
    /// Local searches from the best points.
    Local,
    /// Finite differences around the best point.
    Sensitivity,
    /// Profiles along a parameter: the cost is minimised over the other parameters.
    Profile,
    /// Fits to twins of the best model.
    Bootstrap,
    /// Searches outside the 95 % interval of an identified parameter.
    Elsewhere,
}

impl EvaluationStage {
    /// Name of the stage in files and on a terminal.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gate => "gate",
            Self::Global => "global",
            Self::Local => "local",
            Self::Sensitivity => "sensitivity",
            Self::Profile => "profile",
            Self::Bootstrap => "bootstrap",
            Self::Elsewhere => "elsewhere",
        }
    }
}

/// Maps each parameter name to its value.
pub(super) fn map_names<T>(names: &[String], values: impl Iterator<Item = T>) -> BTreeMap<String, T> {
    names.iter().cloned().zip(values).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_reason_is_read_back_from_its_word() {
        for reason in FailureReason::ALL {
            let word = serde_json::to_string(&reason).unwrap();
            assert_eq!(serde_json::from_str::<FailureReason>(&word).unwrap(), reason);
        }
        let refused = serde_json::from_str::<FailureReason>("\"lost\"").unwrap_err().to_string();
        assert!(refused.contains("found the reason \"lost\", expected one of contact-lost, "), "{refused}");
    }
}
