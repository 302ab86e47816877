//! Checks a stored result against its job, recordings and model with one evaluation of the model.
//!
//! The values of the model are computed again from the stored estimates. Targets, relative errors, passes,
//! the cost and the verdicts are computed again from the stored numbers. To recompute intervals,
//! sensitivities and the record of the search, the whole fit would be needed; they are only checked for
//! consistency, and the hash of the file reveals any changed digit.

use super::FitError;
use super::evaluation::{Evaluation, Observation, Observed};
use super::job::FreeParameter;
use super::linear_model::{CHI_SQUARED_95, camera_estimates};
use super::misfit::TraceMisfit;
use super::model::ModelFeatures;
use super::objective::Objective;
use super::problem::Problem;
use super::result::{ComponentResult, FeatureResult, FitResult, FitStatus, ModelledTargets};
use super::result::{NuisanceResult, ParameterResult, ResultError, camera_nuisance_results};
use super::run::{predict_held_out, read_best_model};
use super::targets::{measure_targets, split_held_out};
use super::trace_run::trace_verdict;
use super::uncertainty::stored_verdicts;
use crate::recording::Recording;
use serde_json::Value;

/// A stored and a recomputed number count as equal if their relative difference is at most this value. On a
/// processor without AVX2 and FMA, the numbers of the committed reports change by up to 4e-11; on the same
/// machine they do not change. Features are measured to 1e-3 at best.
const RELATIVE_TOLERANCE: f64 = 1e-6;
/// Absolute differences below this value are rounding errors of numbers near zero.
const ABSOLUTE_TOLERANCE: f64 = 1e-12;
/// Maximum number of differences that a refusal lists.
const MOST_NAMED: usize = 8;

impl Problem {
    /// Checks a result against the model at the estimates, and the numbers of the result against each other;
    /// `file` is the name of the result file in error messages.
    ///
    /// # Errors
    /// [`ResultError`] with the entries that differ: key, stored value and computed value.
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
        let [stored_json, again] =
            [stored, &again].map(|result| serde_json::to_value(result).unwrap_or_default());
        let mut found = Vec::new();
        collect_differences("", &stored_json, &again, &mut found);
        found.extend(self.find_contradictions(stored));
        Ok(found)
    }

    /// A copy of the result in which every value that follows from the estimates or from other stored numbers
    /// is recomputed.
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
        let verdicts = stored_verdicts(job, stored);
        for (free, of_features) in job.parameters.iter().zip(verdicts) {
            let Some(p) = again.parameters.get_mut(&free.name) else { continue };
            p.verdict = stored.misfit.as_ref().map_or(of_features, |_| trace_verdict(free, p));
        }
        Ok(again)
    }

    /// Recomputes the runs of the fitted model over whole recordings, and the verdict on the stored
    /// residuals.
    fn recompute_traces(
        &self,
        stored: &FitResult,
        misfit: &TraceMisfit,
        again: &mut FitResult,
    ) -> Result<(), FitError> {
        let targets = measure_targets(self.job(), self.recordings())?;
        let (shown, held_out) = self.compare_with_targets(stored, targets)?;
        (again.components, again.features, again.held_out) = (shown.components, shown.features, held_out);
        again.misfit =
            Some(TraceMisfit::judge(misfit.channels.clone(), misfit.stages.clone(), &again.nuisances));
        Ok(())
    }

    /// Recomputes the features at the stored estimates, and the numbers that follow from the stored features.
    fn recompute_features(&self, stored: &FitResult, again: &mut FitResult) -> Result<(), FitError> {
        let job = self.job();
        let all = measure_targets(job, self.recordings())?;
        let (aims, targets, held) = split_held_out(job, all);
        let seen = ModelFeatures::for_targets(self.model(), &aims, &targets, job.ensemble.members);
        let rows: Vec<StoredFeature> =
            targets.iter().map(|target| StoredFeature::find(stored, &target.name)).collect();
        let scatter: Vec<f64> = rows.iter().map(|row| row.scatter.unwrap_or(0.0)).collect();
        let objective = Objective::new(job.parameters.clone(), targets, &seen).with_feature_scatter(&scatter);
        let values = stored.parameter_estimates(job);
        let model = objective.evaluate_values(values.clone());
        let as_stored = objective.add_costs(evaluation_as_stored(&model, &rows).into());
        let twin_sd: Vec<Option<f64>> = rows.iter().map(|row| row.twin_sd).collect();
        let reads = read_best_model(&seen, &values);
        let shown =
            |best: &Evaluation| ModelledTargets::compare(&aims, objective.targets(), &twin_sd, best, &reads);
        again.replace_model_values(shown(&model), shown(&as_stored));
        again.nuisances = camera_nuisance_results(job, &camera_estimates(&objective, &as_stored, None));
        for (again, stored) in again.nuisances.iter_mut().zip(&stored.nuisances) {
            (again.lower_95, again.upper_95) = (stored.lower_95, stored.upper_95);
        }
        again.held_out = predict_held_out(&held, self.model(), &values);
        again.cost = as_stored.cost;
        again.status = match (&model.failure, stored.status) {
            (Some(_), _) => FitStatus::Failed,
            (None, FitStatus::Failed) => FitStatus::Converged,
            (None, other) => other,
        };
        Ok(())
    }

    /// Describes numbers of a result that contradict each other.
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
    /// Takes the model values from `model`, and the relative errors, passes and values with camera errors
    /// from `stored`.
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

/// Stored numbers of one component or feature.
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
        let feature = result.features.iter().find(|f| f.name == name).map(|f| Self {
            value: f.model,
            spread: f.model_spread,
            below_db: None,
            scatter: f.model_scatter,
            twin_sd: f.twin_sd,
        });
        component.or(feature).unwrap_or_default()
    }
}

/// The evaluation of the model with the stored values in place of the computed ones.
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

/// Contradictions in the 95 % interval of a parameter. The interval must contain the estimate and the
/// intervals of all methods, and lie within the bounds. An unfinished search must have no interval.
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

/// Describes a nuisance parameter whose interval does not contain its estimate.
fn outside_own_interval(n: &NuisanceResult) -> Option<String> {
    let ends = [n.lower_95.map(|lower| n.estimate - lower), n.upper_95.map(|upper| upper - n.estimate)];
    let beside = ends.into_iter().flatten().any(|reach| reach < -RELATIVE_TOLERANCE * n.estimate.abs());
    let of = n.recording.as_deref().unwrap_or("all recordings");
    beside.then(|| {
        let ends = [n.lower_95, n.upper_95].map(|end| end.map_or("none".to_owned(), |end| end.to_string()));
        let (name, [lower, upper], best) = (&n.name, ends, n.estimate);
        format!(
            "nuisances, `{name}` of `{of}`: found {lower} to {upper}, expected an interval that holds {best}"
        )
    })
}

/// Adds to `found` a description of every JSON leaf value that differs between `stored` and `again`, with its
/// key.
fn collect_differences(key: &str, stored: &Value, again: &Value, found: &mut Vec<String>) {
    match (stored, again) {
        (Value::Object(a), Value::Object(b)) => {
            let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
            for name in names {
                let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                let [a, b] = [a, b].map(|object| object.get(name).unwrap_or(&Value::Null));
                collect_differences(&inner, a, b, found);
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
