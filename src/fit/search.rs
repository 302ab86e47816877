//! The search: clouds of points that adapt to the valley they lie in, one after another over the unit box;
//! then a local search from each of the best distinct points; then the best of all polished until nothing is
//! gained.
//!
//! Covariance matrix adaptation and damped Gauss-Newton steps are written here; the simplex is argmin's
//! (`simplex.rs`). Budgets, stagnation, the best point and every failure are kept in the ledger, so nothing
//! depends on what a solver does with costs that are not numbers or with errors.

mod clouds;
mod costs;
mod elsewhere;
mod ended;
mod evolution;
mod gauss_newton;
mod local;
mod patience;
mod rules;
mod simplex;
mod slab;

pub(super) use elsewhere::{best_in_slab, search_excluded_region};
pub use ended::{LocalDescent, SearchOutcome, SearchTermination};
pub use local::polish_best;
pub use rules::SIMPLEX_COST_SPREAD;
pub(crate) use rules::{EXACT_COST, MIN_WORTHWHILE_GAIN};
pub(super) use slab::Slab;

use super::ledger::{Ledger, StopReason};
use super::settings::SearchSettings;
use clouds::search_with_populations;
use local::search_locally;

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
