//! Uncertainty of the parameters at the best point: intervals, verdicts, correlations and combinations.
//!
//! The interval of a parameter contains three others: the interval of the profile likelihood
//! ([`super::profile`]), the interval from refits to twins (recordings simulated with the best model,
//! [`super::bootstrap`]), and the range of all evaluated points whose cost is within the threshold. Without a
//! profile, the interval of the linear model at the best point is used in its place.

mod rivals;
mod verdicts;

pub(crate) use super::linear_model::CHI_SQUARED_95;
pub(crate) use rivals::confirm_identified;
pub(super) use verdicts::stored_verdicts;
pub(crate) use verdicts::{FeatureWeights, weigh_features};

use super::bootstrap::{Bootstrap, bootstrap_refits};
use super::camera_calibration::CameraEstimate;
use super::evaluation::{Evaluation, EvaluationStage};
use super::job::IntervalSettings;
use super::journal::StopReason;
use super::ledger::Ledger;
use super::linear_model::{self, FeatureSlopes, ParameterCombination, SingularDirections, Z_95};
use super::linear_model::{camera_estimates, difference_points, residuals};
use super::objective::Objective;
use super::profile::{AT_BOUND, ProfileLikelihood, profile_parameters};
use super::result::ParameterResult;
use super::search::{MIN_WORTHWHILE_GAIN, polish_best};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use verdicts::{best_excluded_gain, check_best_point, is_at_bound, withdraw_all, withdraw_correlated};

/// Maximum number of times that the assessment starts again from a better point.
const MAX_RESTARTS: usize = 2;

/// Verdict on a parameter: whether the fit identifies it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterVerdict {
    /// The features determine the parameter, and its interval lies within the bounds.
    Identified,
    /// The interval reaches the lower bound, so only an upper limit is known.
    OpenBelow,
    /// The interval reaches the upper bound, so only a lower limit is known.
    OpenAbove,
    /// The features do not determine the parameter, or there is another reason to doubt its interval.
    #[default]
    NotIdentified,
    /// The best value is at a bound, so the optimum may lie outside the bounds.
    AtBound,
}

impl ParameterVerdict {
    /// Name of the verdict in files and summaries.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::OpenBelow => "open-below",
            Self::OpenAbove => "open-above",
            Self::NotIdentified => "not-identified",
            Self::AtBound => "at-bound",
        }
    }
}

impl ParameterResult {
    /// Changes the verdict to not identified and adds a reason.
    fn withdraw_verdict(&mut self, reason: String) {
        self.verdict = ParameterVerdict::NotIdentified;
        self.reasons.push(reason);
    }
}

/// Assessment of the best point.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct FitUncertainty {
    pub best: Evaluation,
    /// Results of the parameters, in job order.
    pub intervals: Vec<ParameterResult>,
    /// Number of directions in the parameter space that the features determine.
    pub rank: usize,
    /// Condition number of the Jacobian: ratio of the largest to the smallest singular value; infinite if the
    /// smallest is zero or a rounding error.
    pub condition: f64,
    /// Number of features and priors that, by the linear model, change across the search box by more than the
    /// width of their 95 % interval.
    pub informative_features: usize,
    /// `d ln feature / d ln parameter`, one row per feature and one column per parameter; `None` if the
    /// feature is missing or the parameter is zero.
    pub sensitivities: Vec<Vec<Option<f64>>>,
    /// Correlation matrix of the estimates by the linear model; `None` where a parameter is not determined.
    pub correlations: Vec<Vec<Option<f64>>>,
    /// Combinations of parameters that the features determine or leave undetermined.
    pub combinations: Vec<ParameterCombination>,
    /// Estimated calibration errors of the cameras at the best point.
    pub cameras: Vec<CameraEstimate>,
    /// Standard deviation of each feature over twins of the best model, in the unit of the feature.
    pub twin_sd: Vec<Option<f64>>,
    /// Number of twins that were fitted again.
    pub twins: usize,
    /// Remarks for the reader, one sentence each.
    pub notes: Vec<String>,
}

/// Warns if there are fewer informative features than parameters. `rank` is the number of informative
/// directions; it is `None` before a search.
pub(crate) fn count_warning(features: usize, rank: Option<usize>, parameters: usize) -> Option<String> {
    let known = rank.map_or(features, |rank| rank.min(features));
    if known >= parameters {
        return None;
    }
    let (features_word, parameters_word) =
        (count_noun(features, "informative feature"), count_noun(parameters, "parameter"));
    let directions = match rank {
        Some(rank) => format!("they fix {}", count_noun(rank, "combination")),
        None => format!("they can fix at most {}", count_noun(features, "combination")),
    };
    Some(format!(
        "{features_word} for {parameters_word}: {directions} of the parameters and leave {} open; add features such as release-after-reversal, mean-deflection or rms, or take parameters out of the job",
        parameters - known
    ))
}

/// Assesses the best point of the ledger; `None` if the ledger is empty. If a profile finds a better point,
/// that point is polished with at most `polishing` evaluations and assessed instead.
pub(crate) fn assess_best(
    ledger: &mut Ledger,
    names: &[String],
    settings: &IntervalSettings,
    polishing: usize,
) -> Option<FitUncertainty> {
    for _ in 0..MAX_RESTARTS {
        let found = assess_once(ledger, names, settings)?;
        let better =
            ledger.best_evaluation().is_some_and(|now| found.best.cost - now.cost > MIN_WORTHWHILE_GAIN);
        if !better {
            return Some(found);
        }
        polish_within(ledger, polishing);
    }
    assess_once(ledger, names, settings)
}

/// Refines the best point by local searches with at most `evaluations` further evaluations.
fn polish_within(ledger: &mut Ledger, evaluations: usize) {
    let limit = ledger.evaluation_limit();
    ledger.set_limit(limit.min(ledger.run_evaluations().len().saturating_add(evaluations)));
    polish_best(ledger);
    ledger.set_limit(limit);
}

fn assess_once(ledger: &mut Ledger, names: &[String], settings: &IntervalSettings) -> Option<FitUncertainty> {
    let best = ledger.best_evaluation()?.clone();
    if let Some(failure) = &best.failure {
        let why = format!("every evaluation failed, the best one with {failure}");
        return Some(unassessed_point(ledger.objective(), &best, &why));
    }
    let points = difference_points(&best.unit);
    let around: Vec<Evaluation> = match ledger.evaluate_points(EvaluationStage::Sensitivity, &points) {
        Ok(around) => around.into_iter().cloned().collect(),
        Err(_) => return Some(unassessed_point(ledger.objective(), &best, BUDGET_USED_UP)),
    };
    let local = LocalAssessment::new(ledger.objective(), best, &around);
    let profiles =
        settings.profile.then(|| profile_parameters(ledger, &local.best, &local.jacobian, CHI_SQUARED_95));
    let twins = (settings.bootstrap > 0)
        .then(|| bootstrap_refits(ledger, &local.best, &local.jacobian, settings.bootstrap));
    let mut notes = Vec::new();
    let profiles = keep_or_note(profiles, "profiles", &mut notes);
    let twins = keep_or_note(twins, "twins", &mut notes);
    Some(local.assess(ledger, names, &IntervalEvidence { profiles, twins }, &around, notes))
}

const BUDGET_USED_UP: &str =
    "the evaluations allowed were used up, or the fit was interrupted, before the sensitivities";

fn keep_or_note<T>(found: Option<Result<T, StopReason>>, what: &str, notes: &mut Vec<String>) -> Option<T> {
    let found = found?;
    if found.is_err() {
        notes.push(format!(
            "no {what}: the evaluations allowed were used up, or the fit was interrupted; intervals are those of the linear model and of the points met"
        ));
    }
    found.ok()
}

/// The assessment of a best point whose neighbours could not be evaluated, for the reason `why`.
pub(crate) fn unassessed_point(objective: &Objective, best: &Evaluation, why: &str) -> FitUncertainty {
    let open = |estimate: &f64| ParameterResult { estimate: *estimate, ..ParameterResult::default() };
    FitUncertainty {
        best: best.clone(),
        intervals: best.values.iter().map(open).collect(),
        condition: f64::INFINITY,
        cameras: camera_estimates(objective, best, None),
        notes: vec![format!("no intervals: {why}")],
        ..FitUncertainty::default()
    }
}

impl FitUncertainty {
    /// Removes all intervals if the search did not converge or if [`check_best_point`] does not confirm the
    /// best point; `ends` are the ends of the local searches without the final polish.
    pub(crate) fn with_search_doubts(
        self,
        converged: bool,
        objective: &Objective,
        ends: &[Evaluation],
    ) -> Self {
        if !converged {
            return self.withhold_intervals(SEARCH_UNFINISHED.to_owned());
        }
        let costs: Vec<f64> = ends.iter().map(|end| objective.add_costs(end.clone().into()).cost).collect();
        match check_best_point(objective, &objective.add_costs(self.best.clone().into()), &costs) {
            Ok(()) => self,
            Err(why) => self.withhold_intervals(why),
        }
    }

    /// Changes all identified parameters to not identified if there is evidence `why` against the model.
    pub(crate) fn with_model_objection(mut self, why: Option<String>) -> Self {
        if let Some(why) = why {
            let known = self.intervals.iter_mut().filter(|i| i.verdict == ParameterVerdict::Identified);
            known.for_each(|interval| interval.withdraw_verdict(why.clone()));
            self.notes.insert(0, why);
        }
        self
    }

    fn withhold_intervals(mut self, why: String) -> Self {
        self.notes.insert(0, why);
        for found in &mut self.intervals {
            (found.lower_95, found.upper_95, found.verdict) = (None, None, ParameterVerdict::NotIdentified);
        }
        self
    }
}

const SEARCH_UNFINISHED: &str = "the search was still gaining when its evaluations were used up, or was interrupted: there is a better point, so nothing is called identified; \
    raise local_evaluations in [search], or --max-evaluations, and go on with --resume";

/// Data for the intervals that do not come from the linear model.
struct IntervalEvidence {
    profiles: Option<Vec<ProfileLikelihood>>,
    twins: Option<Bootstrap>,
}

/// The best point with its linear model.
struct LocalAssessment {
    best: Evaluation,
    slopes: FeatureSlopes,
    jacobian: DMatrix<f64>,
    directions: SingularDirections,
}

impl LocalAssessment {
    fn new(objective: &Objective, best: Evaluation, around: &[Evaluation]) -> Self {
        let around: Vec<&Evaluation> = around.iter().collect();
        let slopes = FeatureSlopes::from_differences(objective.targets(), &best, &around);
        let jacobian = linear_model::jacobian(objective, &best, &slopes);
        Self { slopes, directions: SingularDirections::from_jacobian(&jacobian), jacobian, best }
    }

    fn assess(
        self,
        ledger: &Ledger,
        names: &[String],
        evidence: &IntervalEvidence,
        around: &[Evaluation],
        late: Vec<String>,
    ) -> FitUncertainty {
        let objective = ledger.objective();
        let mut intervals: Vec<_> =
            (0..names.len()).map(|axis| self.parameter_interval(ledger, axis, evidence)).collect();
        let known = self.jacobian.row_iter().take(self.jacobian.nrows() - objective.count_camera_unknowns());
        let informative_features = known.filter(|row| row.norm() > linear_model::MIN_INFORMATIVE).count();
        let mut notes = withdraw_correlated(&mut intervals, names, &self.best.unit, &self.directions);
        let residuals = residuals(objective, &self.best);
        if let Some(held) = best_excluded_gain(&self.best.unit, &self.jacobian, &residuals) {
            notes.extend(withdraw_all(&mut intervals, names, held));
        }
        notes.extend(count_warning(informative_features, Some(self.directions.rank), names.len()));
        notes.extend(failed_step_notes(names, around));
        notes.extend(late);
        let correlation = |a: usize| (0..names.len()).map(|b| self.directions.correlation(a, b)).collect();
        FitUncertainty {
            intervals,
            rank: self.directions.rank,
            condition: self.directions.condition_number(),
            informative_features,
            sensitivities: log_sensitivities(objective, &self.best, &self.slopes),
            correlations: (0..names.len()).map(correlation).collect(),
            combinations: self.directions.combinations(names, objective.axes(), &self.best.unit),
            cameras: camera_estimates(objective, &self.best, Some(&self.slopes)),
            twin_sd: evidence.twins.as_ref().map_or_else(Vec::new, |twins| twins.feature_sd.clone()),
            twins: evidence.twins.as_ref().map_or(0, |twins| twins.refits.len()),
            notes,
            best: self.best,
        }
    }

    fn parameter_interval(
        &self,
        ledger: &Ledger,
        axis: usize,
        evidence: &IntervalEvidence,
    ) -> ParameterResult {
        let unit = self.best.unit.get(axis).copied().unwrap_or(0.5);
        let profile = evidence.profiles.as_ref().and_then(|profiles| profiles.get(axis));
        let linear = self.linear_interval(axis, unit);
        let twins = evidence.twins.as_ref().and_then(|twins| {
            Some(Z_95 * student_factor(twins.refits.len()) * twins.refit_spread(axis, unit)?)
        });
        let twins = twins.map(|half| [unit - half, unit + half]);
        let lower = profile.map_or(linear.map(|l| l[0]), |p| p.lower);
        let upper = profile.map_or(linear.map(|l| l[1]), |p| p.upper);
        let limit = self.best.cost + CHI_SQUARED_95;
        let good = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && e.cost <= limit);
        let good = good.filter_map(|e| e.unit.get(axis).copied());
        let (least, most) = good.fold((unit, unit), |(least, most), u| (least.min(u), most.max(u)));
        let [below, above] = twins.unwrap_or([unit, unit]);
        let value =
            |u: f64| ledger.objective().axes().get(axis).map_or(f64::NAN, |a| a.bounds.value_at_unit(u));
        // an interval that reaches a bound is open at this end, because no value outside the bound was tried
        let inside = |u: f64| (AT_BOUND..=1.0 - AT_BOUND).contains(&u).then(|| value(u));
        let lower_95 = lower.and_then(|u| inside(u.min(least).min(below)));
        let upper_95 = upper.and_then(|u| inside(u.max(most).max(above)));
        ParameterResult {
            estimate: self.best.values.get(axis).copied().unwrap_or(f64::NAN),
            lower_95,
            upper_95,
            verdict: interval_verdict(unit, lower_95, upper_95, self.directions.determines(axis)),
            linear_95: linear.map(|ends| ends.map(value)),
            profile: profile
                .map_or_else(Vec::new, |p| p.points.iter().map(|(u, cost)| (value(*u), *cost)).collect()),
            profile_95: profile.map_or([None, None], |p| [p.lower.map(value), p.upper.map(value)]),
            bootstrap_95: twins.map(|ends| ends.map(value)),
            reasons: Vec::new(),
        }
    }

    fn linear_interval(&self, axis: usize, unit: f64) -> Option<[f64; 2]> {
        let half = CHI_SQUARED_95.sqrt() * self.directions.coordinate_sd(axis).0;
        self.directions.determines(axis).then_some([unit - half, unit + half])
    }
}

/// The verdict on an interval. A parameter that the features do not determine near the best point is not
/// identified, even if its interval is finite because the model fails outside it.
fn interval_verdict(unit: f64, lower: Option<f64>, upper: Option<f64>, determined: bool) -> ParameterVerdict {
    match (lower, upper) {
        (None, None) => ParameterVerdict::NotIdentified,
        _ if is_at_bound(unit) => ParameterVerdict::AtBound,
        (Some(_), Some(_)) if determined => ParameterVerdict::Identified,
        (Some(_), Some(_)) => ParameterVerdict::NotIdentified,
        (None, Some(_)) => ParameterVerdict::OpenBelow,
        (Some(_), None) => ParameterVerdict::OpenAbove,
    }
}

/// Ratio of the 97.5 % quantile of Student's t with `freedoms` degrees of freedom to that of the normal
/// distribution, to first order in 1 / `freedoms` (Abramowitz and Stegun, 26.7.5).
fn student_factor(freedoms: usize) -> f64 {
    1.0 + (Z_95 * Z_95 + 1.0) / (4.0 * freedoms.max(1) as f64)
}

fn log_sensitivities(
    objective: &Objective,
    best: &Evaluation,
    slopes: &FeatureSlopes,
) -> Vec<Vec<Option<f64>>> {
    let per_log = |axis: usize, slope: Option<f64>| {
        let unit = best.unit.get(axis)?;
        Some(slope? / objective.axes().get(axis)?.bounds.log_slope(*unit)?)
    };
    let row = |row: &Vec<_>| row.iter().enumerate().map(|(axis, slope)| per_log(axis, *slope)).collect();
    slopes.0.iter().map(row).collect()
}

/// A note for each parameter for which the model failed at a step of the finite differences.
fn failed_step_notes(names: &[String], around: &[Evaluation]) -> Vec<String> {
    let failed = |axis: usize| around.iter().skip(2 * axis).take(2).find_map(|e| e.failure.as_ref());
    let note = |(axis, name): (usize, &String)| {
        failed(axis).map(|f| {
            format!("the model fails ({}) one step of {} of its range from the best {name}; its sensitivities are one-sided or unknown", f.reason, linear_model::DIFFERENCE_STEP)
        })
    };
    names.iter().enumerate().filter_map(note).collect()
}

fn count_noun(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests;
