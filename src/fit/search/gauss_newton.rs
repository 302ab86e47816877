//! Damped Gauss-Newton steps as a solver: simplices crawl along a valley that is much longer than wide, and
//! such a valley is what one precise frequency beside imprecise features makes.
//!
//! Levenberg's dampings are tried side by side; the Jacobian is measured by differences, corrected after
//! every step by Broyden's rule and measured again when a step gains nothing. argmin's own Gauss-Newton has
//! no damping, no bounds and stops at the first failure.

use super::super::linear::{Slopes, correct, jacobian, moved, points, step};
use super::super::objective::Evaluation;
use super::Costs;
use argmin::core::{
    CostFunction, Error, IterState, KV, Operator, Problem, Solver, TerminationReason, TerminationStatus,
};
use nalgebra::DMatrix;

/// Dampings tried at every step. The first is a prior of one length of the box, negligible for any
/// informative direction; the others turn towards plain descent.
const DAMPINGS: [f64; 4] = [1.0, 3e1, 1e3, 3e4];

/// State without derivatives: the solver keeps its own.
pub(super) type Plain = IterState<Vec<f64>, (), (), (), (), f64>;

/// Steps in the unit box until one from a measured Jacobian gains less than `worth`.
pub(super) struct GaussNewton {
    worth: f64,
    model: Option<DMatrix<f64>>,
    fresh: bool,
    stalled: bool,
}

impl GaussNewton {
    pub(super) fn new(worth: f64) -> Self {
        Self { worth, model: None, fresh: false, stalled: false }
    }

    fn measure(&mut self, costs: &Costs, unit: &[f64]) -> Result<DMatrix<f64>, Error> {
        costs.bulk_cost(&points(unit))?;
        let found = costs.with_ledger(|ledger| {
            let find = |point: &[f64]| ledger.find(point).cloned();
            let around: Option<Vec<Evaluation>> = points(unit).iter().map(|point| find(point)).collect();
            let (centre, around) = (find(unit)?, around?);
            let objective = ledger.objective();
            let slopes = Slopes::of(objective.targets(), &centre, &around.iter().collect::<Vec<_>>());
            Some(jacobian(objective, &centre, &slopes))
        });
        self.fresh = true;
        self.stalled = found.is_none();
        Ok(found.unwrap_or_else(|| DMatrix::zeros(0, unit.len())))
    }
}

impl Solver<Costs<'_, '_>, Plain> for GaussNewton {
    fn name(&self) -> &str {
        "damped Gauss-Newton"
    }

    fn init(
        &mut self,
        problem: &mut Problem<Costs<'_, '_>>,
        mut state: Plain,
    ) -> Result<(Plain, Option<KV>), Error> {
        let Some(unit) = state.take_param() else { return Ok((state, None)) };
        let cost = problem.problem("cost_count", |costs| costs.cost(&unit))?;
        Ok((state.param(unit).cost(cost), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<Costs<'_, '_>>,
        mut state: Plain,
    ) -> Result<(Plain, Option<KV>), Error> {
        let (Some(unit), cost) = (state.take_param(), state.get_cost()) else { return Ok((state, None)) };
        let Some(costs) = problem.problem.as_ref() else { return Ok((state.param(unit).cost(cost), None)) };
        let before = costs.apply(&unit)?;
        let mut model = match self.model.take() {
            Some(model) => model,
            None => self.measure(costs, &unit)?,
        };
        if self.stalled || before.len() != model.nrows() {
            self.stalled = true;
            return Ok((state.param(unit).cost(cost), None));
        }
        let trials: Vec<Vec<f64>> = DAMPINGS
            .iter()
            .filter_map(|damping| step(&model, &before, *damping, None))
            .map(|step| moved(&unit, &step))
            .collect();
        let tried = costs.bulk_cost(&trials)?;
        let best = trials.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1));
        let gained = best.filter(|(_, found)| *found < cost);
        let gain = gained.as_ref().map_or(0.0, |(_, found)| cost - found);
        if gain <= self.worth {
            (self.stalled, self.fresh) = (self.fresh, false);
        }
        let Some((point, found)) = gained else { return Ok((state.param(unit).cost(cost), None)) };
        if gain > self.worth {
            let taken: Vec<f64> = point.iter().zip(&unit).map(|(to, from)| to - from).collect();
            correct(&mut model, &before, &costs.apply(&point)?, &taken);
            (self.model, self.fresh) = (Some(model), false);
        }
        Ok((state.param(point).cost(found), None))
    }

    fn terminate(&mut self, _: &Plain) -> TerminationStatus {
        if self.stalled {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}
