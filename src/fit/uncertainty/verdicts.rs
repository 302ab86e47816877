//! Verdicts on parameters: effect of parameters at their bounds, weights of the features, and check of the
//! best point.

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
use crate::fit::target_value::TargetValue;
use nalgebra::DMatrix;
use portable_math as math;

/// A parameter at its bound makes the estimate of another parameter unreliable if the absolute value of their
/// correlation is at least this value. If the optimum is `k` standard deviations outside the bound, the other
/// estimate shifts by `k` times the correlation, in its own standard deviations. At this correlation, `k` =
/// 10 gives a shift of half the width of the 95 % interval.
const MIN_CORRELATION: f64 = 0.2;

/// Whether a coordinate of the unit box is at an end of the box.
pub(super) fn is_at_bound(unit: f64) -> bool {
    !(AT_BOUND..=1.0 - AT_BOUND).contains(&unit)
}

/// Of the parameters at a bound, the index of the one that is most strongly correlated with parameter `axis`,
/// and this correlation; `None` if no correlation reaches [`MIN_CORRELATION`].
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

/// Of the parameters at a bound, the index of the one whose optimum outside the bound would lower the cost
/// most, and the decrease of the cost that the linear model predicts; `None` if no decrease exceeds
/// [`MIN_WORTHWHILE_GAIN`].
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

/// Changes all identified parameters to not identified, because the bound of parameter `held` excludes a
/// better value; returns a note if any verdict changed.
pub(super) fn withdraw_all(
    intervals: &mut [ParameterResult],
    names: &[String],
    (held, gain): (usize, f64),
) -> Option<String> {
    let (held, mut barred) = (&names[held], Vec::new());
    for (interval, name) in intervals.iter_mut().zip(names) {
        if interval.verdict == ParameterVerdict::Identified {
            interval.withdraw_verdict(format!("{held} is at its bound, which excludes a better value"));
            barred.push(name.as_str());
        }
    }
    let names = barred.join(", ");
    (!barred.is_empty()).then(|| format!(
        "nothing is called identified ({names}): {held} is at its bound, and a value beyond the bound would \
         meet the features better (the cost falls by about {gain:.2}), where the others are different; widen \
         the bounds of {held}"
    ))
}

/// Changes identified parameters that are correlated with a parameter at a bound to not identified; returns
/// one note for each changed verdict.
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

/// Weights of the features at the best point, expressed as additional scatter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FeatureWeights {
    /// Scatter of each feature, in the unit of the feature, that accounts for the misfit and for the
    /// roughness of the model.
    pub scatter: Vec<f64>,
    /// Factor on all standard deviations that accounts for the misfit (Birge, Phys. Rev. 40 (1932) 207); at
    /// least 1.
    pub inflation: f64,
    /// Scatter of each feature, in the unit of the feature, that accounts only for the roughness of the
    /// model.
    pub roughness: Vec<f64>,
}

/// Determines the weights of the features at the best point of the ledger; `None` if the model failed at this
/// point or its neighbours cannot be evaluated.
pub(crate) fn weigh_features(ledger: &mut Ledger) -> Option<FeatureWeights> {
    let best = ledger.best_evaluation().filter(|best| best.failure.is_none())?.clone();
    let targets = ledger.objective().targets();
    let around = ledger.evaluate_points(EvaluationStage::Sensitivity, &difference_points(&best.unit)).ok()?;
    let found = feature_scatter(targets, &best, &around);
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

/// Checks the best point: at least two local searches must reach its cost, unless this cost is practically
/// zero. After a single local search, it is sufficient that the residuals are as small as their standard
/// deviations allow. `costs` are the costs at which the local searches end, without the final polish.
///
/// # Errors
/// The note that the best point is not confirmed.
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

/// The 99.9 % quantile of the standard normal distribution. The 99.9 % quantile of chi-squared is computed
/// from it, because the cube root of chi-squared is nearly normal (Wilson and Hilferty, Proc. Natl. Acad.
/// Sci. 17 (1931) 684).
const CHI2_TAIL_SD: f64 = 3.09;

/// Sum of the squared residuals, and the number of degrees of freedom of this sum.
fn squared_misfit(objective: &Objective, best: &Evaluation) -> (f64, f64) {
    let squares: Vec<f64> = residuals(objective, best).into_iter().flatten().map(|r| r * r).collect();
    let unknowns = best.unit.len() + objective.count_camera_unknowns();
    (squares.iter().sum(), squares.len() as f64 - unknowns as f64)
}

/// Factor on the standard deviations that makes the sum of squared residuals per degree of freedom 1; at
/// least 1.
fn birge_factor(objective: &Objective, best: &Evaluation) -> f64 {
    let (misfit, freedom) = squared_misfit(objective, best);
    if freedom > 0.0 { (misfit / freedom).sqrt().max(1.0) } else { 1.0 }
}

/// Verdicts that follow from the numbers of a stored result of a fit of features, one per parameter in job
/// order. A parameter that is missing from the result is not identified.
pub(in crate::fit) fn stored_verdicts(job: &Job, result: &FitResult) -> Vec<ParameterVerdict> {
    let names = job.parameter_names();
    let found = |axis: usize| result.parameters.get(&names[axis]);
    // only a parameter that the linear model determines has a correlation with itself
    let correlation = |a: usize, b: usize| result.correlations.get(&names[a])?.get(&names[b]).copied();
    let unit: Vec<f64> = (job.parameters.iter().enumerate())
        .map(|(axis, free)| found(axis).map_or(0.5, |p| free.bounds.unit_coordinate(p.estimate)))
        .collect();
    let of = |axis: usize| {
        let Some(p) = found(axis) else { return ParameterVerdict::NotIdentified };
        match interval_verdict(unit[axis], p.lower_95, p.upper_95, correlation(axis, axis).is_some()) {
            // an unfinished search identifies no parameter
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
