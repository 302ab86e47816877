//! Costs for the solvers of a stage, and the part of the unit box (slab) to which a search may be limited.

use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;

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

/// Cost that is returned for every point after the ledger has stopped. The solver is abandoned before it uses
/// this cost.
pub(super) const STOPPED_COST: f64 = 1e100;

/// Computes the costs of points in the unit box, for the solvers of one stage of the search.
pub(super) struct StageCosts<'l, 'a> {
    pub(super) ledger: &'l mut Ledger<'a>,
    pub(super) stage: EvaluationStage,
    /// Reason why the ledger has stopped; `None` while it still makes evaluations.
    pub(super) stop: Option<StopReason>,
    /// Slab into which the points are mapped before they are evaluated; `None` for the whole box.
    pub(super) slab: Option<Slab>,
}

impl<'l, 'a> StageCosts<'l, 'a> {
    pub(super) fn new(ledger: &'l mut Ledger<'a>, stage: EvaluationStage) -> Self {
        Self { ledger, stage, stop: None, slab: None }
    }

    /// One cost per point, in order; the ledger evaluates them in parallel.
    pub(super) fn evaluate_points(&mut self, points: &[Vec<f64>]) -> Vec<f64> {
        let global = self.stage == EvaluationStage::Global;
        let cost = |e: &Evaluation| if global { e.global_cost } else { e.cost };
        let moved: Option<Vec<Vec<f64>>> =
            self.slab.map(|slab| points.iter().map(|point| slab.map_into(point.clone())).collect());
        match self.ledger.evaluate_points(self.stage, moved.as_deref().unwrap_or(points)) {
            Ok(found) if found.len() == points.len() => return found.into_iter().map(cost).collect(),
            found => self.stop = found.err().or(self.stop.take()),
        }
        vec![STOPPED_COST; points.len()]
    }

    pub(super) fn evaluate_point(&mut self, point: Vec<f64>) -> f64 {
        self.evaluate_points(&[point]).first().copied().unwrap_or(STOPPED_COST)
    }
}
