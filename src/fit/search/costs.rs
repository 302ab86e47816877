//! The cost of a fit of features as a problem of argmin.
//!
//! argmin's executor ends a run at the first error, so a stop of the ledger is an error of the cost function.
//! The observers and checkpoints of argmin must own all that they use, and it has its own handler of Ctrl-C.
//! So they are not used: the journal of the fit counts, stores and reports the evaluations.

use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;
use argmin::core::{CostFunction, Error, Executor, Solver, State, SyncAlias};
use std::borrow::Borrow;
use std::cell::RefCell;

/// Part of the unit box in which one coordinate is limited to a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slab {
    /// Index of the parameter whose coordinate is limited.
    pub axis: usize,
    pub lower: f64,
    pub upper: f64,
}

impl Slab {
    /// Whether the slab contains a point.
    pub(crate) fn contains(&self, unit: &[f64]) -> bool {
        unit.get(self.axis).is_some_and(|u| (self.lower..=self.upper).contains(u))
    }

    /// The slab, made narrower by `margin` at each end that is inside the unit box.
    pub(crate) fn shrink_by(self, margin: f64) -> Self {
        let lower = if self.lower > 0.0 { self.lower + margin } else { self.lower };
        let upper = if self.upper < 1.0 { self.upper - margin } else { self.upper };
        Self { lower, upper, ..self }
    }

    /// Maps a point of the unit box linearly into the slab.
    pub(super) fn map_into(&self, mut unit: Vec<f64>) -> Vec<f64> {
        if let Some(u) = unit.get_mut(self.axis) {
            *u = self.lower + (self.upper - self.lower) * *u;
        }
        unit
    }
}

/// Map from the coordinates of a solver to the unit box.
pub(super) type ToUnit<'f> = dyn Fn(&[f64]) -> Vec<f64> + 'f;

/// Computes the costs of points for a solver.
pub(super) struct LedgerCosts<'l, 'a> {
    pub(super) ledger: RefCell<&'l mut Ledger<'a>>,
    stage: EvaluationStage,
    to_unit: &'l ToUnit<'l>,
}

impl CostFunction for LedgerCosts<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.bulk_cost(&[point])?[0])
    }

    /// One cost per point, in order; the ledger evaluates them in parallel.
    fn bulk_cost<P: Borrow<Vec<f64>> + SyncAlias>(&self, points: &[P]) -> Result<Vec<f64>, Error> {
        let points: Vec<Vec<f64>> = points.iter().map(|point| (self.to_unit)(point.borrow())).collect();
        let global = self.stage == EvaluationStage::Global;
        let cost = |found: &Evaluation| if global { found.global_cost } else { found.cost };
        let mut ledger = self.ledger.borrow_mut();
        Ok(ledger.evaluate_points(self.stage, &points)?.into_iter().map(cost).collect())
    }
}

/// Runs a solver whose points `to_unit` maps to the unit box. Returns the reason if the ledger stopped it.
pub(super) fn run_solver<'l, 'a, S, I>(
    ledger: &'l mut Ledger<'a>,
    stage: EvaluationStage,
    to_unit: &'l ToUnit<'l>,
    solver: S,
    configure: impl FnOnce(I) -> I,
) -> Option<StopReason>
where
    S: Solver<LedgerCosts<'l, 'a>, I>,
    I: State,
{
    let costs = LedgerCosts { ledger: RefCell::new(ledger), stage, to_unit };
    let run = Executor::new(costs, solver).configure(configure).ctrlc(false).timer(false).run();
    run.err().map(|error| error.downcast().unwrap_or(StopReason::Budget))
}
