//! A search outside the interval of one parameter: how well the model fits at other values of this parameter.

use super::SearchSettings;
use super::costs::Slab;
use super::gauss_newton::descend_gauss_newton;
use super::local::distinct_best_points;
use super::population::{WIDE_EXTENT, evolve_population};
use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;

/// Fraction of the evaluations that the population gets; the descents get the rest.
const POPULATION_SHARE: f64 = 0.6;
/// Maximum number of Gauss-Newton descents.
const DESCENTS: usize = 3;

/// Searches a slab with a population, then with Gauss-Newton descents from the best distinct points, in at
/// most `share` evaluations. Returns the reason if the search was stopped; `None` if it finished or used up
/// `share`.
///
/// A descent from the best point of the slab usually leads back to the known minimum next to the slab, so
/// descents also start from other points.
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
    until(ledger, POPULATION_SHARE);
    // the seed differs from slab to slab and from the seeds of the other populations
    let seed = settings.seed.rotate_left(32) ^ (slab.axis as u64 + 1) ^ slab.lower.to_bits();
    let middle = vec![0.5; ledger.objective().axes().len()];
    let to_unit = |point: &[f64]| slab.map_into(point.to_vec());
    let stage = EvaluationStage::Elsewhere;
    let mut stop = evolve_population(ledger, (stage, &to_unit), middle, WIDE_EXTENT, seed, settings);
    until(ledger, 1.0);
    for start in distinct_best_points(evaluations_in_slab(ledger, slab), DESCENTS) {
        if !matches!(stop, None | Some(StopReason::Budget)) {
            break;
        }
        stop = descend_gauss_newton(ledger, &start.unit).1;
    }
    let used_up = ledger.run_evaluations().len() >= limit;
    ledger.set_limit(limit);
    stop.filter(|stop| used_up || *stop != StopReason::Budget)
}

fn evaluations_in_slab<'l>(ledger: &'l Ledger, slab: Slab) -> impl Iterator<Item = &'l Evaluation> {
    let all = ledger.run_evaluations().iter();
    all.filter(move |e| e.failure.is_none() && slab.contains(&e.unit))
}

/// The evaluated point of lowest cost in a slab.
pub(crate) fn best_in_slab<'l>(ledger: &'l Ledger, slab: Slab) -> Option<&'l Evaluation> {
    evaluations_in_slab(ledger, slab).min_by(|a, b| a.cost.total_cmp(&b.cost))
}
