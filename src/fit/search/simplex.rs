//! Nelder-Mead simplices: argmin's, and the only place where this program names argmin.
//!
//! argmin's own loop is not used: it can neither stop where the ledger does nor count steps without a gain.
//! Its solver is stepped from here. It has no bounds, so it works on the real line ([`line_to_unit`]), and
//! it panics on an error of its first costs, so costs are never errors.

use super::StageCosts;
use super::stagnation::StagnationCounter;
use super::termination::SearchTermination;
use super::termination::{EXACT_COST, SIMPLEX_COST_SPREAD};
use crate::fit::bounds::{line_to_unit, unit_to_line};
use crate::fit::evaluation::EvaluationStage;
use crate::fit::ledger::{Ledger, StopReason};
use argmin::core::{CostFunction, Error, IterState, Problem, Solver, State};
use argmin::solver::neldermead::NelderMead;
use std::cell::RefCell;

/// Steps of one simplex without a lower cost after which it is left, per vertex.
const STAGNANT_STEPS: usize = 20;

type SimplexState = IterState<Vec<f64>, (), (), (), (), f64>;

/// Costs as a function of places on the real line.
struct UnboundedCost<'l, 'a>(RefCell<StageCosts<'l, 'a>>);

impl CostFunction for UnboundedCost<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.0.borrow_mut().evaluate_point(place.iter().map(|z| line_to_unit(*z)).collect()))
    }
}

/// One simplex from `start` with edges of this length in the unit box, until it has shrunk or gains nothing.
pub(super) fn run_simplex(ledger: &mut Ledger, start: &[f64], edge: f64) -> SearchTermination {
    let vertices = initial_simplex(start, edge);
    let steps = ledger.remaining_evaluations().saturating_mul(2).saturating_add(vertices.len());
    if ledger.remaining_evaluations() < vertices.len() {
        return SearchTermination::Stopped(StopReason::Budget);
    }
    let mut patience = StagnationCounter::new(STAGNANT_STEPS * vertices.len(), 0.0);
    let Ok(mut solver) = NelderMead::new(vertices).with_sd_tolerance(SIMPLEX_COST_SPREAD) else {
        return SearchTermination::Converged;
    };
    let mut problem =
        Problem::new(UnboundedCost(RefCell::new(StageCosts::new(ledger, EvaluationStage::Local))));
    let Ok((mut state, _)) = solver.init(&mut problem, SimplexState::new()) else {
        return SearchTermination::Converged;
    };
    for _ in 0..steps {
        if let Some(stop) = problem.problem.as_ref().and_then(|costs| costs.0.borrow().stop_reason()) {
            return SearchTermination::Stopped(stop);
        }
        if state.get_cost() <= EXACT_COST
            || has_shrunk(&mut solver, &state)
            || patience.is_stagnant(state.get_cost())
        {
            return SearchTermination::Converged;
        }
        match solver.next_iter(&mut problem, state) {
            Ok((next, _)) => state = next,
            Err(_) => return SearchTermination::Converged,
        }
    }
    SearchTermination::Converged
}

fn has_shrunk(solver: &mut NelderMead<Vec<f64>, f64>, state: &SimplexState) -> bool {
    <NelderMead<_, _> as Solver<UnboundedCost, SimplexState>>::terminate(solver, state).terminated()
}

/// `start` and one step of `edge` inwards along each coordinate of the box, as places on the real line.
fn initial_simplex(start: &[f64], edge: f64) -> Vec<Vec<f64>> {
    let moved = (0..start.len()).map(|axis| {
        let step =
            |(at, u): (usize, &f64)| if at == axis { u + if *u > 0.5 { -edge } else { edge } } else { *u };
        start.iter().enumerate().map(step).collect::<Vec<f64>>()
    });
    std::iter::once(start.to_vec())
        .chain(moved)
        .map(|vertex| vertex.into_iter().map(unit_to_line).collect())
        .collect()
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
