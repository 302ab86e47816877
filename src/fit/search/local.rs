//! The local searches: from each of the best points downhill, clouds about the best ends, and the best of all
//! polished.

use super::gauss_newton::{GaussNewton, Plain};
use super::{
    CLOUDED, Costs, DISTINCT, Descent, EXACT, Ended, MOST_STEPS, NEAR, Patience, SIMPLICES, SPREAD,
    STAGNANT_STEPS, Settings, WORTH, cloud,
};
use crate::fit::journal::Stage;
use crate::fit::ledger::{Ledger, Stop};
use crate::fit::objective::Evaluation;
use crate::fit::scale::{clamp_unit, line_to_unit, unit_to_line};
use argmin::core::{Problem, Solver, State};
use argmin::solver::neldermead::NelderMead;

/// A descent from each of the starts, clouds about the best ends, then the best of all polished.
pub(super) fn local(
    ledger: &mut Ledger,
    settings: &Settings,
    limit: usize,
    descents: &mut Vec<Descent>,
) -> Ended {
    ledger.set_limit(limit);
    let starts = distinct_best(ledger.known(), settings.starts);
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
    let end = unit.and_then(|unit| ledger.find(&unit).cloned()).unwrap_or_else(|| start.clone());
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

/// Where damped Gauss-Newton steps lead from `start`, and why they were stopped, if they were.
fn gauss_newton(ledger: &mut Ledger, start: &[f64]) -> (Option<Vec<f64>>, Option<Stop>) {
    let mut problem = Problem::new(Costs::new(ledger, Stage::Local, clamp_unit));
    let mut solver = GaussNewton::new(WORTH);
    let Ok((mut state, _)) = solver.init(&mut problem, Plain::new().param(start.to_vec())) else {
        return (None, None);
    };
    for _ in 0..MOST_STEPS {
        let stop = problem.problem.as_ref().and_then(Costs::stop);
        if stop.is_some() || solver.terminate(&state).terminated() || state.get_cost() <= EXACT {
            return (state.take_param(), stop);
        }
        match solver.next_iter(&mut problem, state) {
            Ok((next, _)) => state = next,
            Err(_) => return (None, None),
        }
    }
    (state.take_param(), None)
}

fn simplex(ledger: &mut Ledger, start: &[f64], edge: f64) -> Ended {
    let vertices = first_simplex(start, edge);
    let steps = ledger.remaining().saturating_mul(2).saturating_add(vertices.len());
    if ledger.remaining() < vertices.len() {
        return Ended::Stopped(Stop::Budget);
    }
    let patience_steps = STAGNANT_STEPS * vertices.len();
    let Ok(mut solver) = NelderMead::new(vertices).with_sd_tolerance(SPREAD) else { return Ended::Converged };
    let mut problem = Problem::new(Costs::new(ledger, Stage::Local, line_to_unit));
    let Ok((mut state, _)) = solver.init(&mut problem, Plain::new()) else { return Ended::Converged };
    let mut patience = Patience::new(patience_steps, 0.0);
    for _ in 0..steps {
        let stop = problem.problem.as_ref().and_then(Costs::stop);
        if let Some(stop) = stop {
            return Ended::Stopped(stop);
        }
        let exact = state.get_cost() <= EXACT;
        let converged = exact
            || <NelderMead<Vec<f64>, f64> as Solver<Costs, Plain>>::terminate(&mut solver, &state)
                .terminated();
        if converged || patience.is_over(state.get_cost()) {
            return Ended::Converged;
        }
        match solver.next_iter(&mut problem, state) {
            Ok((next, _)) => state = next,
            Err(_) => return Ended::Converged,
        }
    }
    Ended::Converged
}

/// `start` and one step of `edge` inwards along each coordinate of the box, as places on the real line.
pub(super) fn first_simplex(start: &[f64], edge: f64) -> Vec<Vec<f64>> {
    let moved = (0..start.len()).map(|axis| {
        let step =
            |(at, u): (usize, &f64)| if at == axis { u + if *u > 0.5 { -edge } else { edge } } else { *u };
        start.iter().enumerate().map(step).collect::<Vec<f64>>()
    });
    std::iter::once(start.to_vec())
        .chain(moved)
        .map(|vertex| vertex.into_iter().map(unit_to_line).collect())
        .collect()
}

/// The best points of the global stage, and of searches with other seeds, that lie apart, best first.
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
