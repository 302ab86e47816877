//! Nelder-Mead simplices, with the solver of argmin. It has no bounds, so it works on the real line
//! ([`line_to_unit`]).

use super::costs::{LedgerCosts, run_solver};
use super::stagnation::StagnationCounter;
use super::termination::{EXACT_COST, SIMPLEX_COST_SPREAD, SearchTermination};
use crate::fit::bounds::{line_to_unit, unit_to_line};
use crate::fit::evaluation::EvaluationStage;
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;
use argmin::core::{Error, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};
use argmin::solver::neldermead::NelderMead;

/// Number of steps per vertex that do not lower the cost, after which a simplex ends.
const STAGNANT_STEPS: usize = 20;

type SimplexState = IterState<Vec<f64>, (), (), (), (), f64>;

/// A simplex of argmin that also ends when it no longer lowers the cost.
struct Simplex {
    solver: NelderMead<Vec<f64>, f64>,
    patience: StagnationCounter,
}

impl<'l, 'a> Solver<LedgerCosts<'l, 'a>, SimplexState> for Simplex {
    fn name(&self) -> &str {
        "Nelder-Mead"
    }

    fn init(
        &mut self,
        problem: &mut Problem<LedgerCosts<'l, 'a>>,
        state: SimplexState,
    ) -> Result<(SimplexState, Option<KV>), Error> {
        self.solver.init(problem, state)
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<LedgerCosts<'l, 'a>>,
        state: SimplexState,
    ) -> Result<(SimplexState, Option<KV>), Error> {
        self.solver.next_iter(problem, state)
    }

    fn terminate(&mut self, state: &SimplexState) -> TerminationStatus {
        let shrunk =
            <NelderMead<_, _> as Solver<LedgerCosts, SimplexState>>::terminate(&mut self.solver, state);
        match shrunk.terminated() || self.patience.is_stagnant(state.get_cost()) {
            true => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            false => TerminationStatus::NotTerminated,
        }
    }
}

/// Runs one simplex from `start` with edges of length `edge` in the unit box, until it has shrunk or no
/// longer lowers the cost.
pub(super) fn run_simplex(ledger: &mut Ledger, start: &[f64], edge: f64) -> SearchTermination {
    let vertices = initial_simplex(start, edge);
    if ledger.remaining_evaluations() < vertices.len() {
        return SearchTermination::Stopped(StopReason::Budget);
    }
    let to_unit = |place: &[f64]| place.iter().map(|z| line_to_unit(*z)).collect::<Vec<f64>>();
    let points: Vec<Vec<f64>> = vertices.iter().map(|vertex| to_unit(vertex)).collect();
    // argmin panics if one of the first costs is an error
    let first = ledger.evaluate_points(EvaluationStage::Local, &points).err();
    if let Some(stop) = first.or_else(|| ledger.stop_reason().cloned()) {
        return SearchTermination::Stopped(stop);
    }
    let steps = ledger.remaining_evaluations().saturating_mul(2).saturating_add(vertices.len()) as u64;
    let patience = StagnationCounter::new(STAGNANT_STEPS * vertices.len(), 0.0);
    let Ok(solver) = NelderMead::new(vertices).with_sd_tolerance(SIMPLEX_COST_SPREAD) else {
        return SearchTermination::Converged;
    };
    let configure = |state: SimplexState| state.max_iters(steps).target_cost(EXACT_COST);
    let solver = Simplex { solver, patience };
    let stop = run_solver(ledger, EvaluationStage::Local, &to_unit, solver, configure);
    stop.map_or(SearchTermination::Converged, SearchTermination::Stopped)
}

/// Vertices of a simplex, mapped from the unit box to the real line: `start`, and for each coordinate a point
/// that is `edge` further towards the middle of the box.
fn initial_simplex(start: &[f64], edge: f64) -> Vec<Vec<f64>> {
    let mut vertices = vec![start.to_vec(); start.len() + 1];
    for (axis, vertex) in vertices.iter_mut().skip(1).enumerate() {
        vertex[axis] += if vertex[axis] > 0.5 { -edge } else { edge };
    }
    vertices.into_iter().map(|vertex| vertex.into_iter().map(unit_to_line).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_simplex_stays_in_the_box_and_is_not_flat() {
        let vertices = initial_simplex(&[0.0, 1.0], 0.05);
        let units: Vec<Vec<f64>> =
            vertices.iter().map(|v| v.iter().map(|z| line_to_unit(*z)).collect()).collect();
        let expected = [[0.0, 1.0], [0.05, 1.0], [0.0, 0.95]];
        assert_eq!(units.len(), 3);
        for (unit, expected) in units.iter().flatten().zip(expected.iter().flatten()) {
            assert!((unit - expected).abs() < 1e-15);
        }
    }
}
