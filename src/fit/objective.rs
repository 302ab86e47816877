//! The cost of a point of the unit box. If the model fails, the evaluation gets the reason for the failure
//! and a finite cost.
//!
//! The cost is twice the negative log-likelihood, up to a constant. The constant makes the cost zero if the
//! model reproduces all targets: the cost is the sum of `rho(r) + 2 ln(s / s0) + (d / 6 dB)^2` over all
//! features, plus the costs of the priors.
//!
//! - The residual of a feature is `r = ln(model / target) / s`, or `(model - target) / s` if its
//!   sign may change.
//! - `s^2 = sd^2 + scatter^2 + spread^2` combines the standard deviation `sd` of the target, the scatter of
//!   the model between neighbouring parameter values, and the spread over the starting states; `s0` is `s`
//!   without the spread. The term `2 ln(s / s0)` penalises the spread: without it a fit would prefer points
//!   with uncertain features.
//! - `rho` (`robust_loss`) is `r^2` up to `LOSS_KNEE` and logarithmic above it, so that a missing peak does
//!   not dominate the cost. A missing feature costs as much as a feature that is wrong by a factor of
//!   `MAX_RATIO`.
//! - `d` is the level, in dB, of the strongest spectral peak relative to the peak that is assigned to the
//!   feature. This term keeps the cost continuous where the assignment changes to another peak.
//!
//! A failing run costs at least as much as a run in which all features are missing; the later it fails, the
//! less it costs.

use super::camera_calibration::CameraFit;
use super::evaluation::{Evaluation, EvaluationOutcome, FailureReason, Observation, Observed, RunFailure};
use super::job::FreeParameter;
use super::model::FeaturePredictor;
use super::target_value::{MAX_RATIO, TargetValue};
use crate::feature::ASSIGN_DB;
use crate::text::panic_message;
use portable_math as math;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Residual, in standard deviations, above which the cost grows logarithmically. Measurement errors are
/// rarely above 3 standard deviations, so the limit matters only for a wrong model.
pub(crate) const LOSS_KNEE: f64 = 3.0;

/// The cost function of a fit: bounds, targets and model.
pub struct Objective<'a> {
    axes: Vec<FreeParameter>,
    targets: Vec<TargetValue>,
    model: &'a dyn FeaturePredictor,
}

impl<'a> Objective<'a> {
    /// Creates the objective from one axis per free parameter and one target per feature. A target must be
    /// finite and have a standard deviation above zero. It must not be zero if values are compared by
    /// logarithms.
    #[must_use]
    pub fn new(axes: Vec<FreeParameter>, targets: Vec<TargetValue>, model: &'a dyn FeaturePredictor) -> Self {
        Self { axes, targets, model }
    }

    /// The free parameters in job order.
    pub(crate) fn axes(&self) -> &[FreeParameter] {
        &self.axes
    }

    /// Targets in job order.
    pub(crate) fn targets(&self) -> &[TargetValue] {
        &self.targets
    }

    /// Parameter values at a point of the unit box.
    pub(crate) fn values(&self, unit: &[f64]) -> Vec<f64> {
        self.axes.iter().zip(unit).map(|(axis, u)| axis.bounds.value_at_unit(*u)).collect()
    }

    /// Evaluates the model at a point of the unit box; a panic of the model is a failed run.
    pub(crate) fn evaluate(&self, unit: &[f64]) -> Evaluation {
        self.evaluate_at(unit.to_vec(), self.values(unit))
    }

    /// Evaluates the model at parameter values; the evaluation has no point in the unit box.
    pub(crate) fn evaluate_values(&self, values: Vec<f64>) -> Evaluation {
        self.evaluate_at(Vec::new(), values)
    }

    fn evaluate_at(&self, unit: Vec<f64>, values: Vec<f64>) -> Evaluation {
        let predicted = catch_panic(|| self.model.predict_features(&values));
        let (features, failure) = match predicted.and_then(|features| self.check_features(features)) {
            Ok(features) => (features, None),
            // a model may report a progress outside 0 to 1
            Err(RunFailure { reason, message, progress }) => {
                (Vec::new(), Some(RunFailure::new(reason, message, progress)))
            }
        };
        self.add_costs(EvaluationOutcome { unit, values, features, failure })
    }

    /// Adds the costs to an outcome. They follow from the parameter values and from the features or the
    /// failure.
    pub(crate) fn add_costs(&self, outcome: EvaluationOutcome) -> Evaluation {
        let EvaluationOutcome { unit, values, features, failure } = outcome;
        let priors: f64 = prior_residuals(&self.axes, &values)
            .map(|r| robust_loss(r.clamp(-MAX_PRIOR_RESIDUAL, MAX_PRIOR_RESIDUAL)))
            .sum();
        let failed = |failure: &RunFailure, farthest: f64| (2.0 - failure.progress) * farthest.max(1.0);
        let of = |(targets, features): (&[TargetValue], &[Observed])| {
            let (shown, farthest) = feature_costs(targets, features);
            priors + failure.as_ref().map_or(shown, |failure| failed(failure, farthest))
        };
        let cost = of((&self.targets, &features));
        let (first, seen): (Vec<TargetValue>, Vec<Observed>) = first_stage_targets(&self.targets, &features);
        let global_cost = of((&first, &seen));
        Evaluation { unit, values, cost, global_cost, features, failure }
    }

    /// A copy of this objective in which each target has the given scatter of its feature, in the unit of the
    /// feature.
    pub(crate) fn with_feature_scatter(&self, scatter: &[f64]) -> Self {
        let targets = self.targets.iter().zip(scatter);
        let targets = targets.map(|(target, scatter)| TargetValue { scatter: *scatter, ..target.clone() });
        Self { axes: self.axes.clone(), targets: targets.collect(), model: self.model }
    }

    /// The features of one simulated measurement of the model at `values`.
    ///
    /// # Errors
    /// [`RunFailure`] if the model fails or panics, or if a number is not finite.
    pub(crate) fn simulate_twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure> {
        catch_panic(|| self.model.simulate_twin(values, draw))
            .and_then(|features| self.check_features(features))
    }

    /// Number of camera unknowns; they are estimated at every point of the search.
    pub(crate) fn count_camera_unknowns(&self) -> usize {
        CameraFit::estimate(&self.targets, &[]).count_unknowns()
    }

    /// Returns the features unless their number is wrong or a value is not finite.
    fn check_features(&self, features: Vec<Observed>) -> Result<Vec<Observed>, RunFailure> {
        let (found, expected) = (features.len(), self.targets.len());
        if found != expected {
            let message = format!("the model gave {found} features, expected {expected}");
            return Err(RunFailure::new(FailureReason::FeatureCount, message, 0.0));
        }
        let odd = |shown: &Observation| {
            [shown.value, shown.spread, shown.below_db].into_iter().find(|number| !number.is_finite())
        };
        for (feature, target) in features.iter().zip(&self.targets) {
            if let Some(found) = feature.observation().and_then(odd) {
                let message = format!("feature `{}` is {found}", target.name);
                return Err(RunFailure::new(FailureReason::NotANumber, message, 0.0));
            }
        }
        Ok(features)
    }
}

/// Distances of the parameters with a prior from their prior means, in prior standard deviations.
pub(crate) fn prior_residuals(axes: &[FreeParameter], values: &[f64]) -> impl Iterator<Item = f64> {
    axes.iter().zip(values).filter_map(|(axis, value)| Some(axis.prior.as_ref()?.residual(*value)))
}

/// Two costs: first, the cost of the features plus the cost of the priors of their cameras; second, the cost
/// of a run in which all features are missing.
fn feature_costs(targets: &[TargetValue], features: &[Observed]) -> (f64, f64) {
    let cameras = CameraFit::estimate(targets, features);
    let one = |(at, target): (usize, &TargetValue)| {
        let (found, farthest) = (features.get(at).and_then(Observed::observation), missing_cost(target));
        let shown = found.map(|found| feature_cost(&cameras.apply(target, found), target));
        (shown.unwrap_or(farthest), farthest)
    };
    let all = targets.iter().enumerate().map(one);
    let (shown, farthest) = all.fold((0.0, 0.0), |sum, cost| (sum.0 + cost.0, sum.1 + cost.1));
    (shown + cameras.prior_residuals().map(robust_loss).sum::<f64>(), farthest)
}

/// Targets that count in the first stage of the search, and the features of these targets.
fn first_stage_targets(targets: &[TargetValue], features: &[Observed]) -> (Vec<TargetValue>, Vec<Observed>) {
    let kept = targets.iter().enumerate().filter_map(|(at, target)| Some((at, target.first_stage_target()?)));
    let with = |(at, target): (usize, TargetValue)| (target, features.get(at).cloned());
    let (targets, features): (Vec<_>, Vec<_>) = kept.map(with).unzip();
    (targets, features.into_iter().flatten().collect())
}

/// Limit of the residual of a prior, in standard deviations. It keeps costs finite.
const MAX_PRIOR_RESIDUAL: f64 = 1e6;

/// Distance of a feature from its target, divided by [`total_sd`].
pub(crate) fn residual(observation: &Observation, target: &TargetValue) -> f64 {
    target.distance(observation.value) / total_sd(observation, target)
}

/// Standard deviation of [`TargetValue::distance`]: the standard deviation of the target (including scatter)
/// and the spread over the starting states, added in quadrature.
pub(crate) fn total_sd(observation: &Observation, target: &TargetValue) -> f64 {
    math::hypot(target.relative_sd(), observation.spread / target.reference_size())
}

/// Cost of a feature, limited to the cost of a missing feature.
fn feature_cost(observation: &Observation, target: &TargetValue) -> f64 {
    let assigned = math::powi(observation.below_db / ASSIGN_DB, 2);
    let spread = 2.0 * math::ln(total_sd(observation, target) / target.relative_sd());
    (robust_loss(residual(observation, target)) + spread + assigned).min(missing_cost(target))
}

fn missing_cost(target: &TargetValue) -> f64 {
    robust_loss(math::ln(MAX_RATIO) / target.relative_sd())
}

/// Loss of a residual: its square up to `LOSS_KNEE`, then a logarithm with a continuous slope.
pub(crate) fn robust_loss(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= LOSS_KNEE {
        size * size
    } else {
        LOSS_KNEE * LOSS_KNEE * (1.0 + 2.0 * math::ln(size / LOSS_KNEE))
    }
}

/// The result of `run`; a panic becomes a failure.
fn catch_panic<T>(run: impl FnOnce() -> Result<T, RunFailure>) -> Result<T, RunFailure> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|payload| {
        let message = panic_message(payload.as_ref());
        let message = message.unwrap_or_else(|| "the model panicked without a message".to_owned());
        Err(RunFailure::new(FailureReason::Panic, message, 0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feature::ValueComparison;
    use crate::fit::bounds::Prior;
    use crate::fit::bounds::{Bounds, BoundsSpacing};

    struct Fake(fn(f64) -> Result<Vec<Observed>, RunFailure>);

    impl FeaturePredictor for Fake {
        fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
            (self.0)(values[0])
        }

        fn simulate_twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
            self.predict_features(values)
        }
    }

    fn at(fake: &Fake, unit: f64) -> Evaluation {
        objective(fake, None).evaluate(&[unit])
    }

    fn objective(fake: &Fake, prior: Option<Prior>) -> Objective<'_> {
        let bounds = Bounds::new(0.0, 100.0, BoundsSpacing::Linear).unwrap();
        Objective::new(vec![FreeParameter { prior, ..bounds.into() }], vec![low()], fake)
    }

    fn low() -> TargetValue {
        TargetValue {
            name: "low".to_owned(),
            value: 80.0,
            sd: 0.8,
            scatter: 0.0,
            measure: ValueComparison::Log,
            last: false,
            calibration: None,
        }
    }

    #[test]
    fn the_cost_is_the_square_of_the_log_residual_and_then_a_logarithm() {
        let identity = Fake(|p| Ok(vec![Observed::from_value(p)]));
        assert_eq!(at(&identity, 0.8).cost, 0.0);
        let near = (0.81_f64 / 0.8).ln() / 0.01;
        assert!((at(&identity, 0.81).cost - near * near).abs() < 1e-9);
        let off = 2.0_f64.ln() / 0.01;
        assert!((at(&identity, 0.4).cost - 9.0 * (1.0 + 2.0 * (off / 3.0).ln())).abs() < 1e-9);
    }

    #[test]
    fn a_missing_value_costs_as_much_as_the_farthest_one_and_a_failure_more() {
        let missing = at(&Fake(|_| Ok(vec![Observed::Missing("no peak".to_owned())])), 0.5);
        let wrong_sign = at(&Fake(|_| Ok(vec![Observed::from_value(-80.0)])), 0.5);
        assert!((missing.cost - 9.0 * (1.0 + 2.0 * (100.0_f64.ln() / 0.03).ln())).abs() < 1e-9);
        assert_eq!(wrong_sign.cost, missing.cost);
        let late = at(
            &Fake(|_| {
                Err(RunFailure::new(FailureReason::Ended(crate::simulate::RunStatus::Jammed), "", 0.9))
            }),
            0.5,
        );
        let early = at(
            &Fake(|_| {
                Err(RunFailure::new(FailureReason::Ended(crate::simulate::RunStatus::Jammed), "", 0.1))
            }),
            0.5,
        );
        assert!(early.cost > late.cost && late.cost > missing.cost && early.cost <= 2.0 * missing.cost);
        assert_eq!(late.failure.unwrap().reason, FailureReason::Ended(crate::simulate::RunStatus::Jammed));
    }

    #[test]
    fn panics_nan_and_wrong_counts_become_reasons() {
        let reason = |fake: &Fake| at(fake, 0.5).failure.map(|f| (f.reason, f.message)).unwrap();
        assert_eq!(reason(&Fake(|_| panic!("lost it"))), (FailureReason::Panic, "lost it".to_owned()));
        assert_eq!(
            reason(&Fake(|_| Ok(vec![Observed::from_value(f64::NAN)]))),
            (FailureReason::NotANumber, "feature `low` is NaN".to_owned())
        );
        assert_eq!(reason(&Fake(|_| Ok(vec![]))).0, FailureReason::FeatureCount);
        let odd = at(
            &Fake(|_| {
                Err(RunFailure { reason: FailureReason::Panic, message: String::new(), progress: f64::NAN })
            }),
            0.5,
        );
        assert!(odd.cost.is_finite());
    }

    #[test]
    fn a_spread_over_starting_states_counts_as_a_likelihood_says() {
        // with the spread, s^2 = 0.01^2 + 0.03^2: the residual shrinks, and the cost rises by 2 ln(s / sd) =
        // ln 10
        let wide = Observation { value: 80.0 * 0.05_f64.exp(), spread: 2.4, below_db: 0.0 };
        assert!((feature_cost(&wide, &low()) - (0.05_f64.powi(2) / 1e-3 + 10.0_f64.ln())).abs() < 1e-9);
        let useless = Observation { value: 1e-9, spread: 1e9, below_db: 0.0 };
        assert!(feature_cost(&useless, &low()) <= missing_cost(&low()));
    }

    #[test]
    fn a_weaker_peak_costs_and_a_prior_counts() {
        let weaker = Observation { value: 80.0, spread: 0.0, below_db: 12.0 };
        assert_eq!(feature_cost(&weaker, &low()), 4.0);
        let prior = Prior::Log { mean_ln: 40.0_f64.ln(), sd_ln: 0.2 };
        let exact = Fake(|_| Ok(vec![Observed::from_value(80.0)]));
        let found = objective(&exact, Some(prior)).evaluate(&[0.44]);
        assert!((found.cost - (1.1_f64.ln() / 0.2).powi(2)).abs() < 1e-12);
    }

    #[test]
    fn a_difference_may_pass_through_zero() {
        let target = TargetValue {
            name: "flip".to_owned(),
            value: 0.0,
            sd: 1e-3,
            scatter: 0.0,
            measure: ValueComparison::Linear { scale: 0.05 },
            last: false,
            calibration: None,
        };
        let r = |value| residual(&Observation { value, spread: 0.0, below_db: 0.0 }, &target);
        assert!((r(-2e-3) + 2.0).abs() < 1e-12 && (r(3e-3) - 3.0).abs() < 1e-12);
        assert!((r(9.0) - 100.0_f64.ln() / 0.02).abs() < 1e-9, "stopped where a ratio would be");
    }

    #[test]
    fn the_features_of_the_last_stage_are_left_out_of_the_first() {
        let fake = Fake(|p| Ok(vec![Observed::from_value(80.0), Observed::from_value(p)]));
        let targets = vec![low(), TargetValue { name: "line".to_owned(), last: true, ..low() }];
        let found = Objective::new(
            vec![Bounds::new(0.0, 100.0, BoundsSpacing::Linear).unwrap().into()],
            targets,
            &fake,
        )
        .evaluate(&[0.81]);
        assert!(found.cost > 1.0 && found.global_cost == 0.0);
    }
}
