//! Clouds of points over the unit box, one after another.

use super::costs::Costs;
use super::evolution::{Evolution, Reach, WIDE};
use super::patience::Patience;
use crate::fit::ledger::{Ledger, Stop};
use crate::fit::settings::Settings;
use crate::fit::stage::Stage;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Relative gain in cost that counts as progress of a cloud.
const STAGNANT_GAIN: f64 = 1e-3;

/// Clouds of points, the first about the middle of the box and the others about random places, until the
/// evaluations of the stage are used up: each ends where it has shrunk or gains nothing any more. `None` when
/// the ledger was not stopped.
pub(super) fn clouds(ledger: &mut Ledger, dimensions: usize, settings: &Settings) -> Option<Stop> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
    let mut middle = vec![0.5; dimensions];
    let mut used = ledger.remaining();
    while ledger.remaining() > 0 {
        let seed = generator.random();
        if let stop @ Some(_) = cloud(ledger, Stage::Global, middle, (WIDE, seed), settings) {
            return stop;
        }
        middle = (0..dimensions).map(|_| generator.random()).collect();
        // a cloud that meets known points alone makes no evaluation
        if ledger.remaining() == used {
            break;
        }
        used = ledger.remaining();
    }
    None
}

/// One cloud about a place; why it was stopped, if it was.
pub(super) fn cloud(
    ledger: &mut Ledger,
    stage: Stage,
    middle: Vec<f64>,
    (reach, seed): (Reach, u64),
    settings: &Settings,
) -> Option<Stop> {
    let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut solver = Evolution::new(middle, settings.particles, reach, generator);
    let mut costs = Costs::new(ledger, stage);
    let mut patience = Patience::new(settings.stagnation_generations, STAGNANT_GAIN);
    while !solver.has_settled() && !patience.is_over(solver.least_cost()) {
        solver.generation(&mut costs);
        if let stop @ Some(_) = costs.stop() {
            return stop;
        }
    }
    None
}
