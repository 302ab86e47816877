//! The cost of a point of the unit box, through one adapter that turns every failure into a recorded reason
//! and a finite cost.
//!
//! The cost is twice the negative logarithm of a likelihood, up to a constant that makes it zero where
//! everything is met: `sum [ rho(r) + 2 ln(s / sd) + (d / 6 dB)^2 ] + sum of the priors`. Residual of a
//! feature: `r = ln(model / target) / s` (or `(model - target) / s` where the sign may change). `s^2 = sd^2 +
//! scatter^2 + spread^2`: the target's deviation; the scatter of the model's own value between neighbouring
//! parameters, where it is not smooth; and the spread over its starting states, to which the term `2 ln(s /
//! sd)` belongs: without it a fit would look for points at which nothing is certain. `rho` is `r^2` up to
//! [`KNEE`] and grows as a logarithm after that, as errors with heavy tails have it: a peak that is missing
//! must not outvote all that is seen; it costs as much as a value that is [`FAR`] times off. `d` is by how
//! much the assigned peak is weaker than the strongest one, so that the cost does not jump when another peak
//! is assigned. A run that fails costs at least as much as one from which every feature is missing, and less
//! the further it came.

use super::job::Prior;
use super::scale::Bounds;
use crate::feature::{ASSIGN_DB, Measure};
use crate::recording::Recording;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Residual, in standard deviations, above which the cost grows as a logarithm: errors of measurement stay
/// below 3, so only a model that is far off feels it.
pub const KNEE: f64 = 3.0;

/// Ratio of model and target beyond which a residual no longer grows: two decades, more than any two bounds
/// of a physical feature, so that every value found beats a missing one.
pub const FAR: f64 = 100.0;

/// Least relative standard deviation in the first stage: far from the targets everything is missed by many
/// deviations, and the most precise features would outvote the others.
pub const FROM_AFAR: f64 = 0.05;

/// What a feature should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Name of the component or feature.
    pub name: String,
    /// Target, in the feature's own SI unit; not zero where it is measured by logarithms.
    pub value: f64,
    /// Its standard deviation, in the same unit; above zero.
    pub sd: f64,
    /// Scatter of the model's value between neighbouring parameters, in the same unit; 0 where it is smooth.
    pub scatter: f64,
    /// How a residual is taken.
    pub measure: Measure,
    /// Whether it counts in the last stage alone.
    pub last: bool,
}

impl Target {
    /// Standard deviation of the residual's numerator, the model's scatter included, in units of
    /// [`Self::scale`].
    #[must_use]
    pub fn relative_sd(&self) -> f64 {
        self.sd.hypot(self.scatter) / self.scale()
    }

    /// Distance of a value from the target in units of [`Self::scale`], stopped at the logarithm of [`FAR`].
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        let most = FAR.ln();
        match self.measure {
            Measure::Log => {
                let ratio = value / self.value;
                if ratio > 0.0 { ratio.ln().clamp(-most, most) } else { -most }
            }
            Measure::Linear { scale } => ((value - self.value) / scale).clamp(-most, most),
        }
    }

    /// Distance of one value from another, as [`Self::distance`] has it; zero where no logarithm can be
    /// taken.
    #[must_use]
    pub fn distance_between(&self, value: f64, from: f64) -> f64 {
        match self.measure {
            Measure::Log => {
                Some(value / from).filter(|ratio| *ratio > 0.0 && ratio.is_finite()).map_or(0.0, f64::ln)
            }
            Measure::Linear { scale } => (value - from) / scale,
        }
    }

    /// The target of the first stage: known to no better than [`FROM_AFAR`], and none where it counts in the
    /// last stage alone.
    fn seen_from_afar(&self) -> Option<Self> {
        let sd = self.sd.max(FROM_AFAR * self.scale());
        (!self.last).then(|| Self { sd, ..self.clone() })
    }

    /// What a relative change refers to, in the feature's unit: the target's size, or the scale of its
    /// differences.
    #[must_use]
    pub fn scale(&self) -> f64 {
        match self.measure {
            Measure::Log => self.value.abs(),
            Measure::Linear { scale } => scale,
        }
    }
}

/// A feature as a model shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
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
    /// It was seen.
    Seen(Sight),
    /// Why it was not.
    Missing(String),
}

impl Observed {
    /// A value of one run, the strongest of its kind.
    #[must_use]
    pub fn of(value: f64) -> Self {
        Self::Seen(Sight { value, spread: 0.0, below_db: 0.0 })
    }

    /// What was seen, if anything.
    #[must_use]
    pub fn sight(&self) -> Option<&Sight> {
        match self {
            Self::Seen(sight) => Some(sight),
            Self::Missing(_) => None,
        }
    }

    /// The value, if there is one.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        self.sight().map(|sight| sight.value)
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

    /// What one measurement of that model would show: noise, lost points and starting state of draw number
    /// `draw`.
    ///
    /// # Errors
    /// As [`Self::predict`].
    fn twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure>;
}

/// Which of the many equally likely runs and recordings of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Draw {
    /// Starting state; 0 is the scene's own.
    pub member: u64,
    /// Noise of the tracking; 0 is the one that every evaluation of a search shares.
    pub noise: u64,
    /// Whether frames are lost as in the recording.
    pub dropouts: bool,
}

/// A model that is seen through cameras.
pub trait Model: Sync {
    /// What the camera of a condition of the job (counted from 0) records; `values` are the free parameters
    /// in job order, in their SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn observe(&self, values: &[f64], condition: usize, draw: Draw) -> Result<Recording, RunFailure>;
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
    /// Cost from afar: without the features of the last stage, and with deviations of at least [`FROM_AFAR`].
    pub global_cost: f64,
    /// Features in the order of the targets; empty when the run failed.
    pub features: Vec<Observed>,
    /// Why the run failed, if it did.
    pub failure: Option<RunFailure>,
}

/// A free parameter as the search sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Its range.
    pub bounds: Bounds,
    /// What is known of it beforehand.
    pub prior: Option<Prior>,
}

impl From<Bounds> for Axis {
    fn from(bounds: Bounds) -> Self {
        Self { bounds, prior: None }
    }
}

/// Bounds, targets and the model between them.
pub struct Objective<'a> {
    axes: Vec<Axis>,
    targets: Vec<Target>,
    model: &'a dyn Predict,
}

impl<'a> Objective<'a> {
    /// One axis a free parameter, one target a feature; targets are finite, not zero where logarithms are
    /// taken, with a standard deviation above zero (as [`crate::feature`] and [`super::job`] make them).
    #[must_use]
    pub fn new(axes: Vec<Axis>, targets: Vec<Target>, model: &'a dyn Predict) -> Self {
        Self { axes, targets, model }
    }

    /// The free parameters in job order.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Targets in job order.
    #[must_use]
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// Parameter values at a place in the unit box.
    #[must_use]
    pub fn values(&self, unit: &[f64]) -> Vec<f64> {
        self.axes.iter().zip(unit).map(|(axis, u)| axis.bounds.from_unit(*u)).collect()
    }

    /// Runs the model at a place in the unit box; never fails and never panics.
    #[must_use]
    pub fn evaluate(&self, unit: &[f64]) -> Evaluation {
        let values = self.values(unit);
        let outcome = guarded(|| self.model.predict(&values)).and_then(|features| self.admit(features));
        let (features, failure) = match outcome {
            Ok(features) => (features, None),
            Err(failure) => {
                (Vec::new(), Some(RunFailure::new(&failure.reason, failure.message, failure.progress)))
            }
        };
        self.priced(Evaluation {
            unit: unit.to_vec(),
            values,
            cost: 0.0,
            global_cost: 0.0,
            features,
            failure,
        })
    }

    /// The evaluation with its costs, which follow from its features or its failure and its values.
    #[must_use]
    pub fn priced(&self, evaluation: Evaluation) -> Evaluation {
        let priors: f64 =
            self.prior_residuals(&evaluation.values).map(|r| rho(r.clamp(-MOST_PRIOR, MOST_PRIOR))).sum();
        let of = |targets: &mut dyn Iterator<Item = Option<Target>>| {
            let costs: Vec<(f64, f64)> = targets
                .enumerate()
                .filter_map(|(at, t)| Some(self.cost(evaluation.features.get(at), &t?)))
                .collect();
            let (seen, farthest) =
                costs.into_iter().fold((0.0, 0.0), |sum, cost| (sum.0 + cost.0, sum.1 + cost.1));
            priors
                + evaluation
                    .failure
                    .as_ref()
                    .map_or(seen, |failure| (2.0 - failure.progress) * farthest.max(1.0))
        };
        let cost = of(&mut self.targets.iter().map(|target| Some(target.clone())));
        let global_cost = of(&mut self.targets.iter().map(Target::seen_from_afar));
        Evaluation { cost, global_cost, ..evaluation }
    }

    /// The same with the scatter of each feature, in its unit.
    #[must_use]
    pub fn with_scatter(&self, scatter: &[f64]) -> Self {
        let targets = self
            .targets
            .iter()
            .zip(scatter)
            .map(|(target, scatter)| Target { scatter: *scatter, ..target.clone() });
        Self { axes: self.axes.clone(), targets: targets.collect(), model: self.model }
    }

    /// What one measurement of the model at `values` would show.
    ///
    /// # Errors
    /// [`RunFailure`], also for a panic and for numbers that are not finite.
    pub fn twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure> {
        guarded(|| self.model.twin(values, draw)).and_then(|features| self.admit(features))
    }

    /// Distances from the priors, in standard deviations, of the parameters that have one.
    pub fn prior_residuals(&self, values: &[f64]) -> impl Iterator<Item = f64> {
        self.axes.iter().zip(values).filter_map(|(axis, value)| Some(axis.prior.as_ref()?.residual(*value)))
    }

    /// Stops numbers that are not finite at the border.
    fn admit(&self, features: Vec<Observed>) -> Result<Vec<Observed>, RunFailure> {
        if features.len() != self.targets.len() {
            let message =
                format!("the model gave {} features, expected {}", features.len(), self.targets.len());
            return Err(RunFailure::new("feature-count", message, 0.0));
        }
        let odd = |seen: &Sight| {
            [seen.value, seen.spread, seen.below_db].into_iter().find(|number| !number.is_finite())
        };
        match features
            .iter()
            .zip(&self.targets)
            .find_map(|(feature, target)| Some((feature.sight().and_then(odd)?, target)))
        {
            Some((found, target)) => {
                Err(RunFailure::new("not-a-number", format!("feature `{}` is {found}", target.name), 0.0))
            }
            None => Ok(features),
        }
    }

    /// What a feature costs, and the most that it can.
    fn cost(&self, feature: Option<&Observed>, target: &Target) -> (f64, f64) {
        let farthest = farthest(target);
        (feature.and_then(Observed::sight).map_or(farthest, |sight| cost_of(sight, target)), farthest)
    }
}

/// Most standard deviations from a prior that are counted, so that costs stay finite.
const MOST_PRIOR: f64 = 1e6;

/// Distance over its standard deviation, the spread over starting states included.
#[must_use]
pub fn residual(sight: &Sight, target: &Target) -> f64 {
    target.distance(sight.value) / total_sd(sight, target)
}

/// Standard deviation of the distance: of the target and over starting states.
#[must_use]
pub fn total_sd(sight: &Sight, target: &Target) -> f64 {
    target.relative_sd().hypot(sight.spread / target.scale())
}

/// What a feature that was seen costs; never more than one that was not.
fn cost_of(sight: &Sight, target: &Target) -> f64 {
    let assigned = (sight.below_db / ASSIGN_DB).powi(2);
    let spread = 2.0 * (total_sd(sight, target) / target.relative_sd()).ln();
    (rho(residual(sight, target)) + spread + assigned).min(farthest(target))
}

fn farthest(target: &Target) -> f64 {
    rho(FAR.ln() / target.relative_sd())
}

/// A residual's share of the cost: its square, and beyond [`KNEE`] a logarithm with the same slope there.
#[must_use]
pub fn rho(residual: f64) -> f64 {
    let size = residual.abs();
    if size <= KNEE { size * size } else { KNEE * KNEE * (1.0 + 2.0 * (size / KNEE).ln()) }
}

/// The outcome, or the words of a panic as a failure.
fn guarded<T>(run: impl FnOnce() -> Result<T, RunFailure>) -> Result<T, RunFailure> {
    catch_unwind(AssertUnwindSafe(run))
        .unwrap_or_else(|payload| Err(RunFailure::new("panic", words_of(payload.as_ref()), 0.0)))
}

/// What a panic said, if it said it in words.
fn words_of(payload: &(dyn Any + Send)) -> String {
    let words = payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned());
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

        fn twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
            self.predict(values)
        }
    }

    fn at(fake: &Fake, unit: f64) -> Evaluation {
        objective(fake, None).evaluate(&[unit])
    }

    fn objective(fake: &Fake, prior: Option<Prior>) -> Objective<'_> {
        let bounds = Bounds::new(0.0, 100.0, Spacing::Linear).unwrap();
        Objective::new(vec![Axis { bounds, prior }], vec![low()], fake)
    }

    fn low() -> Target {
        Target {
            name: "low".to_owned(),
            value: 80.0,
            sd: 0.8,
            scatter: 0.0,
            measure: Measure::Log,
            last: false,
        }
    }

    #[test]
    fn the_cost_is_the_square_of_the_log_residual_and_then_a_logarithm() {
        let identity = Fake(|p| Ok(vec![Observed::of(p)]));
        assert_eq!(at(&identity, 0.8).cost, 0.0);
        let near = (0.81_f64 / 0.8).ln() / 0.01;
        assert!((at(&identity, 0.81).cost - near * near).abs() < 1e-9);
        let off = 2.0_f64.ln() / 0.01;
        assert!((at(&identity, 0.4).cost - 9.0 * (1.0 + 2.0 * (off / 3.0).ln())).abs() < 1e-9);
    }

    #[test]
    fn a_missing_value_costs_as_much_as_the_farthest_one_and_a_failure_more() {
        let missing = at(&Fake(|_| Ok(vec![Observed::Missing("no peak".to_owned())])), 0.5);
        let wrong_sign = at(&Fake(|_| Ok(vec![Observed::of(-80.0)])), 0.5);
        assert!((missing.cost - 9.0 * (1.0 + 2.0 * (100.0_f64.ln() / 0.03).ln())).abs() < 1e-9);
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
        assert_eq!(
            reason(&Fake(|_| Ok(vec![Observed::of(f64::NAN)]))),
            ("not-a-number".to_owned(), "feature `low` is NaN".to_owned())
        );
        assert_eq!(reason(&Fake(|_| Ok(vec![]))).0, "feature-count");
        let odd = at(
            &Fake(|_| Err(RunFailure { reason: "x".to_owned(), message: String::new(), progress: f64::NAN })),
            0.5,
        );
        assert!(odd.cost.is_finite());
    }

    #[test]
    fn a_spread_over_starting_states_counts_as_a_likelihood_says() {
        // s^2 = 0.01^2 + 0.03^2: the residual shrinks, and 2 ln(s / sd) = ln 10 is paid
        let wide = Sight { value: 80.0 * 0.05_f64.exp(), spread: 2.4, below_db: 0.0 };
        assert!((cost_of(&wide, &low()) - (0.05_f64.powi(2) / 1e-3 + 10.0_f64.ln())).abs() < 1e-9);
        let hopeless = Sight { value: 1e-9, spread: 1e9, below_db: 0.0 };
        assert!(cost_of(&hopeless, &low()) <= farthest(&low()));
    }

    #[test]
    fn a_weaker_peak_costs_and_a_prior_counts() {
        let weaker = Sight { value: 80.0, spread: 0.0, below_db: 12.0 };
        assert_eq!(cost_of(&weaker, &low()), 4.0);
        let prior = Prior::Log { mean_ln: 40.0_f64.ln(), sd_ln: 0.2 };
        let exact = Fake(|_| Ok(vec![Observed::of(80.0)]));
        let found = objective(&exact, Some(prior)).evaluate(&[0.44]);
        assert!((found.cost - (1.1_f64.ln() / 0.2).powi(2)).abs() < 1e-12);
    }

    #[test]
    fn a_difference_may_pass_through_zero() {
        let target = Target {
            name: "flip".to_owned(),
            value: 0.0,
            sd: 1e-3,
            scatter: 0.0,
            measure: Measure::Linear { scale: 0.05 },
            last: false,
        };
        let r = |value| residual(&Sight { value, spread: 0.0, below_db: 0.0 }, &target);
        assert!((r(-2e-3) + 2.0).abs() < 1e-12 && (r(3e-3) - 3.0).abs() < 1e-12);
        assert!((r(9.0) - 100.0_f64.ln() / 0.02).abs() < 1e-9, "stopped where a ratio would be");
    }

    #[test]
    fn the_features_of_the_last_stage_are_left_out_of_the_first() {
        let fake = Fake(|p| Ok(vec![Observed::of(80.0), Observed::of(p)]));
        let targets = vec![low(), Target { name: "line".to_owned(), last: true, ..low() }];
        let found =
            Objective::new(vec![Bounds::new(0.0, 100.0, Spacing::Linear).unwrap().into()], targets, &fake)
                .evaluate(&[0.81]);
        assert!(found.cost > 1.0 && found.global_cost == 0.0);
    }
}
