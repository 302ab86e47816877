//! Evaluations of a fit in a journal.

use super::evaluation::{Evaluation, Observation, Observed};
use super::failure::{FailureReason, RunFailure};
use super::stage::Stage;
use crate::journal::{self, Exact, Kind, Record};
use serde::{Deserialize, Serialize};

/// The journal of a fit.
pub type Journal = journal::Journal<Entry>;
/// Its header.
pub type Header = journal::Header<Body>;

/// What the header of a fit says besides.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Seed of the search.
    pub seed: u64,
    /// Names of the free parameters, in the order of the coordinates.
    pub parameters: Vec<String>,
    /// Names of the targets, in the order of the features.
    pub features: Vec<String>,
}

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it was made for.
    pub stage: Stage,
    /// Seed of the search that made it, where that is another one than the header's: such an evaluation came
    /// from another journal.
    pub from: Option<u64>,
    /// The evaluation; its costs are those of the search that made it.
    pub evaluation: Evaluation,
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
        key(&self.evaluation.unit)
    }

    fn to_row(&self, at: usize) -> Row {
        let Evaluation { unit, values, cost, features, failure, .. } = &self.evaluation;
        let exact = |numbers: &[f64]| numbers.iter().copied().map(Exact).collect();
        Row {
            index: at,
            stage: self.stage,
            from: self.from,
            unit: exact(unit),
            values: exact(values),
            cost: Exact(*cost),
            features: features.iter().map(Feature::of).collect(),
            failure: failure.as_ref().map(Failed::of),
        }
    }

    fn from_row(row: Row, at: usize, body: &Body) -> Result<Self, String> {
        row.check(at, body)?;
        let from = row.from.filter(|seed| *seed != body.seed);
        Ok(Self { stage: row.stage, from, evaluation: row.into_evaluation() })
    }

    /// Values, features and failure are the model's; what they cost depends on the scatter that a search met.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        let outcome = |entry: &Self| {
            let Evaluation { values, features, failure, .. } = entry.evaluation.clone();
            (values, features, failure)
        };
        if outcome(self) == outcome(other) {
            return None;
        }
        let shown = |e: &Self| e.evaluation.features.iter().map(Observed::value).collect::<Vec<_>>();
        let words = |entry: &Self| {
            if shown(self) != shown(other) {
                return format!("features {:?}", shown(entry));
            }
            let (values, features, failure) = outcome(entry);
            format!("values {values:?}, features {features:?}, failure {failure:?}")
        };
        Some([words(self), words(other)])
    }

    fn other_problem(found: &Body, expected: &Body) -> Option<String> {
        let differ = (&found.parameters, &found.features) != (&expected.parameters, &expected.features);
        differ.then(|| "the header names other parameters or features than the fit has".to_owned())
    }

    /// A fit that is resumed replays the evaluations of its own seed, and knows those of others.
    fn moved(&self, from: &Body, into: &Body) -> Self {
        let seed = self.from.unwrap_or(from.seed);
        Self { from: Some(seed).filter(|seed| *seed != into.seed), ..self.clone() }
    }
}

/// An evaluation as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    index: usize,
    stage: Stage,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    from: Option<u64>,
    unit: Vec<Exact>,
    values: Vec<Exact>,
    cost: Exact,
    features: Vec<Feature>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<Failed>,
}

impl Row {
    fn check(&self, at: usize, body: &Body) -> Result<(), String> {
        if self.index != at {
            return Err(format!("`index`: found {}, expected {at}", self.index));
        }
        let expected = body.parameters.len();
        for (name, found) in [("unit", self.unit.len()), ("values", self.values.len())] {
            if found != expected {
                return Err(format!("`{name}`: found {found} numbers, expected {expected}"));
            }
        }
        let (found, expected) = (self.features.len(), body.features.len());
        if self.failure.is_none() && found != expected {
            return Err(format!("`features`: found {found}, expected {expected}"));
        }
        match self.unit.iter().find(|u| !(0.0..=1.0).contains(&u.0)) {
            Some(outside) => Err(format!("`unit`: found {}, expected 0 to 1", outside.0)),
            None => Ok(()),
        }
    }

    fn into_evaluation(self) -> Evaluation {
        let plain = |numbers: Vec<Exact>| numbers.into_iter().map(|n| n.0).collect();
        Evaluation {
            unit: plain(self.unit),
            values: plain(self.values),
            cost: self.cost.0,
            global_cost: self.cost.0, // the ledger prices what it replays
            features: self.features.into_iter().map(Feature::into_observed).collect(),
            failure: self.failure.map(Failed::into_failure),
        }
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
