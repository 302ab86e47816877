//! One evaluation of the cost: a place, what the model shows there, and what it costs.

use super::failure::RunFailure;

/// A feature as a model shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Its value, in the feature's own SI unit; finite.
    pub value: f64,
    /// Standard deviation over the starting states, in the same unit; 0 where there is one.
    pub spread: f64,
    /// By how much the assigned peak is weaker than the strongest one in its band, dB; 0 where it is the
    /// strongest, or no peak.
    pub below_db: f64,
}

/// A feature of a model run.
#[derive(Debug, Clone, PartialEq)]
pub enum Observed {
    /// Its value.
    Value(Observation),
    /// Why there is none.
    Missing(String),
}

impl Observed {
    /// A value of one run, the strongest of its kind.
    #[must_use]
    pub fn from_value(value: f64) -> Self {
        Self::Value(Observation { value, spread: 0.0, below_db: 0.0 })
    }

    /// What was observed, if anything.
    #[must_use]
    pub(crate) fn observation(&self) -> Option<&Observation> {
        match self {
            Self::Value(observation) => Some(observation),
            Self::Missing(_) => None,
        }
    }

    /// The value, if there is one.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        self.observation().map(|observation| observation.value)
    }
}

/// One evaluation of the cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Place in the unit box, one coordinate a parameter.
    pub unit: Vec<f64>,
    /// Parameter values in job order, in their SI units.
    pub values: Vec<f64>,
    /// Cost, finite and not negative.
    pub cost: f64,
    /// Cost from afar: without the features of the last stage, and with deviations of at least `FROM_AFAR`.
    pub global_cost: f64,
    /// Features in the order of the targets; empty when the run failed.
    pub features: Vec<Observed>,
    /// Why the run failed, if it did.
    pub failure: Option<RunFailure>,
}

/// What the model shows at a point: an evaluation but for its costs, which depend on what else a search met.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationOutcome {
    /// Place in the unit box, one coordinate a parameter.
    pub unit: Vec<f64>,
    /// Parameter values in job order, in their SI units.
    pub values: Vec<f64>,
    /// Features in the order of the targets; empty when the run failed.
    pub features: Vec<Observed>,
    /// Why the run failed, if it did.
    pub failure: Option<RunFailure>,
}

impl From<Evaluation> for EvaluationOutcome {
    fn from(evaluation: Evaluation) -> Self {
        let Evaluation { unit, values, features, failure, .. } = evaluation;
        Self { unit, values, features, failure }
    }
}
