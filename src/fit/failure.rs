//! Why a model run gave no features.

use crate::simulate::RunStatus;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
use std::cmp::Ordering;
use std::fmt;

/// Why a run gave no features, in a word by which failures are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureReason {
    /// The run ended before its stop time.
    Ended(RunStatus),
    /// The scene refuses the parameters.
    Refused,
    /// A link leans too far.
    Tilt,
    /// The motion is not finite.
    NotFinite,
    /// A feature is not a number.
    NotANumber,
    /// The model gave another number of features than the job has.
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

    /// The word in files, such as `contact-lost`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
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

/// By word, so that counts in files are in alphabetic order.
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
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{reason}: {message}")]
pub struct RunFailure {
    /// Why.
    pub reason: FailureReason,
    /// What happened, in words.
    pub message: String,
    /// How far the run came, from 0 (not at all) to 1 (to the end).
    pub progress: f64,
}

impl RunFailure {
    /// A failure after the given part of the run.
    #[must_use]
    pub fn new(reason: FailureReason, message: impl Into<String>, progress: f64) -> Self {
        let progress = if progress.is_finite() { progress.clamp(0.0, 1.0) } else { 0.0 };
        Self { reason, message: message.into(), progress }
    }
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
