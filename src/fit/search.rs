//! The search: clouds of points that adapt to the valley they lie in, one after another over the unit box;
//! then a local search from each of the best distinct points; then the best of all polished until nothing is
//! gained.
//!
//! Covariance matrix adaptation and damped Gauss-Newton steps are written here; the simplex is argmin's
//! (`simplex.rs`). Budgets, stagnation, the best point and every failure are kept in the ledger, so nothing
//! depends on what a solver does with costs that are not numbers or with errors.

mod excluded_region_search;
mod gauss_newton;
mod local;
mod population;
mod simplex;
mod stagnation;
mod termination;

use super::evaluation::{Evaluation, EvaluationStage};
use super::ledger::{Ledger, StopReason};
pub(super) use excluded_region_search::{Slab, best_in_slab, search_excluded_region};
pub(crate) use local::polish_best;
use local::search_locally;
use population::search_with_populations;
pub use termination::{EXACT_COST, MIN_WORTHWHILE_GAIN};
pub use termination::{LocalDescent, SIMPLEX_COST_SPREAD, SearchOutcome, SearchTermination};

/// Searches within the budgets of `settings` and `limit` evaluations in all.
pub fn search_minimum(
    ledger: &mut Ledger,
    dimensions: usize,
    settings: &SearchSettings,
    limit: usize,
) -> SearchOutcome {
    let mut searched =
        SearchOutcome { termination: SearchTermination::Stopped(StopReason::Budget), descents: Vec::new() };
    if dimensions == 0 {
        return searched;
    }
    let made = ledger.run_evaluations().len();
    ledger.set_limit(limit.min(made.saturating_add(settings.global_evaluations)));
    if let Some(stop @ (StopReason::Interrupted | StopReason::Journal(_))) =
        search_with_populations(ledger, dimensions, settings)
    {
        searched.termination = SearchTermination::Stopped(stop);
        return searched;
    }
    let made = ledger.run_evaluations().len();
    searched.termination = search_locally(
        ledger,
        settings,
        limit.min(made.saturating_add(settings.local_evaluations)),
        &mut searched.descents,
    );
    searched
}

// Costs of points of the unit box, as the solvers of a stage ask for them.
//
// A solver that asks after the ledger has stopped gets [`STOPPED_COST`], and is left before it uses it.

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

// Budgets and rules of a search.

/// Generations without a gain after which a cloud is left, unless the job says otherwise.
pub const STAGNANT_GENERATIONS: usize = 20;

/// Budgets and rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SearchSettings {
    /// Seed of the clouds.
    pub seed: u64,
    /// Evaluations of the global stage.
    pub global_evaluations: usize,
    /// Evaluations of the local stage.
    pub local_evaluations: usize,
    /// Points of a cloud.
    pub particles: usize,
    /// Generations without progress after which a cloud is left.
    pub stagnation_generations: usize,
    /// Points from which a local search starts.
    pub starts: usize,
}
