//! Evaluations of a fit in a journal.

mod body;
mod difference;
mod table;

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
    /// Seed of the search that made it, where that is another one than the header's: such an evaluation came
    /// from another journal.
    pub from: Option<u64>,
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
            from: self.from,
            unit: unit.iter().copied().map(Exact).collect(),
            values: None,
            cost: None,
            features: features.iter().map(Feature::of).collect(),
            failure: failure.as_ref().map(Failed::of),
        }
    }

    fn line_index(row: &Row) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: Row, body: &Body) -> Result<Self, String> {
        row.check(body)?;
        let (stage, from) = (row.stage, row.from.filter(|seed| *seed != body.seed));
        Ok(Self { stage, from, outcome: row.into_outcome(body)? })
    }

    fn check_stored(&self, expected: &Body) -> Result<(), String> {
        let Outcome { unit, values, .. } = &self.outcome;
        let Some(axes) = expected.axes() else { return Ok(()) };
        let differs = axes.iter().zip(unit).map(|(axis, u)| axis.bounds.from_unit(*u)).zip(values);
        let differs = differs.zip(&expected.parameters).find(|((derived, stored), _)| derived != *stored);
        let Some(((derived, stored), parameter)) = differs else { return Ok(()) };
        Err(format!(
            "`values`: found {stored:?} for `{}`, expected {derived:?}, which follows from `unit`",
            parameter.name
        ))
    }

    /// Everything that the model shows. Stages may differ: another search may have come to a point for
    /// another reason.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        difference::between(&self.outcome, &other.outcome)
    }

    fn other_problem(found: &Body, expected: &Body) -> Option<String> {
        let differ = found.is_other_than(expected);
        differ.then(|| "the header has other parameters, bounds, features or targets than the fit".to_owned())
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
    /// Layout 2 alone stores what follows from `unit` and the header.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values: Option<Vec<Exact>>,
    /// Layout 2 alone stores it, and nothing reads it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cost: Option<Exact>,
    features: Vec<Feature>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<Failed>,
}

impl Row {
    fn check(&self, body: &Body) -> Result<(), String> {
        let expected = body.parameters.len();
        for (name, numbers) in [("unit", Some(&self.unit)), ("values", self.values.as_ref())] {
            if let Some(found) = numbers.map(Vec::len).filter(|found| *found != expected) {
                return Err(format!("`{name}`: found {found} numbers, expected {expected}"));
            }
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

    fn into_outcome(self, body: &Body) -> Result<Outcome, String> {
        let plain = |numbers: Vec<Exact>| numbers.into_iter().map(|n| n.0).collect::<Vec<f64>>();
        let unit = plain(self.unit);
        let values = match (self.values.map(plain), body.axes()) {
            (None, Some(axes)) => axes.iter().zip(&unit).map(|(axis, u)| axis.bounds.from_unit(*u)).collect(),
            (Some(stored), None) => stored,
            (None, None) => return Err("`values`: found none, and the header has no bounds".to_owned()),
            (Some(_), Some(_)) => return Err("`values`: found some, but they follow from `unit`".to_owned()),
        };
        let features = self.features.into_iter().map(Feature::into_observed).collect();
        Ok(Outcome { unit, values, features, failure: self.failure.map(Failed::into_failure) })
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
