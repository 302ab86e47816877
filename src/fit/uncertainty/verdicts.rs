//! What a parameter at its bound does to the estimates of the others.

use super::{ParameterResult, ParameterVerdict, interval_verdict};
use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::job::Job;
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::{
    CHI_SQUARED_95, SingularDirections, difference_points, feature_scatter, residuals,
};
use crate::fit::objective::Objective;
use crate::fit::profile::AT_BOUND;
use crate::fit::result::{FitResult, FitStatus};
use crate::fit::search::{EXACT_COST, MIN_WORTHWHILE_GAIN};
use crate::fit::targets::TargetValue;
use crate::math;
use nalgebra::DMatrix;

/// Correlation from which on an estimate follows a parameter that its bound holds back. If the optimum of
/// that parameter lies `k` of its deviations beyond the bound, the other estimate is off by `k` times the
/// correlation in deviations of its own; at this one, ten are as much as half a 95 % interval.
const MIN_CORRELATION: f64 = 0.2;

/// Whether a coordinate of the unit box is at one of its ends.
pub(super) fn is_at_bound(unit: f64) -> bool {
    !(AT_BOUND..=1.0 - AT_BOUND).contains(&unit)
}

/// The parameter at its bound that an estimate follows most, and their correlation.
pub(super) fn strongest_bound_correlation(
    axis: usize,
    unit: &[f64],
    correlation: impl Fn(usize, usize) -> Option<f64>,
) -> Option<(usize, f64)> {
    let held = (0..unit.len()).filter(|held| *held != axis && is_at_bound(unit[*held]));
    held.filter_map(|held| Some((held, correlation(axis, held)?)))
        .filter(|(_, r)| r.abs() >= MIN_CORRELATION)
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// The parameter at its bound of which a value beyond would gain most, and that gain in cost by the linear
/// model; `None` where none gains more than is worth a step.
pub(super) fn best_excluded_gain(
    unit: &[f64],
    jacobian: &DMatrix<f64>,
    residuals: &[Option<f64>],
) -> Option<(usize, f64)> {
    let gain = |axis: usize| {
        let column = jacobian.column(axis);
        let slope: f64 = residuals.iter().zip(column.iter()).map(|(r, j)| r.unwrap_or(0.0) * j).sum();
        let outward = if unit[axis] < 0.5 { -slope } else { slope };
        (outward < 0.0).then(|| slope * slope / column.norm_squared())
    };
    let held = (0..unit.len()).filter(|axis| is_at_bound(unit[*axis]));
    let gains = held.filter_map(|axis| Some((axis, gain(axis)?)));
    gains.filter(|(_, gain)| *gain > MIN_WORTHWHILE_GAIN).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Calls nothing identified where a bound excludes a better value, and says so.
pub(super) fn withdraw_all(
    intervals: &mut [ParameterResult],
    names: &[String],
    excluding: (usize, f64),
) -> Vec<String> {
    let (held, gain) = excluding;
    let mut barred = Vec::new();
    for (interval, name) in intervals.iter_mut().zip(names) {
        if interval.verdict == ParameterVerdict::Identified {
            interval
                .withdraw_verdict(format!("{} is at its bound, which excludes a better value", names[held]));
            barred.push(name.as_str());
        }
    }
    if barred.is_empty() {
        return Vec::new();
    }
    let (barred, held) = (barred.join(", "), &names[held]);
    vec![format!(
        "nothing is called identified ({barred}): {held} is at its bound, and a value beyond the bound would \
         meet the features better (the cost falls by about {gain:.2}), where the others are different; widen \
         the bounds of {held}"
    )]
}

/// Calls nothing identified that is correlated with a parameter at its bound, and says so.
pub(super) fn withdraw_correlated(
    intervals: &mut [ParameterResult],
    names: &[String],
    unit: &[f64],
    directions: &SingularDirections,
) -> Vec<String> {
    let strongest =
        |axis: usize| strongest_bound_correlation(axis, unit, |a, b| directions.correlation(a, b));
    let mut notes = Vec::new();
    for (axis, interval) in intervals.iter_mut().enumerate() {
        if let Some((held, r)) = strongest(axis).filter(|_| interval.verdict == ParameterVerdict::Identified)
        {
            interval.verdict = ParameterVerdict::NotIdentified;
            let (name, held) = (&names[axis], &names[held]);
            notes.push(format!(
                "{name} is not called identified: {held} is at its bound, and the two estimates are correlated \
                 ({r:.2}), so a better value of {held} beyond the bound would move {name}; widen the bounds of {held}"
            ));
        }
    }
    notes
}

// How much the features count at the best point, and whether that point can be believed.

/// How much each feature counts at the best point.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FeatureWeights {
    /// Scatter of each feature, in its unit, that makes its deviation what the misfit and the model's
    /// roughness there say.
    pub scatter: Vec<f64>,
    /// Factor on all deviations because the features are missed by more than they explain (Birge, Phys. Rev.
    /// 40 (1932) 207); at least 1.
    pub inflation: f64,
    /// The same scatter without that factor.
    pub roughness: Vec<f64>,
}

/// Weighs the features at the ledger's best point. `None` when the model failed there or its neighbours
/// cannot be evaluated.
pub(crate) fn weigh_features(ledger: &mut Ledger) -> Option<FeatureWeights> {
    let best = ledger.best_evaluation().filter(|best| best.failure.is_none())?.clone();
    let around: Vec<Evaluation> = ledger
        .evaluate_points(EvaluationStage::Sensitivity, &difference_points(&best.unit))
        .ok()?
        .into_iter()
        .cloned()
        .collect();
    let targets = ledger.objective().targets();
    let found = feature_scatter(targets, &best, &around.iter().collect::<Vec<_>>());
    let local: Vec<f64> =
        targets.iter().zip(found).map(|(target, found)| target.scatter.max(found.unwrap_or(0.0))).collect();
    let objective = ledger.objective().with_feature_scatter(&local);
    let inflation = birge_factor(&objective, &best);
    let widened = |target: &TargetValue| {
        let total = math::hypot(target.sd, target.scatter);
        (math::powi(inflation * total, 2) - target.sd * target.sd).max(0.0).sqrt()
    };
    Some(FeatureWeights {
        scatter: objective.targets().iter().map(widened).collect(),
        inflation,
        roughness: local,
    })
}

/// Whether a best point can be believed: another local search came to it too, or nothing is left to gain
/// there. Where one search alone was made, it is enough that the features are met within their deviations.
/// `costs` are those of the local searches but for the last polish.
pub(super) fn check_best_point(
    objective: &Objective,
    best: &Evaluation,
    costs: &[f64],
) -> Result<(), String> {
    let (misfit, freedom) = squared_misfit(objective, best);
    let most =
        freedom * math::powi(1.0 - 2.0 / (9.0 * freedom) + CHI2_TAIL_SD * (2.0 / (9.0 * freedom)).sqrt(), 3);
    let again = costs.iter().filter(|cost| **cost <= best.cost + CHI_SQUARED_95).count();
    if freedom < 1.0 || best.cost <= EXACT_COST || again > 1 || (costs.len() < 2 && misfit <= most) {
        return Ok(());
    }
    let met = if misfit <= most {
        "meets the features"
    } else {
        "misses the features by more than their deviations allow"
    };
    Err(format!(
        "the best point {met} (a sum of squares of {misfit:.1} with {freedom:.0} degrees of freedom), but {again} of {} local searches came to it: there may be others as good elsewhere, so nothing is called identified; raise global_evaluations, local_evaluations and starts in [search] and go on with --resume, or look whether the model can show what was measured",
        costs.len()
    ))
}

/// Standard deviations of a normal variable that one in a thousand exceeds (for the cube root of chi-squared;
/// Wilson and Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684).
const CHI2_TAIL_SD: f64 = 3.09;

/// Sum of the squares of the residuals and its degrees of freedom.
fn squared_misfit(objective: &Objective, best: &Evaluation) -> (f64, f64) {
    let squares: Vec<f64> = residuals(objective, best).into_iter().flatten().map(|r| r * r).collect();
    let unknowns = best.unit.len() + objective.count_camera_unknowns();
    (squares.iter().sum(), squares.len() as f64 - unknowns as f64)
}

/// Factor on the deviations of which the misfit would be one; at least 1.
fn birge_factor(objective: &Objective, best: &Evaluation) -> f64 {
    let (misfit, freedom) = squared_misfit(objective, best);
    if freedom > 0.0 { (misfit / freedom).sqrt().max(1.0) } else { 1.0 }
}

// The verdicts that the numbers of a stored result deserve.

/// One a parameter, in job order, by the same rules as in a fit; a parameter that the result does not have is
/// not identified.
pub(in crate::fit) fn stored_verdicts(job: &Job, result: &FitResult) -> Vec<ParameterVerdict> {
    let names = job.parameter_names();
    let found = |axis: usize| result.parameters.get(&names[axis]);
    // the linear model gives a correlation to every parameter that it determines, with itself too
    let correlation = |a: usize, b: usize| result.correlations.get(&names[a])?.get(&names[b]).copied();
    let unit: Vec<f64> = (job.parameters.iter().enumerate())
        .map(|(axis, free)| found(axis).map_or(0.5, |p| free.bounds.to_unit(p.estimate)))
        .collect();
    let of = |axis: usize| {
        let Some(p) = found(axis) else { return ParameterVerdict::NotIdentified };
        match interval_verdict(unit[axis], p.lower_95, p.upper_95, correlation(axis, axis).is_some()) {
            // a search that had not come to its end identifies nothing
            _ if matches!(result.status, FitStatus::BudgetExhausted | FitStatus::Failed) => {
                ParameterVerdict::NotIdentified
            }
            ParameterVerdict::Identified if !p.reasons.is_empty() => ParameterVerdict::NotIdentified,
            ParameterVerdict::Identified
                if strongest_bound_correlation(axis, &unit, correlation).is_some() =>
            {
                ParameterVerdict::NotIdentified
            }
            other => other,
        }
    };
    (0..names.len()).map(of).collect()
}
