//! The search in the unit box: CMA-ES populations, then a local search from each of the best distinct points,
//! then a polish of the best point until it gains nothing.
//!
//! Covariance matrix adaptation and damped Gauss-Newton steps are implemented here; the simplex is argmin's
//! (`simplex.rs`). The ledger keeps budgets, the best point and every failure, so the solvers never see
//! errors or costs that are not numbers.

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

/// Searches within the budgets of `settings` and at most `limit` evaluations in total.
pub fn search_minimum(
    ledger: &mut Ledger,
    dimensions: usize,
    settings: &SearchSettings,
    limit: usize,
) -> SearchOutcome {
    let mut descents = Vec::new();
    let termination = if dimensions == 0 {
        SearchTermination::Stopped(StopReason::Budget)
    } else {
        let made = ledger.run_evaluations().len();
        ledger.set_limit(limit.min(made.saturating_add(settings.global_evaluations)));
        match search_with_populations(ledger, dimensions, settings) {
            Some(stop) if stop != StopReason::Budget => SearchTermination::Stopped(stop),
            _ => search_locally(ledger, settings, limit, &mut descents),
        }
    };
    SearchOutcome { termination, descents }
}

/// Cost of every point after the ledger has stopped. A solver that gets it is abandoned before it uses it.
const STOPPED_COST: f64 = 1e100;

/// Costs of points of the unit box for the solvers of a stage.
struct StageCosts<'l, 'a> {
    ledger: &'l mut Ledger<'a>,
    stage: EvaluationStage,
    /// Why the ledger makes no more evaluations, once it has stopped.
    stop: Option<StopReason>,
    /// The part of the box onto which the points are mapped; `None` for the whole box.
    slab: Option<Slab>,
}

impl<'l, 'a> StageCosts<'l, 'a> {
    fn new(ledger: &'l mut Ledger<'a>, stage: EvaluationStage) -> Self {
        Self { ledger, stage, stop: None, slab: None }
    }

    /// One cost per point, in order; the ledger evaluates them in parallel.
    fn evaluate_points(&mut self, points: &[Vec<f64>]) -> Vec<f64> {
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

    fn evaluate_point(&mut self, point: Vec<f64>) -> f64 {
        self.evaluate_points(&[point]).first().copied().unwrap_or(STOPPED_COST)
    }
}

/// Default number of generations without a gain after which a population ends.
pub const STAGNANT_GENERATIONS: usize = 20;

/// Budgets and rules of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SearchSettings {
    /// Seed of the populations.
    pub seed: u64,
    /// Evaluations of the global stage.
    pub global_evaluations: usize,
    /// Evaluations of the local stage.
    pub local_evaluations: usize,
    /// Points of a population.
    pub particles: usize,
    /// Generations without a gain after which a population ends.
    pub stagnation_generations: usize,
    /// Number of points from which a local search starts.
    pub starts: usize,
}
