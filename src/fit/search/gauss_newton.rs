//! Damped Gauss-Newton descent. One precise frequency and several imprecise features form a long narrow
//! valley of the cost, in which the Nelder-Mead simplex is slow.
//!
//! Each step tries several Levenberg dampings at once. The Jacobian comes from finite differences, is updated
//! after every step by Broyden's rule, and is computed anew when a step does not lower the cost enough.
//! argmin's Gauss-Newton has neither damping nor bounds and stops at the first failure.

use super::costs::StageCosts;
use super::termination::{EXACT_COST, MIN_WORTHWHILE_GAIN};
use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::{
    FeatureSlopes, broyden_update, damped_step, difference_points, jacobian, residuals, step_in_box,
};
use nalgebra::DMatrix;

/// Dampings tried at every step. The first acts as a prior as wide as the box and is negligible in any
/// informative direction; with the largest, the step is nearly one of gradient descent.
const DAMPINGS: [f64; 4] = [1.0, 3e1, 1e3, 3e4];
/// Maximum number of steps from one point. About twenty steps are needed in a curved valley that is a hundred
/// times longer than wide.
const MAX_STEPS: usize = 60;

/// Descends from `start`. Returns the last point and, if the ledger stopped, the reason.
pub(super) fn descend_gauss_newton(ledger: &mut Ledger, start: &[f64]) -> (Vec<f64>, Option<StopReason>) {
    let mut costs = StageCosts::new(ledger, EvaluationStage::Local);
    let (unit, cost) = (start.to_vec(), costs.evaluate_point(start.to_vec()));
    let mut steps = GaussNewton { unit, cost, model: None, fresh: false, stalled: false };
    for _ in 0..MAX_STEPS {
        if costs.stop.is_some() || steps.stalled || steps.cost <= EXACT_COST {
            return (steps.unit, costs.stop);
        }
        steps.take_step(&mut costs);
    }
    (steps.unit, None)
}

/// A descent in the unit box. It ends when a step with a Jacobian from finite differences lowers the cost by
/// less than [`MIN_WORTHWHILE_GAIN`].
struct GaussNewton {
    unit: Vec<f64>,
    cost: f64,
    /// Jacobian for the next step, updated by Broyden's rule; `None` if it must be computed from finite
    /// differences.
    model: Option<DMatrix<f64>>,
    /// Whether the Jacobian was computed from finite differences at the current point rather than updated by
    /// Broyden's rule.
    fresh: bool,
    stalled: bool,
}

impl GaussNewton {
    fn take_step(&mut self, costs: &mut StageCosts) {
        let before = residuals_at(costs, &self.unit);
        let mut model = self.model.take().unwrap_or_else(|| self.measure_jacobian(costs));
        if self.stalled || before.len() != model.nrows() {
            self.stalled = true;
            return;
        }
        let steps = DAMPINGS.iter().filter_map(|damping| damped_step(&model, &before, *damping, None));
        let trials: Vec<Vec<f64>> = steps.map(|step| step_in_box(&self.unit, &step)).collect();
        let tried = costs.evaluate_points(&trials);
        let best = trials.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1));
        let gained = best.filter(|(_, found)| *found < self.cost);
        let gain = gained.as_ref().map_or(0.0, |(_, found)| self.cost - found);
        if gain <= MIN_WORTHWHILE_GAIN {
            (self.stalled, self.fresh) = (self.fresh, false);
        }
        let Some((point, found)) = gained else { return };
        if gain > MIN_WORTHWHILE_GAIN {
            let taken: Vec<f64> = point.iter().zip(&self.unit).map(|(to, from)| to - from).collect();
            broyden_update(&mut model, &before, &residuals_at(costs, &point), &taken);
            (self.model, self.fresh) = (Some(model), false);
        }
        (self.unit, self.cost) = (point, found);
    }

    /// The Jacobian from finite differences; if these cannot be evaluated, the descent is marked as stalled.
    fn measure_jacobian(&mut self, costs: &mut StageCosts) -> DMatrix<f64> {
        costs.evaluate_points(&difference_points(&self.unit));
        let ledger = &*costs.ledger;
        let found = || {
            let points = difference_points(&self.unit);
            let around: Option<Vec<&Evaluation>> =
                points.iter().map(|point| ledger.find_evaluation(point)).collect();
            let (centre, objective) = (ledger.find_evaluation(&self.unit)?, ledger.objective());
            let slopes = FeatureSlopes::from_differences(objective.targets(), centre, &around?);
            Some(jacobian(objective, centre, &slopes))
        };
        let found = found();
        (self.fresh, self.stalled) = (true, found.is_none());
        found.unwrap_or_else(|| DMatrix::zeros(0, self.unit.len()))
    }
}

/// Residuals at a point; empty if the point cannot be evaluated.
fn residuals_at(costs: &mut StageCosts, unit: &[f64]) -> Vec<Option<f64>> {
    costs.evaluate_points(&[unit.to_vec()]);
    let ledger = &*costs.ledger;
    ledger.find_evaluation(unit).map_or_else(Vec::new, |found| residuals(ledger.objective(), found))
}
