//! The ledger as a problem of argmin; it never returns an error, because the first simplex would panic.

use super::super::journal::Stage;
use super::super::ledger::{Ledger, Stop};
use super::super::linear::residuals;
use super::super::objective::Evaluation;
use argmin::core::{CostFunction, Error, Operator, SyncAlias};
use std::borrow::Borrow;
use std::sync::{Mutex, PoisonError};

/// What a solver is told after the ledger has stopped; it is left before it uses the number.
const STOPPED_COST: f64 = 1e100;

/// Costs of a stage, as its solvers see them.
pub(super) struct Costs<'l, 'a> {
    state: Mutex<(&'l mut Ledger<'a>, Option<Stop>)>,
    stage: Stage,
    to_unit: fn(f64) -> f64,
}

impl<'l, 'a> Costs<'l, 'a> {
    pub(super) fn new(ledger: &'l mut Ledger<'a>, stage: Stage, to_unit: fn(f64) -> f64) -> Self {
        Self { state: Mutex::new((ledger, None)), stage, to_unit }
    }

    /// One entry a point of the unit box, or none when the ledger has stopped.
    fn evaluations<T>(&self, points: &[Vec<f64>], of: impl Fn(&Evaluation) -> T) -> Vec<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (ledger, stop) = &mut *state;
        match ledger.evaluate(self.stage, points) {
            Ok(evaluations) => evaluations.into_iter().map(of).collect(),
            Err(reason) => {
                *stop = Some(reason);
                Vec::new()
            }
        }
    }

    fn of(&self, points: &[Vec<f64>]) -> Vec<f64> {
        let global = self.stage == Stage::Global;
        let found = self.evaluations(points, |e| if global { e.global_cost } else { e.cost });
        if found.len() == points.len() { found } else { vec![STOPPED_COST; points.len()] }
    }

    fn unit(&self, point: &[f64]) -> Vec<f64> {
        point.iter().map(|x| (self.to_unit)(*x)).collect()
    }

    pub(super) fn stop(&self) -> Option<Stop> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).1.clone()
    }

    pub(super) fn with_ledger<T>(&self, read: impl FnOnce(&Ledger<'a>) -> T) -> T {
        read(self.state.lock().unwrap_or_else(PoisonError::into_inner).0)
    }
}

impl CostFunction for Costs<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.of(&[self.unit(point)]).first().copied().unwrap_or(STOPPED_COST))
    }

    /// The ledger runs a generation in parallel itself, so that the order of its entries is that of the
    /// particles.
    fn bulk_cost<P: Borrow<Vec<f64>> + SyncAlias>(&self, points: &[P]) -> Result<Vec<f64>, Error> {
        Ok(self.of(&points.iter().map(|point| self.unit(point.borrow())).collect::<Vec<_>>()))
    }
}

/// Residuals; no entry where a feature is missing.
impl Operator for Costs<'_, '_> {
    type Param = Vec<f64>;
    type Output = Vec<Option<f64>>;

    fn apply(&self, point: &Vec<f64>) -> Result<Self::Output, Error> {
        let unit = self.unit(point);
        let objective = self.with_ledger(|ledger| ledger.objective());
        Ok(self.evaluations(&[unit], |e| residuals(objective, e)).pop().unwrap_or_default())
    }
}
