//! Damped Gauss-Newton descent (Levenberg, Quart. Appl. Math. 2 (1944) 164) as a solver of argmin. One
//! precise frequency and several imprecise features form a long narrow valley of the cost, in which the
//! Nelder-Mead simplex is slow.
//!
//! Each step tries several dampings at once. The Jacobian comes from finite differences, is updated after
//! every step by Broyden's rule, and is computed anew when a step does not lower the cost enough. The
//! Gauss-Newton method of argmin has neither damping nor bounds.

use super::costs::{LedgerCosts, run_solver};
use super::termination::{EXACT_COST, MIN_WORTHWHILE_GAIN};
use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;
use crate::fit::linear_model::{
    FeatureSlopes, broyden_update, damped_step, difference_points, jacobian, residuals, step_in_box,
};
use argmin::core::{CostFunction, Error, IterState, KV, Problem, Solver, State, TerminationReason};
use nalgebra::DMatrix;

/// Dampings tried at every step. The first acts as a prior as wide as the box and is negligible in any
/// informative direction; with the largest, the step is nearly one of gradient descent.
const DAMPINGS: [f64; 4] = [1.0, 3e1, 1e3, 3e4];
/// Maximum number of steps from one point. About twenty steps are needed in a curved valley that is a hundred
/// times longer than wide.
const MAX_STEPS: u64 = 60;

/// Descends from `start`. Returns the evaluation at the last point, if there is one, and the reason if the
/// ledger stopped the descent.
pub(super) fn descend_gauss_newton(
    ledger: &mut Ledger,
    start: &[f64],
) -> (Option<Evaluation>, Option<StopReason>) {
    let mut reached = start.to_vec();
    let solver = GaussNewton { reached: &mut reached, model: None, fresh: false };
    let configure =
        |state: DescentState| state.param(start.to_vec()).max_iters(MAX_STEPS).target_cost(EXACT_COST);
    let stop = run_solver(ledger, EvaluationStage::Local, &<[f64]>::to_vec, solver, configure);
    (ledger.find_evaluation(&reached).cloned(), stop)
}

type DescentState = IterState<Vec<f64>, (), (), (), (), f64>;

/// A descent in the unit box. It ends when a step with a Jacobian from finite differences lowers the cost by
/// less than [`MIN_WORTHWHILE_GAIN`].
struct GaussNewton<'r> {
    /// The last point. The caller reads it even if the ledger stops the descent.
    reached: &'r mut Vec<f64>,
    /// Jacobian for the next step, updated by Broyden's rule; `None` if it must be computed from finite
    /// differences.
    model: Option<DMatrix<f64>>,
    /// Whether the Jacobian was computed from finite differences at the current point rather than updated by
    /// Broyden's rule.
    fresh: bool,
}

impl<'l, 'a> Solver<LedgerCosts<'l, 'a>, DescentState> for GaussNewton<'_> {
    fn name(&self) -> &str {
        "Gauss-Newton"
    }

    fn init(
        &mut self,
        problem: &mut Problem<LedgerCosts<'l, 'a>>,
        state: DescentState,
    ) -> Result<(DescentState, Option<KV>), Error> {
        let cost = problem.cost(&*self.reached)?;
        Ok((state.cost(cost), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<LedgerCosts<'l, 'a>>,
        state: DescentState,
    ) -> Result<(DescentState, Option<KV>), Error> {
        let stalled =
            |state: DescentState| Ok((state.terminate_with(TerminationReason::SolverConverged), None));
        let (unit, cost) = (self.reached.clone(), state.get_cost());
        let Some(costs) = &problem.problem else { return stalled(state) };
        let before = residuals_at(costs, &unit);
        let model = match self.model.take() {
            Some(model) => Some(model),
            None => {
                self.fresh = true;
                measure_jacobian(costs, &unit)?
            }
        };
        let Some(mut model) = model.filter(|model| model.nrows() == before.len()) else {
            return stalled(state);
        };
        let steps = DAMPINGS.iter().filter_map(|damping| damped_step(&model, &before, *damping, None));
        let trials: Vec<Vec<f64>> = steps.map(|step| step_in_box(&unit, &step)).collect();
        let tried = costs.bulk_cost(&trials)?;
        let best = trials.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((point, found)) = best.filter(|(_, found)| *found < cost) else {
            if std::mem::take(&mut self.fresh) {
                return stalled(state);
            } else {
                return Ok((state, None));
            };
        };
        self.reached.clone_from(&point);
        let state = state.param(point.clone()).cost(found);
        if cost - found > MIN_WORTHWHILE_GAIN {
            let taken: Vec<f64> = point.iter().zip(&unit).map(|(to, from)| to - from).collect();
            broyden_update(&mut model, &before, &residuals_at(costs, &point), &taken);
            (self.model, self.fresh) = (Some(model), false);
        } else if std::mem::take(&mut self.fresh) {
            return stalled(state);
        }
        Ok((state, None))
    }
}

/// The Jacobian from finite differences; `None` if these cannot be evaluated.
fn measure_jacobian(costs: &LedgerCosts, unit: &[f64]) -> Result<Option<DMatrix<f64>>, Error> {
    let points = difference_points(unit);
    costs.bulk_cost(&points)?;
    let ledger = costs.ledger.borrow();
    let find = || {
        let around: Option<Vec<&Evaluation>> =
            points.iter().map(|point| ledger.find_evaluation(point)).collect();
        let (centre, objective) = (ledger.find_evaluation(unit)?, ledger.objective());
        let slopes = FeatureSlopes::from_differences(objective.targets(), centre, &around?);
        Some(jacobian(objective, centre, &slopes))
    };
    Ok(find())
}

/// Residuals at a point; empty if it was not evaluated.
fn residuals_at(costs: &LedgerCosts, unit: &[f64]) -> Vec<Option<f64>> {
    let ledger = costs.ledger.borrow();
    ledger.find_evaluation(unit).map_or_else(Vec::new, |found| residuals(ledger.objective(), found))
}
