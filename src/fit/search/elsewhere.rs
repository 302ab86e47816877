//! A search away from what was found: what the model can do at other values of one parameter.

use super::costs::Costs;
use super::evolution::{Evolution, WIDE};
use super::gauss_newton::gauss_newton;
use super::local::distinct_best;
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
/// Share of the evaluations that the cloud may use; the descents have the rest.
const CLOUD_SHARE: f64 = 0.6;
/// Points from which it descends.
const DESCENTS: usize = 3;

/// A cloud over the slab with a seed of its own, and Gauss-Newton steps from the best distinct points that
/// are then known there; at most `share` evaluations. Why it was stopped before that, if it was.
///
/// The best of them lies next to what was found, and leads back to it; so the others are followed too.
pub fn elsewhere(ledger: &mut Ledger, slab: Slab, settings: &Settings, share: usize) -> Option<Stop> {
    let (limit, made) = (ledger.limit(), ledger.run().len());
    let until = |ledger: &mut Ledger, count: f64| {
        ledger.set_limit(limit.min(made.saturating_add((count * share as f64) as usize)));
    };
    until(ledger, CLOUD_SHARE);
    let mut stop = cloud(ledger, slab, settings);
    until(ledger, 1.0);
    let there = ledger.run().iter().filter(|e| e.failure.is_none() && slab.holds(&e.unit));
    for start in distinct_best(there, DESCENTS) {
        if !matches!(stop, None | Some(Stop::Budget)) {
            break;
        }
        stop = gauss_newton(ledger, &start.unit).1;
    }
    let used_up = ledger.run().len() >= limit;
    ledger.set_limit(limit);
    stop.filter(|stop| used_up || *stop != Stop::Budget)
}

fn cloud(ledger: &mut Ledger, slab: Slab, settings: &Settings) -> Option<Stop> {
    let middle = vec![0.5; ledger.objective().axes().len()];
    // no seed of another cloud: each slab has its own
    let seed = settings.seed.rotate_left(32) ^ (slab.axis as u64 + 1) ^ slab.lower.to_bits();
    let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut solver = Evolution::new(middle, settings.particles, WIDE, generator);
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
    let there = ledger.run().iter().filter(|e| e.failure.is_none() && slab.holds(&e.unit));
    there.min_by(|a, b| a.cost.total_cmp(&b.cost))
}
