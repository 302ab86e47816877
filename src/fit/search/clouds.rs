//! Clouds of points over the unit box, one after another.

use super::costs::StageCosts;
use super::evolution::{CmaEs, PopulationExtent, WIDE_EXTENT};
use super::patience::StagnationCounter;
use crate::fit::ledger::{Ledger, StopReason};
use crate::fit::settings::SearchSettings;
use crate::fit::stage::EvaluationStage;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Relative gain in cost that counts as progress of a cloud.
const STAGNANT_GAIN: f64 = 1e-3;

/// Clouds of points, the first about the middle of the box and the others about random places, until the
/// evaluations of the stage are used up: each ends where it has shrunk or gains nothing any more. `None` when
/// the ledger was not stopped.
pub(super) fn search_with_populations(
    ledger: &mut Ledger,
    dimensions: usize,
    settings: &SearchSettings,
) -> Option<StopReason> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(settings.seed);
    let mut middle = vec![0.5; dimensions];
    let mut used = ledger.remaining_evaluations();
    while ledger.remaining_evaluations() > 0 {
        let seed = generator.random();
        if let stop @ Some(_) =
            evolve_population(ledger, EvaluationStage::Global, middle, (WIDE_EXTENT, seed), settings)
        {
            return stop;
        }
        middle = (0..dimensions).map(|_| generator.random()).collect();
        // a cloud that meets known points alone makes no evaluation
        if ledger.remaining_evaluations() == used {
            break;
        }
        used = ledger.remaining_evaluations();
    }
    None
}

/// One cloud about a place; why it was stopped, if it was.
pub(super) fn evolve_population(
    ledger: &mut Ledger,
    stage: EvaluationStage,
    middle: Vec<f64>,
    (reach, seed): (PopulationExtent, u64),
    settings: &SearchSettings,
) -> Option<StopReason> {
    let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut solver = CmaEs::new(middle, settings.particles, reach, generator);
    let mut costs = StageCosts::new(ledger, stage);
    let mut patience = StagnationCounter::new(settings.stagnation_generations, STAGNANT_GAIN);
    while !solver.has_converged() && !patience.is_stagnant(solver.least_cost()) {
        solver.run_generation(&mut costs);
        if let stop @ Some(_) = costs.stop_reason() {
            return stop;
        }
    }
    None
}
