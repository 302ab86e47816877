//! A search away from what was found: what the model can do at other values of one parameter.

use super::gauss_newton::descend_gauss_newton;
use super::local::distinct_best_points;
use super::population::{CmaEs, WIDE_EXTENT};
use super::stagnation::StagnationCounter;
use super::{SearchSettings, StageCosts};
use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::ledger::{Ledger, StopReason};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Relative gain in cost that counts as progress of the cloud.
const SLAB_STAGNANT_GAIN: f64 = 1e-3;
/// Share of the evaluations that the cloud may use; the descents have the rest.
const CLOUD_SHARE: f64 = 0.6;
/// Points from which it descends.
const DESCENTS: usize = 3;

/// A cloud over the slab with a seed of its own, and Gauss-Newton steps from the best distinct points that
/// are then known there; at most `share` evaluations. Why it was stopped before that, if it was.
///
/// The best of them lies next to what was found, and leads back to it; so the others are followed too.
pub(crate) fn search_excluded_region(
    ledger: &mut Ledger,
    slab: Slab,
    settings: &SearchSettings,
    share: usize,
) -> Option<StopReason> {
    let (limit, made) = (ledger.evaluation_limit(), ledger.run_evaluations().len());
    let until = |ledger: &mut Ledger, count: f64| {
        ledger.set_limit(limit.min(made.saturating_add((count * share as f64) as usize)));
    };
    until(ledger, CLOUD_SHARE);
    let mut stop = evolve_in_slab(ledger, slab, settings);
    until(ledger, 1.0);
    let there = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && slab.contains(&e.unit));
    for start in distinct_best_points(there, DESCENTS) {
        if !matches!(stop, None | Some(StopReason::Budget)) {
            break;
        }
        stop = descend_gauss_newton(ledger, &start.unit).1;
    }
    let used_up = ledger.run_evaluations().len() >= limit;
    ledger.set_limit(limit);
    stop.filter(|stop| used_up || *stop != StopReason::Budget)
}

fn evolve_in_slab(ledger: &mut Ledger, slab: Slab, settings: &SearchSettings) -> Option<StopReason> {
    let middle = vec![0.5; ledger.objective().axes().len()];
    // no seed of another cloud: each slab has its own
    let seed = settings.seed.rotate_left(32) ^ (slab.axis as u64 + 1) ^ slab.lower.to_bits();
    let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut solver = CmaEs::new(middle, settings.particles, WIDE_EXTENT, generator);
    let mut costs = StageCosts::new_within(ledger, EvaluationStage::Elsewhere, slab);
    let mut patience = StagnationCounter::new(settings.stagnation_generations, SLAB_STAGNANT_GAIN);
    while !solver.has_converged() && !patience.is_stagnant(solver.least_cost()) {
        solver.run_generation(&mut costs);
        if let stop @ Some(_) = costs.stop_reason() {
            return stop;
        }
    }
    None
}

/// The best known point of a slab.
pub(crate) fn best_in_slab<'l>(ledger: &'l Ledger, slab: Slab) -> Option<&'l Evaluation> {
    let there = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && slab.contains(&e.unit));
    there.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

// A part of the unit box that is searched as if it were the whole.

/// Part of the unit box in which one coordinate is held within a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slab {
    /// Number of the parameter.
    pub axis: usize,
    pub lower: f64,
    pub upper: f64,
}

impl Slab {
    /// Whether a point lies in it.
    pub(crate) fn contains(&self, unit: &[f64]) -> bool {
        unit.get(self.axis).is_some_and(|u| (self.lower..=self.upper).contains(u))
    }

    /// The same without what lies within `margin` of its ends that are not ends of the box.
    pub(crate) fn shrink_by(self, margin: f64) -> Self {
        let lower = if self.lower > 0.0 { self.lower + margin } else { self.lower };
        let upper = if self.upper < 1.0 { self.upper - margin } else { self.upper };
        Self { lower, upper, ..self }
    }

    /// A point of the unit box as one of the slab.
    pub(super) fn map_into(&self, mut unit: Vec<f64>) -> Vec<f64> {
        if let Some(u) = unit.get_mut(self.axis) {
            *u = self.lower + (self.upper - self.lower) * *u;
        }
        unit
    }
}
