//! A stored result against what its job, recordings and model say now: everything that one evaluation of the
//! model and arithmetic on the stored numbers can decide.
//!
//! What the model shows is computed again from the stored estimates. What follows from the stored numbers is
//! computed from those: targets, relative errors, what is met, the cost, and each verdict. Intervals,
//! sensitivities and the record of the search would need the fit again; they are held against each other, and
//! a changed digit of them is found by the hash that the file carries.

use super::FitError;
use super::bounds::SearchAxis;
use super::evaluation::{Evaluation, Observation, Observed};
use super::job::{FitTarget, FreeParameter, Job};
use super::linear_model::CHI_SQUARED_95;
use super::linear_model::camera_estimates;
use super::misfit::TraceMisfit;
use super::model::ModelFeatures;
use super::objective::Objective;
use super::problem::Problem;
use super::result::{
    ComponentResult, FeatureResult, FitResult, FitStatus, ModelledTargets, NuisanceResult, ParameterResult,
    ResultError, camera_nuisance_results, predicted_feature_result,
};
use super::run::{predict_held_out, read_best_model};
use super::targets::TargetValue;
use super::targets::measure_targets;
use super::trace_run::trace_verdict;
use super::uncertainty::{ParameterVerdict, stored_verdicts};
use crate::recording::Recording;
use serde_json::Value;

/// Largest relative difference between a stored number and the same computed again. The same program on the
/// same machine differs in no digit; with other vector instructions (AVX2 and FMA masked) nothing in the
/// reports of the committed fits moved by more than 4e-11. A feature is measured to 1e-3 at best.
const RELATIVE_TOLERANCE: f64 = 1e-6;
/// Differences below this are rounding of numbers that are zero but for it.
const ABSOLUTE_TOLERANCE: f64 = 1e-12;
/// Most differences that a refusal names.
const MOST_NAMED: usize = 8;

impl Problem {
    /// Holds a result against what the model shows at its estimates, and its numbers against each other;
    /// `file` is its name in refusals.
    ///
    /// # Errors
    /// [`ResultError`] with every entry that differs: its key, what is stored, and what was computed.
    pub fn check_result(&self, result: &FitResult, file: &str) -> Result<(), ResultError> {
        let found = self.result_differences(result).unwrap_or_else(|error| vec![error.to_string()]);
        if found.is_empty() {
            return Ok(());
        }
        let more = found.len().saturating_sub(MOST_NAMED);
        let more = if more > 0 { format!("; and {more} more") } else { String::new() };
        let named = found.into_iter().take(MOST_NAMED).collect::<Vec<_>>().join("; ");
        Err(ResultError { file: file.to_owned(), problem: named + &more })
    }

    fn result_differences(&self, stored: &FitResult) -> Result<Vec<String>, FitError> {
        let again = self.recompute_result(stored)?;
        let mut found = Vec::new();
        collect_differences("", &to_json_value(stored), &to_json_value(&again), &mut found);
        found.extend(self.find_contradictions(stored));
        Ok(found)
    }

    /// The result with everything that can be computed from its estimates and its other numbers computed.
    fn recompute_result(&self, stored: &FitResult) -> Result<FitResult, FitError> {
        let job = self.job();
        let mut again = stored.clone();
        match &stored.misfit {
            Some(misfit) => self.recompute_traces(stored, misfit, &mut again)?,
            None => self.recompute_features(stored, &mut again)?,
        }
        again.threshold = CHI_SQUARED_95;
        again.title.clone_from(&job.title);
        again.seed = job.search.seed;
        again.version = env!("CARGO_PKG_VERSION").to_owned();
        again.synthetic = self.recordings().iter().flatten().any(Recording::is_synthetic);
        let verdicts = match &stored.misfit {
            Some(_) => trace_verdicts(job, stored),
            None => stored_verdicts(job, stored),
        };
        for (name, verdict) in job.parameter_names().iter().zip(verdicts) {
            again.parameters.entry(name.clone()).and_modify(|p| p.verdict = verdict);
        }
        Ok(again)
    }

    /// What the whole runs of the stored model show, and the judgement on the stored residuals.
    fn recompute_traces(
        &self,
        stored: &FitResult,
        misfit: &TraceMisfit,
        again: &mut FitResult,
    ) -> Result<(), FitError> {
        let (shown, held_out) =
            self.compare_with_targets(stored, measure_targets(self.job(), self.recordings())?)?;
        (again.components, again.features, again.held_out) = (shown.components, shown.features, held_out);
        again.misfit =
            Some(TraceMisfit::judge(misfit.channels.clone(), misfit.stages.clone(), &again.nuisances));
        Ok(())
    }

    /// What the model shows at the stored estimates, and what follows from the stored features.
    fn recompute_features(&self, stored: &FitResult, again: &mut FitResult) -> Result<(), FitError> {
        let job = self.job();
        let all = measure_targets(job, self.recordings())?;
        let (fitted, held): (Vec<_>, Vec<_>) =
            job.targets.iter().cloned().zip(all).partition(|(aim, _)| !aim.held_out);
        let (aims, targets): (Vec<FitTarget>, Vec<TargetValue>) = fitted.into_iter().unzip();
        let wanted: Vec<_> = aims.iter().map(|aim| aim.feature.clone()).collect();
        let goals = targets.iter().map(|target| target.value).collect();
        let seen = ModelFeatures::new(self.model(), &wanted, goals, job.ensemble.members);
        let axes = job.parameters.iter().map(|p| SearchAxis { bounds: p.bounds, prior: p.prior }).collect();
        let rows: Vec<StoredFeature> =
            targets.iter().map(|target| StoredFeature::find(stored, &target.name)).collect();
        let scatter: Vec<f64> = rows.iter().map(|row| row.scatter.unwrap_or(0.0)).collect();
        let objective = Objective::new(axes, targets, &seen).with_feature_scatter(&scatter);
        let estimate = |name: &String| stored.parameters.get(name).map_or(f64::NAN, |p| p.estimate);
        let values: Vec<f64> = job.parameter_names().iter().map(estimate).collect();

        let model = objective.evaluate_values(values.clone());
        let as_stored = objective.add_costs(evaluation_as_stored(&model, &rows).into());
        let (twin_sd, reads): (Vec<Option<f64>>, _) =
            (rows.iter().map(|row| row.twin_sd).collect(), read_best_model(&seen, &values));
        let shown =
            |best: &Evaluation| ModelledTargets::compare(&aims, objective.targets(), &twin_sd, best, &reads);
        again.replace_model_values(shown(&model), shown(&as_stored));
        again.nuisances = camera_nuisance_results(job, &camera_estimates(&objective, &as_stored, None));
        for (again, stored) in again.nuisances.iter_mut().zip(&stored.nuisances) {
            (again.lower_95, again.upper_95) = (stored.lower_95, stored.upper_95);
        }
        again.held_out =
            predict_held_out(held, self.model(), &values).iter().map(predicted_feature_result).collect();
        again.cost = as_stored.cost;
        again.status = match (&model.failure, stored.status) {
            (Some(_), _) => FitStatus::Failed,
            (None, FitStatus::Failed) => FitStatus::Converged,
            (None, other) => other,
        };
        Ok(())
    }

    /// Numbers of a result that cannot all be right.
    fn find_contradictions(&self, stored: &FitResult) -> Vec<String> {
        let job = self.job();
        let mut found: Vec<String> = (job.parameters.iter())
            .filter_map(|free| Some((free, stored.parameters.get(&free.name)?)))
            .flat_map(|(free, p)| interval_contradictions(free, p, stored.status))
            .collect();
        found.extend(stored.nuisances.iter().filter_map(outside_own_interval));
        let total = stored.evaluations.total;
        let failed: usize = stored.evaluations.failed.values().sum();
        let counts = [("evaluations.failed", failed, total), ("rank", stored.rank, job.parameters.len())];
        found.extend(
            (counts.iter().filter(|(_, count, most)| count > most))
                .map(|(key, count, most)| format!("{key}: found {count}, expected at most {most}")),
        );
        found
    }
}

impl FitResult {
    /// The model's values, with errors and verdicts of the stored ones.
    fn replace_model_values(&mut self, model: ModelledTargets, stored: ModelledTargets) {
        let component = |(model, stored): (ComponentResult, ComponentResult)| ComponentResult {
            relative_error: stored.relative_error,
            pass: stored.pass,
            ..model
        };
        let feature = |(model, stored): (FeatureResult, FeatureResult)| FeatureResult {
            relative_error: stored.relative_error,
            pass: stored.pass,
            model_seen: stored.model_seen,
            ..model
        };
        self.components = model.components.into_iter().zip(stored.components).map(component).collect();
        self.features = model.features.into_iter().zip(stored.features).map(feature).collect();
    }
}

/// The verdicts that follow from the stored intervals and reasons.
fn trace_verdicts(job: &Job, stored: &FitResult) -> Vec<ParameterVerdict> {
    let of = |free: &FreeParameter| {
        stored
            .parameters
            .get(&free.name)
            .map_or(ParameterVerdict::NotIdentified, |found| trace_verdict(free, found))
    };
    job.parameters.iter().map(of).collect()
}

/// What a stored result says of one aim.
#[derive(Default)]
struct StoredFeature {
    value: Option<f64>,
    spread: Option<f64>,
    below_db: Option<f64>,
    scatter: Option<f64>,
    twin_sd: Option<f64>,
}

impl StoredFeature {
    fn find(result: &FitResult, name: &str) -> Self {
        let component = result.components.iter().find(|c| c.name == name).map(|c| Self {
            value: c.model_hz,
            spread: c.model_spread_hz,
            below_db: c.below_db,
            scatter: c.model_scatter_hz,
            twin_sd: c.twin_sd_hz,
        });
        let feature = || {
            result.features.iter().find(|f| f.name == name).map(|f| Self {
                value: f.model,
                spread: f.model_spread,
                below_db: None,
                scatter: f.model_scatter,
                twin_sd: f.twin_sd,
            })
        };
        component.or_else(feature).unwrap_or_default()
    }
}

/// The evaluation with the stored values in the place of the model's.
fn evaluation_as_stored(model: &Evaluation, rows: &[StoredFeature]) -> Evaluation {
    let one = |(shown, row): (&Observed, &StoredFeature)| match (row.value, shown) {
        (Some(value), shown) => {
            let below_db = row.below_db.or(shown.observation().map(|o| o.below_db)).unwrap_or(0.0);
            Observed::Value(Observation { value, spread: row.spread.unwrap_or(0.0), below_db })
        }
        (None, Observed::Missing(why)) => Observed::Missing(why.clone()),
        (None, Observed::Value(_)) => Observed::Missing("it is not in the result".to_owned()),
    };
    Evaluation { features: model.features.iter().zip(rows).map(one).collect(), ..model.clone() }
}

/// What an interval cannot be: it holds the estimate, lies within the bounds, and reaches as far as each of
/// the intervals that it is the widest of. A search that did not come to its end has none.
fn interval_contradictions(free: &FreeParameter, p: &ParameterResult, status: FitStatus) -> Vec<String> {
    let said = |key: &str, found: f64, expected: String| {
        format!("parameters.{}.{key}: found {found}, expected {expected}", free.name)
    };
    let mut found = Vec::new();
    let unfinished = matches!(status, FitStatus::BudgetExhausted | FitStatus::Failed);
    let main = p.profile_95.iter().any(Option::is_some) || !p.profile.is_empty();
    let linear = |end: usize| p.linear_95.filter(|_| !main).map(|ends| ends[end]);
    let twins = |end: usize| p.bootstrap_95.map(|ends| ends[end]);
    for (key, end, at, bound, sign) in [
        ("lower_95", p.lower_95, 0, free.bounds.lower(), 1.0),
        ("upper_95", p.upper_95, 1, free.bounds.upper(), -1.0),
    ] {
        let Some(end) = end else { continue };
        if unfinished {
            found.push(said(key, end, format!("none, as the fit is {}", status.name())));
        }
        let within = [p.profile_95[at], linear(at), twins(at), Some(p.estimate)];
        let slack = RELATIVE_TOLERANCE * end.abs();
        for inner in within.into_iter().flatten().filter(|inner| sign * (end - inner) > slack) {
            found.push(said(key, end, format!("an interval that holds {inner}")));
        }
        if sign * (bound - end) > slack {
            found.push(said(key, end, format!("a value within the bound {bound}")));
        }
    }
    found
}

/// An interval that does not hold its estimate.
fn outside_own_interval(n: &NuisanceResult) -> Option<String> {
    let ends = [n.lower_95.map(|lower| n.estimate - lower), n.upper_95.map(|upper| upper - n.estimate)];
    let beside = ends.into_iter().flatten().any(|reach| reach < -RELATIVE_TOLERANCE * n.estimate.abs());
    let of = n.recording.as_deref().unwrap_or("all recordings");
    beside.then(|| {
        let ends = [n.lower_95, n.upper_95].map(|end| end.map_or("none".to_owned(), |end| end.to_string()));
        let (name, [lower, upper]) = (&n.name, ends);
        format!(
            "nuisances, `{name}` of `{of}`: found {lower} to {upper}, expected an interval that holds {}",
            n.estimate
        )
    })
}

/// As the file has it.
fn to_json_value(result: &FitResult) -> Value {
    serde_json::to_value(result).unwrap_or_default()
}

/// Every leaf that differs, with its key.
fn collect_differences(key: &str, stored: &Value, again: &Value, found: &mut Vec<String>) {
    match (stored, again) {
        (Value::Object(a), Value::Object(b)) => {
            let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
            for name in names {
                let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                collect_differences(
                    &inner,
                    a.get(name).unwrap_or(&Value::Null),
                    b.get(name).unwrap_or(&Value::Null),
                    found,
                );
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (at, (a, b)) in a.iter().zip(b).enumerate() {
                collect_differences(&format!("{key}[{at}]"), a, b, found);
            }
        }
        _ if is_same_value(stored, again) => {}
        _ => found.push(format!("{key}: found {stored}, computed again {again}")),
    }
}

fn is_same_value(stored: &Value, again: &Value) -> bool {
    match (stored.as_f64(), again.as_f64()) {
        _ if stored == again => true,
        (Some(a), Some(b)) if stored.is_f64() || again.is_f64() => {
            (a - b).abs() <= RELATIVE_TOLERANCE * a.abs().max(b.abs()) + ABSOLUTE_TOLERANCE
        }
        _ => false,
    }
}
