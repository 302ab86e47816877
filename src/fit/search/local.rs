//! The local searches: from each of the best points downhill, clouds about the best ends, and the best of all
//! polished.

use super::clouds::cloud;
use super::ended::{Descent, Ended};
use super::evolution::NEAR;
use super::gauss_newton::gauss_newton;
use super::rules::{DISTINCT, EXACT, SIMPLICES, WORTH};
use super::simplex::simplex;
use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::{Ledger, Stop};
use crate::fit::settings::Settings;
use crate::fit::stage::Stage;

/// Ends of local searches about which a cloud looks for a better one.
const CLOUDED: usize = 3;

/// A descent from each of the starts, clouds about the best ends, then the best of all polished.
pub(super) fn local(
    ledger: &mut Ledger,
    settings: &Settings,
    limit: usize,
    descents: &mut Vec<Descent>,
) -> Ended {
    ledger.set_limit(limit);
    let starts = distinct_best(ledger.run().iter(), settings.starts);
    if starts.len() > 1 {
        let share = settings.local_evaluations / (3 * starts.len());
        for start in starts {
            if let Some(stop) = allotted(ledger, limit, share, descents, |ledger| descended(ledger, start)) {
                return Ended::Stopped(stop);
            }
        }
        let share = settings.local_evaluations / (3 * CLOUDED);
        descents.sort_by(|a, b| a.end.cost.total_cmp(&b.end.cost));
        for at in 0..descents.len().min(CLOUDED) {
            let (from, seed) = (descents[at].clone(), settings.seed.wrapping_add(at as u64 + 1));
            let mut further = Vec::new();
            let stop =
                allotted(ledger, limit, share, &mut further, |ledger| clouded(ledger, from, seed, settings));
            further.into_iter().for_each(|descent| descents[at] = descent);
            if let Some(stop) = stop {
                return Ended::Stopped(stop);
            }
        }
        ledger.set_limit(limit);
    }
    let (start, made) = (ledger.best().cloned(), ledger.run().len());
    let ended = polish(ledger);
    let evaluations = ledger.run().len() - made;
    descents.extend(start.zip(ledger.best().cloned()).map(|(start, end)| Descent {
        start,
        end,
        evaluations,
    }));
    ended
}

/// A local search within its share of the evaluations, unless there is nothing left to gain; why everything
/// has to stop, if it has.
fn allotted(
    ledger: &mut Ledger,
    limit: usize,
    share: usize,
    descents: &mut Vec<Descent>,
    search: impl FnOnce(&mut Ledger) -> (Descent, Option<Stop>),
) -> Option<Stop> {
    if is_exact(ledger) {
        return None;
    }
    ledger.set_limit(limit.min(ledger.run().len().saturating_add(share)));
    let (descent, stop) = search(ledger);
    descents.push(descent);
    stop.filter(|stop| *stop != Stop::Budget)
}

/// A local search that goes on with a small cloud about its end, and Gauss-Newton steps from the best of it.
fn clouded(ledger: &mut Ledger, from: Descent, seed: u64, settings: &Settings) -> (Descent, Option<Stop>) {
    let made = ledger.run().len();
    let stop = cloud(ledger, Stage::Local, from.end.unit.clone(), (NEAR, seed), settings);
    let better = ledger
        .run()
        .iter()
        .skip(made)
        .filter(|found| found.cost < from.end.cost)
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .cloned();
    let (further, stop) = match (stop, better) {
        (None, Some(better)) => descended(ledger, better),
        (stop, better) => {
            let end = better.unwrap_or_else(|| from.end.clone());
            (Descent { start: end.clone(), end, evaluations: 0 }, stop)
        }
    };
    (
        Descent {
            start: from.start,
            end: further.end,
            evaluations: from.evaluations + ledger.run().len() - made,
        },
        stop,
    )
}

/// Gauss-Newton steps from a point that was evaluated.
fn descended(ledger: &mut Ledger, start: Evaluation) -> (Descent, Option<Stop>) {
    let made = ledger.run().len();
    let (unit, stop) = gauss_newton(ledger, &start.unit);
    let end = ledger.find(&unit).cloned().unwrap_or_else(|| start.clone());
    (Descent { start, end, evaluations: ledger.run().len() - made }, stop)
}

/// Descent and simplices from the best point until one simplex of each size in a row has gained nothing.
pub fn polish(ledger: &mut Ledger) -> Ended {
    let mut barren = 0;
    while let Some(edge) = SIMPLICES.get(barren).filter(|_| !is_exact(ledger)) {
        let Some((start, before)) = ledger.best().map(|best| (best.unit.clone(), best.cost)) else { break };
        if barren == 0
            && let (_, Some(stop)) = gauss_newton(ledger, &start)
        {
            return Ended::Stopped(stop);
        }
        let start = ledger.best().map_or(start, |best| best.unit.clone());
        let ended = simplex(ledger, &start, *edge);
        if ended != Ended::Converged {
            return ended;
        }
        let gain = before - ledger.best().map_or(before, |best| best.cost);
        barren = if gain > WORTH { 0 } else { barren + 1 };
    }
    Ended::Converged
}

fn is_exact(ledger: &Ledger) -> bool {
    ledger.best().is_some_and(|best| best.cost <= EXACT)
}

/// The best points of the global stage that lie apart, best first.
pub(super) fn distinct_best<'e>(
    known: impl IntoIterator<Item = &'e Evaluation>,
    most: usize,
) -> Vec<Evaluation> {
    let mut order: Vec<&Evaluation> = known.into_iter().collect();
    order.sort_by(|a, b| a.global_cost.total_cmp(&b.global_cost));
    let mut chosen: Vec<Evaluation> = Vec::new();
    for evaluation in order {
        let apart = |other: &Evaluation| {
            other.unit.iter().zip(&evaluation.unit).any(|(a, b)| (a - b).abs() > DISTINCT)
        };
        if chosen.iter().all(apart) {
            chosen.push(evaluation.clone());
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
        let places: Vec<Vec<f64>> = distinct_best(&run, 3).into_iter().map(|e| e.unit).collect();
        assert_eq!(places, vec![vec![0.55, 0.45], vec![0.9, 0.5], vec![0.1, 0.1]]);
    }
}
