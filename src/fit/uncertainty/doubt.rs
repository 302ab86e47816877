//! How much the features count at the best point, and whether that point can be believed.

use crate::fit::evaluation::Evaluation;
use crate::fit::information::CHI_SQUARED_95;
use crate::fit::ledger::Ledger;
use crate::fit::linear::{difference_points, feature_scatter, residuals};
use crate::fit::objective::Objective;
use crate::fit::search::EXACT_COST;
use crate::fit::stage::EvaluationStage;
use crate::fit::target::TargetValue;
use crate::math;

/// How much each feature counts at the best point.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureWeights {
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
#[must_use]
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
