//! Costs of points of the unit box, as the solvers of a stage ask for them.
//!
//! A solver that asks after the ledger has stopped gets [`STOPPED_COST`], and is left before it uses it.

use super::slab::Slab;
use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::{Ledger, StopReason};
use crate::fit::stage::EvaluationStage;

/// Cost of every point after the ledger has stopped.
const STOPPED_COST: f64 = 1e100;

/// Costs of a stage.
pub(super) struct StageCosts<'l, 'a> {
    ledger: &'l mut Ledger<'a>,
    stage: EvaluationStage,
    stop: Option<StopReason>,
    /// The part of the box to which every point is moved, where it is not the whole.
    slab: Option<Slab>,
}

impl<'l, 'a> StageCosts<'l, 'a> {
    pub(super) fn new(ledger: &'l mut Ledger<'a>, stage: EvaluationStage) -> Self {
        Self { ledger, stage, stop: None, slab: None }
    }

    /// Costs of the points of a slab, which is asked for as if it were the whole box.
    pub(super) fn new_within(ledger: &'l mut Ledger<'a>, stage: EvaluationStage, slab: Slab) -> Self {
        Self { slab: Some(slab), ..Self::new(ledger, stage) }
    }

    /// One cost a point, in their order; the ledger evaluates them in parallel.
    pub(super) fn evaluate_points(&mut self, points: &[Vec<f64>]) -> Vec<f64> {
        let global = self.stage == EvaluationStage::Global;
        let cost = |e: &Evaluation| if global { e.global_cost } else { e.cost };
        let moved: Option<Vec<Vec<f64>>> =
            self.slab.map(|slab| points.iter().map(|point| slab.map_into(point.clone())).collect());
        match self.ledger.evaluate_points(self.stage, moved.as_deref().unwrap_or(points)) {
            Ok(found) if found.len() == points.len() => found.into_iter().map(cost).collect(),
            Ok(_) => vec![STOPPED_COST; points.len()],
            Err(reason) => {
                self.stop = Some(reason);
                vec![STOPPED_COST; points.len()]
            }
        }
    }

    pub(super) fn evaluate_point(&mut self, point: Vec<f64>) -> f64 {
        self.evaluate_points(&[point]).first().copied().unwrap_or(STOPPED_COST)
    }

    /// What is known, and how it is priced.
    pub(super) fn ledger(&self) -> &Ledger<'a> {
        self.ledger
    }

    /// Why no more evaluations are made, if none are.
    pub(super) fn stop_reason(&self) -> Option<StopReason> {
        self.stop.clone()
    }
}
