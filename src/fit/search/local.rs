//! Local searches: descents from the best points, populations around the best ends, and a polish of
//! the best point.

use super::SearchSettings;
use super::costs::ToUnit;
use super::gauss_newton::descend_gauss_newton;
use super::population::{NEAR_EXTENT, evolve_population};
use super::simplex::run_simplex;
use super::termination::{
    EXACT_COST, LocalDescent, MIN_START_DISTANCE, MIN_WORTHWHILE_GAIN, SIMPLEX_EDGES, SearchTermination,
};
use crate::fit::evaluation::{Evaluation, EvaluationStage};
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;

/// Number of the best descents whose end points are refined with a population.
const REFINED_ENDS: usize = 3;

/// Descends from each start, refines the best ends with populations, then polishes the best point of all.
/// `limit` is the evaluation limit of the whole search.
pub(super) fn search_locally(
    ledger: &mut Ledger,
    settings: &SearchSettings,
    limit: usize,
    descents: &mut Vec<LocalDescent>,
) -> SearchTermination {
    let limit = limit.min(ledger.run_evaluations().len().saturating_add(settings.local_evaluations));
    ledger.set_limit(limit);
    let starts = distinct_best_points(ledger.run_evaluations().iter(), settings.starts);
    if starts.len() > 1 {
        let share = settings.local_evaluations / (3 * starts.len());
        for start in starts {
            let descend = |ledger: &mut Ledger| descend_from(ledger, start);
            if let Some(stop) = search_within_share(ledger, limit, share, descents, descend) {
                return SearchTermination::Stopped(stop);
            }
        }
        let share = settings.local_evaluations / (3 * REFINED_ENDS);
        portable_math::sort_by_number(descents, |a| a.end.cost);
        for at in 0..descents.len().min(REFINED_ENDS) {
            let (from, seed) = (descents[at].clone(), settings.seed.wrapping_add(at as u64 + 1));
            let mut further = Vec::new();
            let stop = search_within_share(ledger, limit, share, &mut further, |ledger| {
                refine_with_population(ledger, from, seed, settings)
            });
            further.into_iter().for_each(|descent| descents[at] = descent);
            if let Some(stop) = stop {
                return SearchTermination::Stopped(stop);
            }
        }
        ledger.set_limit(limit);
    }
    let (start, made) = (ledger.best_evaluation().cloned(), ledger.run_evaluations().len());
    let ended = polish_best(ledger);
    let evaluations = ledger.run_evaluations().len() - made;
    let ends = start.zip(ledger.best_evaluation().cloned());
    descents.extend(ends.map(|(start, end)| LocalDescent { start, end, evaluations }));
    ended
}

/// Runs a local search with at most `share` evaluations, unless the best point is already an exact fit.
/// Returns the reason if the whole search must stop.
fn search_within_share(
    ledger: &mut Ledger,
    limit: usize,
    share: usize,
    descents: &mut Vec<LocalDescent>,
    search: impl FnOnce(&mut Ledger) -> (LocalDescent, Option<StopReason>),
) -> Option<StopReason> {
    if is_exact_fit(ledger) {
        return None;
    }
    ledger.set_limit(limit.min(ledger.run_evaluations().len().saturating_add(share)));
    let (descent, stop) = search(ledger);
    descents.push(descent);
    stop.filter(|stop| *stop != StopReason::Budget)
}

/// Continues a local search with a small population around its end, then with a descent from the
/// best new point.
fn refine_with_population(
    ledger: &mut Ledger,
    from: LocalDescent,
    seed: u64,
    settings: &SearchSettings,
) -> (LocalDescent, Option<StopReason>) {
    let made = ledger.run_evaluations().len();
    let (place, middle) = ((EvaluationStage::Local, &<[f64]>::to_vec as &ToUnit<'_>), from.end.unit.clone());
    let stop = evolve_population(ledger, place, middle, NEAR_EXTENT, seed, settings);
    let added = ledger.run_evaluations().iter().skip(made);
    let better = added.filter(|found| found.cost < from.end.cost).min_by(|a, b| a.cost.total_cmp(&b.cost));
    let (end, stop) = match (stop, better.cloned()) {
        (None, Some(better)) => {
            let (further, stop) = descend_from(ledger, better);
            (further.end, stop)
        }
        (stop, better) => (better.unwrap_or(from.end), stop),
    };
    let evaluations = from.evaluations + ledger.run_evaluations().len() - made;
    (LocalDescent { start: from.start, end, evaluations }, stop)
}

/// Gauss-Newton descent from an evaluated point.
fn descend_from(ledger: &mut Ledger, start: Evaluation) -> (LocalDescent, Option<StopReason>) {
    let made = ledger.run_evaluations().len();
    let (end, stop) = descend_gauss_newton(ledger, &start.unit);
    let end = end.unwrap_or_else(|| start.clone());
    (LocalDescent { start, end, evaluations: ledger.run_evaluations().len() - made }, stop)
}

/// Polishes the best point by Gauss-Newton descents and simplices. It ends when simplices of every size have
/// been tried one after the other without lowering the cost.
pub(crate) fn polish_best(ledger: &mut Ledger) -> SearchTermination {
    let mut barren = 0;
    while let Some(edge) = SIMPLEX_EDGES.get(barren).filter(|_| !is_exact_fit(ledger)) {
        let best = ledger.best_evaluation().map(|best| (best.unit.clone(), best.cost));
        let Some((start, before)) = best else { break };
        if barren == 0
            && let (_, Some(stop)) = descend_gauss_newton(ledger, &start)
        {
            return SearchTermination::Stopped(stop);
        }
        let start = ledger.best_evaluation().map_or(start, |best| best.unit.clone());
        let ended = run_simplex(ledger, &start, *edge);
        if ended != SearchTermination::Converged {
            return ended;
        }
        let gain = before - ledger.best_evaluation().map_or(before, |best| best.cost);
        barren = if gain > MIN_WORTHWHILE_GAIN { 0 } else { barren + 1 };
    }
    SearchTermination::Converged
}

fn is_exact_fit(ledger: &Ledger) -> bool {
    ledger.best_evaluation().is_some_and(|best| best.cost <= EXACT_COST)
}

/// The points of lowest cost in the global stage that are not close to each other, in ascending order of
/// cost.
pub(super) fn distinct_best_points<'e>(
    known: impl IntoIterator<Item = &'e Evaluation>,
    most: usize,
) -> Vec<Evaluation> {
    let mut order: Vec<&Evaluation> = known.into_iter().collect();
    portable_math::sort_by_number(&mut order, |a| a.global_cost);
    let mut chosen: Vec<Evaluation> = Vec::new();
    for point in order {
        let far = |(a, b): (&f64, &f64)| (a - b).abs() > MIN_START_DISTANCE;
        if chosen.iter().all(|other| other.unit.iter().zip(&point.unit).any(far)) {
            chosen.push(point.clone());
        }
        if chosen.len() == most {
            break;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evaluation(unit: &[f64], cost: f64) -> Evaluation {
        Evaluation {
            unit: unit.to_vec(),
            values: vec![],
            cost,
            global_cost: cost,
            features: vec![],
            failure: None,
        }
    }

    #[test]
    fn starting_points_lie_apart_and_are_the_best() {
        let run = [
            evaluation(&[0.5, 0.5], 2.0),
            evaluation(&[0.55, 0.45], 1.0),
            evaluation(&[0.9, 0.5], 3.0),
            evaluation(&[0.1, 0.1], 4.0),
            evaluation(&[0.1, 0.9], 5.0),
        ];
        let places: Vec<Vec<f64>> = distinct_best_points(&run, 3).into_iter().map(|e| e.unit).collect();
        assert_eq!(places, vec![vec![0.55, 0.45], vec![0.9, 0.5], vec![0.1, 0.1]]);
    }
}
