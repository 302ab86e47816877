//! Evaluations of a fit in a journal.

mod body;
mod difference;

pub use body::{Aimed, Body, Parameter};

use super::evaluation::{Observation, Observed, Outcome};
use super::failure::{FailureReason, RunFailure};
use super::stage::Stage;
use crate::journal::{self, Exact, Kind, Record};
use serde::{Deserialize, Serialize};

/// The journal of a fit.
pub type Journal = journal::Journal<Entry>;
/// Its header.
pub type Header = journal::Header<Body>;

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it was made for.
    pub stage: Stage,
    /// What the model showed. Costs are not kept: they depend on the scatter that a search has met.
    pub outcome: Outcome,
}

/// Exact coordinates of a point of the unit box, for look-up.
#[must_use]
pub fn key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

impl Record for Entry {
    const KIND: Kind = Kind::Fit;
    type Body = Body;
    type Row = Row;
    type Identity = Vec<u64>;

    fn identity(&self) -> Vec<u64> {
        key(&self.outcome.unit)
    }

    /// The values follow from the place in the unit box, and are not stored.
    fn to_row(&self, at: usize) -> Row {
        let Outcome { unit, features, failure, .. } = &self.outcome;
        Row {
            index: at,
            stage: self.stage,
            unit: unit.iter().copied().map(Exact).collect(),
            features: features.iter().map(Feature::of).collect(),
            failure: failure.as_ref().map(Failed::of),
        }
    }

    fn line_index(row: &Row) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: Row, body: &Body) -> Result<Self, String> {
        row.check(body)?;
        Ok(Self { stage: row.stage, outcome: row.into_outcome(body) })
    }

    /// Everything that the model shows. Stages may differ: another search may have come to a point for
    /// another reason.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        difference::between(&self.outcome, &other.outcome)
    }

    fn other_problem(found: &Body, expected: &Body) -> Option<String> {
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
    stage: Stage,
    unit: Vec<Exact>,
    features: Vec<Feature>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<Failed>,
}

impl Row {
    fn check(&self, body: &Body) -> Result<(), String> {
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
    fn into_outcome(self, body: &Body) -> Outcome {
        let unit: Vec<f64> = self.unit.into_iter().map(|n| n.0).collect();
        let values = body.parameters.iter().zip(&unit);
        let values = values.map(|(parameter, u)| parameter.axis.bounds.from_unit(*u)).collect();
        let features = self.features.into_iter().map(Feature::into_observed).collect();
        Outcome { unit, values, features, failure: self.failure.map(Failed::into_failure) }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Feature {
    Value(Exact),
    Averaged { value: Exact, spread: Exact, below_db: Exact },
    Missing { missing: String },
}

impl Feature {
    fn of(observed: &Observed) -> Self {
        match observed {
            Observed::Value(Observation { value, spread: 0.0, below_db: 0.0 }) => Self::Value(Exact(*value)),
            Observed::Value(Observation { value, spread, below_db }) => {
                Self::Averaged { value: Exact(*value), spread: Exact(*spread), below_db: Exact(*below_db) }
            }
            Observed::Missing(missing) => Self::Missing { missing: missing.clone() },
        }
    }

    fn into_observed(self) -> Observed {
        match self {
            Self::Value(value) => Observed::of(value.0),
            Self::Averaged { value, spread, below_db } => {
                Observed::Value(Observation { value: value.0, spread: spread.0, below_db: below_db.0 })
            }
            Self::Missing { missing } => Observed::Missing(missing),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Failed {
    reason: FailureReason,
    message: String,
    progress: Exact,
}

impl Failed {
    fn of(failure: &RunFailure) -> Self {
        let RunFailure { reason, message, progress } = failure.clone();
        Self { reason, message, progress: Exact(progress) }
    }

    fn into_failure(self) -> RunFailure {
        RunFailure { reason: self.reason, message: self.message, progress: self.progress.0 }
    }
}

#[cfg(test)]
mod tests;
