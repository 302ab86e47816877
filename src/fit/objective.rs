//! The cost of a point of the unit box, through one adapter that turns every failure into a recorded reason and a finite cost.
//!
//! Residual of feature i: `r = ln(model / target) / sd_ln`, `sd_ln = sd / |target|`. Its cost is `r^2` up to [`KNEE`] and
//! goes on linearly after that (Huber, Ann. Math. Stat. 35 (1964) 73), up to the residual of a value that is [`FAR`] times
//! off; a missing value costs that much. The cost of a point is the sum. A run that fails costs at least as much as one
//! from which every feature is missing, and less the further it came.

use super::scale::Bounds;
use crate::recording::Recording;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Residual, in standard deviations, above which the cost grows linearly: errors of measurement stay below 3, so only a
/// model that is far off feels it.
pub const KNEE: f64 = 3.0;

/// Ratio of model and target beyond which a residual no longer grows: two decades, more than any two bounds of a
/// physical feature, so that every value found beats a missing one.
pub const FAR: f64 = 100.0;

/// What a feature should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Name of the component or feature.
    pub name: String,
    /// Target, in the feature's own SI unit; not zero.
    pub value: f64,
    /// Its standard deviation, in the same unit; above zero.
    pub sd: f64,
}

/// A feature of a model run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Observed {
    /// Its value, in the feature's own SI unit; finite.
    Value(f64),
    /// Why it has none.
    Missing(String),
}

impl Observed {
    /// The value, if there is one.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Value(value) => Some(*value),
            Self::Missing(_) => None,
        }
    }
}

/// Why a model run gave no features.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[error("{reason}: {message}")]
pub struct RunFailure {
    /// Short fixed word by which failures are counted, such as `contact-lost`.
    pub reason: String,
    /// What happened, in words.
    pub message: String,
    /// How far the run came, from 0 (not at all) to 1 (to the end).
    pub progress: f64,
}

impl RunFailure {
    /// A failure after the given part of the run.
    #[must_use]
    pub fn new(reason: &str, message: impl Into<String>, progress: f64) -> Self {
        let progress = if progress.is_finite() { progress.clamp(0.0, 1.0) } else { 0.0 };
        Self { reason: reason.to_owned(), message: message.into(), progress }
    }
}

/// Features of a model at parameter values: what the objective needs, and all that it knows.
pub trait Predict: Sync {
    /// One entry a target, in their order; `values` are the free parameters in job order, in their SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure>;
}

/// A model that is seen through a camera.
pub trait Model: Sync {
    /// One recording for each of the job's (or one, where it has none); `values` are the free parameters in job order, in
    /// their SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn observe(&self, values: &[f64]) -> Result<Vec<Recording>, RunFailure>;
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
    /// Features in the order of the targets; empty when the run failed.
    pub features: Vec<Observed>,
    /// Why the run failed, if it did.
    pub failure: Option<RunFailure>,
}

/// Bounds, targets and the model between them.
pub struct Objective<'a> {
    bounds: Vec<Bounds>,
    targets: Vec<Target>,
    model: &'a dyn Predict,
}

impl<'a> Objective<'a> {
    /// One bound a free parameter, one target a feature; targets are finite, not zero, with a standard deviation above zero
    /// (as [`super::features`] and [`super::job`] make them).
    #[must_use]
    pub fn new(bounds: Vec<Bounds>, targets: Vec<Target>, model: &'a dyn Predict) -> Self {
        Self { bounds, targets, model }
    }

    /// Bounds in job order.
    #[must_use]
    pub fn bounds(&self) -> &[Bounds] {
        &self.bounds
    }

    /// Targets in job order.
    #[must_use]
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// Runs the model at a place in the unit box; never fails and never panics.
    #[must_use]
    pub fn evaluate(&self, unit: &[f64]) -> Evaluation {
        let values: Vec<f64> = self.bounds.iter().zip(unit).map(|(bounds, u)| bounds.from_unit(*u)).collect();
        let outcome = match catch_unwind(AssertUnwindSafe(|| self.model.predict(&values))) {
            Ok(outcome) => outcome.and_then(|features| self.admit(features)),
            Err(payload) => Err(RunFailure::new("panic", words_of(payload.as_ref()), 0.0)),
        };
        let (cost, features, failure) = match outcome {
            Ok(features) => (self.cost(&features), features, None),
            Err(failure) => {
                let failure = RunFailure::new(&failure.reason, failure.message, failure.progress);
                (self.cost_of_failure(&failure), Vec::new(), Some(failure))
            }
        };
        Evaluation { unit: unit.to_vec(), values, cost, features, failure }
    }

    /// Stops numbers that are not finite at the border.
    fn admit(&self, features: Vec<Observed>) -> Result<Vec<Observed>, RunFailure> {
        if features.len() != self.targets.len() {
            let message = format!("the model gave {} features, expected {}", features.len(), self.targets.len());
            return Err(RunFailure::new("feature-count", message, 0.0));
        }
        match features.iter().zip(&self.targets).find(|(f, _)| f.value().is_some_and(|v| !v.is_finite())) {
            Some((found, target)) => Err(RunFailure::new("not-a-number", format!("feature `{}` is {:?}", target.name, found.value().unwrap_or(f64::NAN)), 0.0)),
            None => Ok(features),
        }
    }

    fn cost(&self, features: &[Observed]) -> f64 {
        features.iter().zip(&self.targets).map(|(feature, target)| feature.value().map_or(farthest(target), |value| huber(residual(value, target)))).sum()
    }

    fn cost_of_failure(&self, failure: &RunFailure) -> f64 {
        (2.0 - failure.progress) * self.targets.iter().map(farthest).sum::<f64>().max(1.0)
    }
}

/// `ln(model / target) / sd_ln`, stopped at [`FAR`]; a value of the other sign is as far off as can be.
#[must_use]
pub fn residual(value: f64, target: &Target) -> f64 {
    let sd_ln = target.sd / target.value.abs();
    let ratio = value / target.value;
    let log = if ratio > 0.0 { ratio.ln() } else { -FAR.ln() };
    log.clamp(-FAR.ln(), FAR.ln()) / sd_ln
}

fn farthest(target: &Target) -> f64 {
    huber(FAR.ln() * target.value.abs() / target.sd)
}

fn huber(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= KNEE { size * size } else { KNEE * (2.0 * size - KNEE) }
}

/// What a panic said, if it said it in words.
fn words_of(payload: &(dyn Any + Send)) -> String {
    let words = payload.downcast_ref::<&str>().map(|s| (*s).to_owned()).or_else(|| payload.downcast_ref::<String>().cloned());
    words.unwrap_or_else(|| "the model panicked without a message".to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::scale::Spacing;
    use super::*;

    struct Fake(fn(f64) -> Result<Vec<Observed>, RunFailure>);

    impl Predict for Fake {
        fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
            (self.0)(values[0])
        }
    }

    fn at(fake: &Fake, unit: f64) -> Evaluation {
        let target = Target { name: "low".to_owned(), value: 80.0, sd: 0.8 };
        Objective::new(vec![Bounds::new(0.0, 100.0, Spacing::Linear).unwrap()], vec![target], fake).evaluate(&[unit])
    }

    #[test]
    fn the_cost_is_the_square_of_the_log_residual_and_then_linear() {
        let identity = Fake(|p| Ok(vec![Observed::Value(p)]));
        assert_eq!(at(&identity, 0.8).cost, 0.0);
        let near = (0.81_f64 / 0.8).ln() / 0.01;
        assert!((at(&identity, 0.81).cost - near * near).abs() < 1e-9);
        let off = 2.0_f64.ln() / 0.01;
        assert!((at(&identity, 0.4).cost - 3.0 * (2.0 * off - 3.0)).abs() < 1e-9);
    }

    #[test]
    fn a_missing_value_costs_as_much_as_the_farthest_one_and_a_failure_more() {
        let missing = at(&Fake(|_| Ok(vec![Observed::Missing("no peak".to_owned())])), 0.5);
        let wrong_sign = at(&Fake(|_| Ok(vec![Observed::Value(-80.0)])), 0.5);
        assert_eq!(missing.cost, 3.0 * (2.0 * 100.0_f64.ln() / 0.01 - 3.0));
        assert_eq!(wrong_sign.cost, missing.cost);
        let late = at(&Fake(|_| Err(RunFailure::new("jammed", "", 0.9))), 0.5);
        let early = at(&Fake(|_| Err(RunFailure::new("jammed", "", 0.1))), 0.5);
        assert!(early.cost > late.cost && late.cost > missing.cost && early.cost <= 2.0 * missing.cost);
        assert_eq!(late.failure.unwrap().reason, "jammed");
    }

    #[test]
    fn panics_nan_and_wrong_counts_become_reasons() {
        let reason = |fake: &Fake| at(fake, 0.5).failure.map(|f| (f.reason, f.message)).unwrap();
        assert_eq!(reason(&Fake(|_| panic!("lost it"))), ("panic".to_owned(), "lost it".to_owned()));
        assert_eq!(reason(&Fake(|_| Ok(vec![Observed::Value(f64::NAN)]))), ("not-a-number".to_owned(), "feature `low` is NaN".to_owned()));
        assert_eq!(reason(&Fake(|_| Ok(vec![]))).0, "feature-count");
        let odd = at(&Fake(|_| Err(RunFailure { reason: "x".to_owned(), message: String::new(), progress: f64::NAN })), 0.5);
        assert!(odd.cost.is_finite());
    }
}
