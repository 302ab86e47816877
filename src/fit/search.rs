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

pub(super) use elsewhere::{best_in, elsewhere};
pub use ended::{Descent, Ended, Searched};
pub use local::polish;
pub use rules::SPREAD;
pub(crate) use rules::{EXACT, WORTH};
pub(super) use slab::Slab;

use super::ledger::{Ledger, Stop};
use super::settings::Settings;
use clouds::clouds;
use local::local;

/// Searches within the budgets of `settings` and `limit` evaluations in all.
pub fn search(ledger: &mut Ledger, dimensions: usize, settings: &Settings, limit: usize) -> Searched {
    let mut searched = Searched { ended: Ended::Stopped(Stop::Budget), descents: Vec::new() };
    if dimensions == 0 {
        return searched;
    }
    let made = ledger.run().len();
    ledger.set_limit(limit.min(made.saturating_add(settings.global_evaluations)));
    if let Some(stop @ (Stop::Interrupted | Stop::Journal(_))) = clouds(ledger, dimensions, settings) {
        searched.ended = Ended::Stopped(stop);
        return searched;
    }
    let made = ledger.run().len();
    searched.ended = local(
        ledger,
        settings,
        limit.min(made.saturating_add(settings.local_evaluations)),
        &mut searched.descents,
    );
    searched
}
