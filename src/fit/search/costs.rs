//! Costs of points of the unit box, as the solvers of a stage ask for them.
//!
//! A solver that asks after the ledger has stopped gets [`STOPPED_COST`], and is left before it uses it.

use super::slab::Slab;
use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::{Ledger, Stop};
use crate::fit::stage::Stage;

/// Cost of every point after the ledger has stopped.
const STOPPED_COST: f64 = 1e100;

/// Costs of a stage.
pub(super) struct Costs<'l, 'a> {
    ledger: &'l mut Ledger<'a>,
    stage: Stage,
    stop: Option<Stop>,
    /// The part of the box to which every point is moved, where it is not the whole.
    slab: Option<Slab>,
}

impl<'l, 'a> Costs<'l, 'a> {
    pub(super) fn new(ledger: &'l mut Ledger<'a>, stage: Stage) -> Self {
        Self { ledger, stage, stop: None, slab: None }
    }

    /// Costs of the points of a slab, which is asked for as if it were the whole box.
    pub(super) fn within(ledger: &'l mut Ledger<'a>, stage: Stage, slab: Slab) -> Self {
        Self { slab: Some(slab), ..Self::new(ledger, stage) }
    }

    /// One cost a point, in their order; the ledger evaluates them in parallel.
    pub(super) fn of(&mut self, points: &[Vec<f64>]) -> Vec<f64> {
        let global = self.stage == Stage::Global;
        let cost = |e: &Evaluation| if global { e.global_cost } else { e.cost };
        let moved: Option<Vec<Vec<f64>>> =
            self.slab.map(|slab| points.iter().map(|point| slab.squeezed(point.clone())).collect());
        match self.ledger.evaluate(self.stage, moved.as_deref().unwrap_or(points)) {
            Ok(found) if found.len() == points.len() => found.into_iter().map(cost).collect(),
            Ok(_) => vec![STOPPED_COST; points.len()],
            Err(reason) => {
                self.stop = Some(reason);
                vec![STOPPED_COST; points.len()]
            }
        }
    }

    pub(super) fn of_one(&mut self, point: Vec<f64>) -> f64 {
        self.of(&[point]).first().copied().unwrap_or(STOPPED_COST)
    }

    /// What is known, and how it is priced.
    pub(super) fn ledger(&self) -> &Ledger<'a> {
        self.ledger
    }

    /// Why no more evaluations are made, if none are.
    pub(super) fn stop(&self) -> Option<Stop> {
        self.stop.clone()
    }
}
