//! Nelder-Mead simplices, with the solver of argmin.
//!
//! argmin's loop can neither stop when the ledger stops nor count steps that do not lower the cost, so the
//! loop is written here. The solver has no bounds, so it works on the real line ([`line_to_unit`]). It panics
//! if one of its first costs is an error, so costs are never errors.

use super::costs::StageCosts;
use super::stagnation::StagnationCounter;
use super::termination::{EXACT_COST, SIMPLEX_COST_SPREAD, SearchTermination};
use crate::fit::bounds::{line_to_unit, unit_to_line};
use crate::fit::evaluation::EvaluationStage;
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;
use argmin::core::{CostFunction, Error, IterState, Problem, Solver, State};
use argmin::solver::neldermead::NelderMead;
use std::cell::RefCell;

/// Number of steps per vertex that do not lower the cost, after which a simplex ends.
const STAGNANT_STEPS: usize = 20;

type SimplexState = IterState<Vec<f64>, (), (), (), (), f64>;

/// Costs as a function of unbounded coordinates on the real line.
struct UnboundedCost<'l, 'a>(RefCell<StageCosts<'l, 'a>>);

impl CostFunction for UnboundedCost<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.0.borrow_mut().evaluate_point(place.iter().map(|z| line_to_unit(*z)).collect()))
    }
}

/// Runs one simplex from `start` with edges of length `edge` in the unit box, until it has shrunk or no
/// longer lowers the cost.
pub(super) fn run_simplex(ledger: &mut Ledger, start: &[f64], edge: f64) -> SearchTermination {
    let vertices = initial_simplex(start, edge);
    let steps = ledger.remaining_evaluations().saturating_mul(2).saturating_add(vertices.len());
    if ledger.remaining_evaluations() < vertices.len() {
        return SearchTermination::Stopped(StopReason::Budget);
    }
    let stop = step_simplex(StageCosts::new(ledger, EvaluationStage::Local), vertices, steps);
    stop.map_or(SearchTermination::Converged, SearchTermination::Stopped)
}

/// Steps a simplex until it ends. Returns the reason if the ledger stopped.
fn step_simplex(costs: StageCosts, vertices: Vec<Vec<f64>>, steps: usize) -> Option<StopReason> {
    let mut patience = StagnationCounter::new(STAGNANT_STEPS * vertices.len(), 0.0);
    let mut solver = NelderMead::new(vertices).with_sd_tolerance(SIMPLEX_COST_SPREAD).ok()?;
    let mut problem = Problem::new(UnboundedCost(RefCell::new(costs)));
    let (mut state, _) = solver.init(&mut problem, SimplexState::new()).ok()?;
    for _ in 0..steps {
        let stop = problem.problem.as_ref().and_then(|costs| costs.0.borrow().stop.clone());
        if stop.is_some() {
            return stop;
        }
        let cost = state.get_cost();
        if cost <= EXACT_COST || has_shrunk(&mut solver, &state) || patience.is_stagnant(cost) {
            return None;
        }
        (state, _) = solver.next_iter(&mut problem, state).ok()?;
    }
    None
}

fn has_shrunk(solver: &mut NelderMead<Vec<f64>, f64>, state: &SimplexState) -> bool {
    <NelderMead<_, _> as Solver<UnboundedCost, SimplexState>>::terminate(solver, state).terminated()
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
