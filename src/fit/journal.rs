//! Evaluations of a fit in a journal.

mod body;
mod difference;

pub use body::{FeatureHeaderBody, HeaderFeature, HeaderParameter};

use super::evaluation::{EvaluationOutcome, Observation, Observed};
use super::failure::{FailureReason, RunFailure};
use super::stage::EvaluationStage;
use crate::journal::{self, CheckpointKind, CheckpointRecord, ExactNumber};
use serde::{Deserialize, Serialize};

/// The journal of a fit.
pub type FeatureCheckpoint = journal::CheckpointFile<EvaluationRecord>;
/// Its header.
pub type FeatureHeader = journal::CheckpointHeader<FeatureHeaderBody>;

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    /// What it was made for.
    pub stage: EvaluationStage,
    /// What the model showed. Costs are not kept: they depend on the scatter that a search has met.
    pub outcome: EvaluationOutcome,
}

/// Exact coordinates of a point of the unit box, for look-up.
#[must_use]
pub fn point_key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

impl CheckpointRecord for EvaluationRecord {
    const KIND: CheckpointKind = CheckpointKind::Fit;
    type Body = FeatureHeaderBody;
    type IterateRow = Row;
    type Identity = Vec<u64>;

    fn identity(&self) -> Vec<u64> {
        point_key(&self.outcome.unit)
    }

    /// The values follow from the place in the unit box, and are not stored.
    fn to_row(&self, at: usize) -> Row {
        let EvaluationOutcome { unit, features, failure, .. } = &self.outcome;
        Row {
            index: at,
            stage: self.stage,
            unit: unit.iter().copied().map(ExactNumber).collect(),
            features: features.iter().map(FeatureValueRow::from_observed).collect(),
            failure: failure.as_ref().map(FailureRow::from_failure),
        }
    }

    fn line_index(row: &Row) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: Row, body: &FeatureHeaderBody) -> Result<Self, String> {
        row.check_against(body)?;
        Ok(Self { stage: row.stage, outcome: row.into_outcome(body) })
    }

    /// Everything that the model shows. Stages may differ: another search may have come to a point for
    /// another reason.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        difference::first_difference(&self.outcome, &other.outcome)
    }

    fn problem_difference(found: &FeatureHeaderBody, expected: &FeatureHeaderBody) -> Option<String> {
        let same = found.parameters == expected.parameters && found.features == expected.features;
        (!same)
            .then(|| "the header has other parameters, bounds, features or targets than the fit".to_owned())
    }
}

/// An evaluation as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    index: usize,
    stage: EvaluationStage,
    unit: Vec<ExactNumber>,
    features: Vec<FeatureValueRow>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<FailureRow>,
}

impl Row {
    fn check_against(&self, body: &FeatureHeaderBody) -> Result<(), String> {
        let (found, expected) = (self.unit.len(), body.parameters.len());
        if found != expected {
            return Err(format!("`unit`: found {found} numbers, expected {expected}"));
        }
        let (found, expected) = (self.features.len(), body.features.len());
        if self.failure.is_none() && found != expected {
            return Err(format!("`features`: found {found}, expected {expected}"));
        }
        if self.failure.is_some() && !self.features.is_empty() {
            return Err("found `features` and `failure`, expected one of them".to_owned());
        }
        match self.unit.iter().find(|u| !(0.0..=1.0).contains(&u.0)) {
            Some(outside) => Err(format!("`unit`: found {}, expected 0 to 1", outside.0)),
            None => Ok(()),
        }
    }

    /// The values follow from the place in the unit box.
    fn into_outcome(self, body: &FeatureHeaderBody) -> EvaluationOutcome {
        let unit: Vec<f64> = self.unit.into_iter().map(|n| n.0).collect();
        let values = body.parameters.iter().zip(&unit);
        let values = values.map(|(parameter, u)| parameter.axis.bounds.from_unit(*u)).collect();
        let features = self.features.into_iter().map(FeatureValueRow::into_observed).collect();
        EvaluationOutcome { unit, values, features, failure: self.failure.map(FailureRow::into_failure) }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum FeatureValueRow {
    Value(ExactNumber),
    Averaged { value: ExactNumber, spread: ExactNumber, below_db: ExactNumber },
    Missing { missing: String },
}

impl FeatureValueRow {
    fn from_observed(observed: &Observed) -> Self {
        match observed {
            Observed::Value(Observation { value, spread: 0.0, below_db: 0.0 }) => {
                Self::Value(ExactNumber(*value))
            }
            Observed::Value(Observation { value, spread, below_db }) => Self::Averaged {
                value: ExactNumber(*value),
                spread: ExactNumber(*spread),
                below_db: ExactNumber(*below_db),
            },
            Observed::Missing(missing) => Self::Missing { missing: missing.clone() },
        }
    }

    fn into_observed(self) -> Observed {
        match self {
            Self::Value(value) => Observed::from_value(value.0),
            Self::Averaged { value, spread, below_db } => {
                Observed::Value(Observation { value: value.0, spread: spread.0, below_db: below_db.0 })
            }
            Self::Missing { missing } => Observed::Missing(missing),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FailureRow {
    reason: FailureReason,
    message: String,
    progress: ExactNumber,
}

impl FailureRow {
    fn from_failure(failure: &RunFailure) -> Self {
        let RunFailure { reason, message, progress } = failure.clone();
        Self { reason, message, progress: ExactNumber(progress) }
    }

    fn into_failure(self) -> RunFailure {
        RunFailure { reason: self.reason, message: self.message, progress: self.progress.0 }
    }
}

#[cfg(test)]
mod tests;
