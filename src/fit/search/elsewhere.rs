//! A search away from what was found: what the model can do at other values of one parameter.

use super::costs::Costs;
use super::evolution::{Evolution, WIDE};
use super::gauss_newton::gauss_newton;
use super::patience::Patience;
use super::slab::Slab;
use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::{Ledger, Stop};
use crate::fit::settings::Settings;
use crate::fit::stage::Stage;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Relative gain in cost that counts as progress of the cloud.
const STAGNANT_GAIN: f64 = 1e-3;
/// Share of the evaluations that the cloud may use; the descent has the rest.
const CLOUD_SHARE: f64 = 0.6;

/// A cloud over the slab about the best point known there, with a seed of its own, and Gauss-Newton steps from
/// the best that is then known; at most `share` evaluations. Why it was stopped before that, if it was.
pub fn elsewhere(ledger: &mut Ledger, slab: Slab, settings: &Settings, share: usize) -> Option<Stop> {
    let (limit, made) = (ledger.limit(), ledger.run().len());
    let until = |ledger: &mut Ledger, count: f64| {
        ledger.set_limit(limit.min(made.saturating_add((count * share as f64) as usize)));
    };
    until(ledger, CLOUD_SHARE);
    let stop = cloud(ledger, slab, settings);
    until(ledger, 1.0);
    let stop = match (stop, best_in(ledger, slab).map(|best| best.unit.clone())) {
        (None | Some(Stop::Budget), Some(start)) => gauss_newton(ledger, &start).1,
        (stop, _) => stop,
    };
    let used_up = ledger.run().len() >= limit;
    ledger.set_limit(limit);
    stop.filter(|stop| used_up || *stop != Stop::Budget)
}

fn cloud(ledger: &mut Ledger, slab: Slab, settings: &Settings) -> Option<Stop> {
    let dimensions = ledger.objective().axes().len();
    let known = best_in(ledger, slab).map(|best| slab.stretched(best.unit.clone()));
    // no seed of another cloud: each slab has its own
    let seed = settings.seed.rotate_left(32) ^ (slab.axis as u64 + 1) ^ slab.lower.to_bits();
    let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut solver =
        Evolution::new(known.unwrap_or_else(|| vec![0.5; dimensions]), settings.particles, WIDE, generator);
    let mut costs = Costs::within(ledger, Stage::Elsewhere, slab);
    let mut patience = Patience::new(settings.stagnation_generations, STAGNANT_GAIN);
    while !solver.has_settled() && !patience.is_over(solver.least_cost()) {
        solver.generation(&mut costs);
        if let stop @ Some(_) = costs.stop() {
            return stop;
        }
    }
    None
}

/// The best known point of a slab.
#[must_use]
pub fn best_in<'l>(ledger: &'l Ledger, slab: Slab) -> Option<&'l Evaluation> {
    let there = ledger.known().filter(|e| e.failure.is_none() && slab.holds(&e.unit));
    there.min_by(|a, b| a.cost.total_cmp(&b.cost))
}
