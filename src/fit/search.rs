//! The search in the unit box: CMA-ES populations, then a local search from each of the best distinct points,
//! then a polish of the best point until the cost no longer falls.
//!
//! argmin's executor runs all solvers: argmin's simplex, and two that argmin does not have, covariance matrix
//! adaptation and damped Gauss-Newton steps. The ledger counts the budget, stores the best point and handles
//! every failure, so the solvers never see costs that are not numbers.

pub(crate) mod costs;
mod excluded_region_search;
mod gauss_newton;
mod local;
mod population;
mod simplex;
mod stagnation;
mod termination;

use super::journal::StopReason;
use super::ledger::Ledger;
pub(super) use costs::Slab;
pub(super) use excluded_region_search::{best_in_slab, search_excluded_region};
pub(crate) use local::polish_best;
use local::search_locally;
use population::search_with_populations;
pub use termination::{
    EXACT_COST, LocalDescent, MIN_WORTHWHILE_GAIN, SIMPLEX_COST_SPREAD, SearchOutcome, SearchTermination,
};

/// Searches for the lowest cost within the budgets of `settings` and with at most `limit` evaluations in
/// total.
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

/// Default number of generations without a sufficient decrease of the cost after which a population ends.
pub const STAGNANT_GENERATIONS: usize = 20;

/// Budgets and stopping rules of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SearchSettings {
    /// Seed of the populations.
    pub seed: u64,
    /// Number of evaluations for the global stage.
    pub global_evaluations: usize,
    /// Number of evaluations for the local stage.
    pub local_evaluations: usize,
    /// Number of points in a population.
    pub particles: usize,
    /// Number of generations without a sufficient decrease of the cost after which a population ends.
    pub stagnation_generations: usize,
    /// Number of points from which local searches start.
    pub starts: usize,
}
