//! The search: clouds of points that adapt to the valley they lie in, one after another over the unit box; then a local search from each
//! of the best distinct points; then the best of all polished until nothing is gained.
//!
//! argmin supplies the simplex and the frame in which the two solvers run that it does not have: covariance matrix adaptation and damped
//! Gauss-Newton steps. Each is driven step by step from here: budgets, stagnation, the best point and every failure are kept in the ledger, so nothing depends on what the solvers do with
//! costs that are not numbers or with errors.

mod costs;
mod evolution;
mod gauss_newton;

use super::journal::Stage;
use super::ledger::{Ledger, Stop};
use super::objective::Evaluation;
use super::scale::{clamp_unit, line_to_unit, unit_to_line};
use argmin::core::{Problem, Solver, State};
use argmin::solver::neldermead::NelderMead;
use costs::Costs;
use evolution::{Evolution, NEAR, Reach, WIDE};
use gauss_newton::{GaussNewton, Plain};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Points closer than this in every coordinate of the unit box are one starting point: a descent crosses half of that in a step.
pub const DISTINCT: f64 = 0.2;
/// Edges of the simplices in the unit box, taken in turn from the best point: the first stays in a basin that a cloud has
/// found, the second steps over a kink or along a valley that has collapsed the first, the third fits into a narrow one.
pub const SIMPLICES: [f64; 3] = [0.05, 0.2, 0.01];
/// Spread of the costs in a simplex at which it has converged, in squared standard deviations: a hundredth of an sd of a feature.
pub const SPREAD: f64 = 1e-4;
/// Gain in cost below which another step is not worth taking: 2 % of the gain of 1 that a 68 % interval spans.
pub const WORTH: f64 = 0.02;
/// Generations without a gain of [`STAGNANT_GAIN`] after which a cloud is left, unless the job says otherwise.
pub const STAGNANT_GENERATIONS: usize = 20;
/// Relative gain in cost that counts as progress of a cloud.
pub const STAGNANT_GAIN: f64 = 1e-3;

/// Cost that leaves nothing to gain: a thousandth of a standard deviation in one feature.
pub const EXACT: f64 = 1e-6;

/// Ends of local searches about which a cloud looks for a better one.
const CLOUDED: usize = 3;
/// Steps of one simplex without a lower cost after which it is left, per vertex.
const STAGNANT_STEPS: usize = 20;
/// Most Gauss-Newton steps from one point: a curved valley a hundred times longer than wide takes about twenty.
const MOST_STEPS: usize = 60;

/// Budgets and rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Seed of the clouds.
    pub seed: u64,
    /// Evaluations of the global stage.
    pub global_evaluations: usize,
    /// Evaluations of the local stage.
    pub local_evaluations: usize,
    /// Points of a cloud.
    pub particles: usize,
    /// Generations without progress after which a cloud is left.
    pub stagnation_generations: usize,
    /// Points from which a local search starts.
    pub starts: usize,
}

/// How a search ended; the best point is in the ledger.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// Simplices of several sizes from the best point gained nothing.
    Converged,
    /// It was stopped, most often by the budget.
    Stopped(Stop),
}

/// A local search: where it started and where it came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Descent {
    /// Where it started.
    pub start: Evaluation,
    /// Where it came to.
    pub end: Evaluation,
    /// Evaluations that it took.
    pub evaluations: usize,
}

/// What a search did.
#[derive(Debug, Clone, PartialEq)]
pub struct Searched {
    /// How it ended.
    pub ended: Ended,
    /// The local searches, one a start; the last one is the polish of the best.
    pub descents: Vec<Descent>,
}

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
    searched.ended = local(ledger, settings, limit.min(made.saturating_add(settings.local_evaluations)), &mut searched.descents);
    searched
}

/// Clouds of points, the first about the middle of the box and the others about random places, until the evaluations of the stage are used
/// up: each ends where it has shrunk or gains nothing any more. `None` when the ledger was not stopped.
fn clouds(ledger: &mut Ledger, dimensions: usize, settings: &Settings) -> Option<Stop> {
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

fn cloud(ledger: &mut Ledger, stage: Stage, middle: Vec<f64>, (reach, seed): (Reach, u64), settings: &Settings) -> Option<Stop> {
    let mut solver = Evolution::new(middle, settings.particles, reach, Xoshiro256PlusPlus::seed_from_u64(seed));
    let mut problem = Problem::new(Costs::new(ledger, stage, clamp_unit));
    let (mut state, _) = solver.init(&mut problem, Plain::new()).ok()?;
    let mut patience = Patience::new(settings.stagnation_generations, STAGNANT_GAIN);
    while !solver.terminate(&state).terminated() && !patience.is_over(state.get_cost()) {
        (state, _) = solver.next_iter(&mut problem, state).ok()?;
        if let stop @ Some(_) = problem.problem.as_ref()?.stop() {
            return stop;
        }
    }
    None
}

/// A descent from each of the starts, clouds about the best ends, then the best of all polished.
fn local(ledger: &mut Ledger, settings: &Settings, limit: usize, descents: &mut Vec<Descent>) -> Ended {
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
            let stop = allotted(ledger, limit, share, &mut further, |ledger| clouded(ledger, from, seed, settings));
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
    descents.extend(start.zip(ledger.best().cloned()).map(|(start, end)| Descent { start, end, evaluations }));
    ended
}

/// A local search within its share of the evaluations, unless there is nothing left to gain; why everything has to stop, if it has.
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
    let better = ledger.run().iter().skip(made).filter(|found| found.cost < from.end.cost).min_by(|a, b| a.cost.total_cmp(&b.cost)).cloned();
    let (further, stop) = match (stop, better) {
        (None, Some(better)) => descended(ledger, better),
        (stop, better) => {
            let end = better.unwrap_or_else(|| from.end.clone());
            (Descent { start: end.clone(), end, evaluations: 0 }, stop)
        }
    };
    (Descent { start: from.start, end: further.end, evaluations: from.evaluations + ledger.run().len() - made }, stop)
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
    let Ok((mut state, _)) = solver.init(&mut problem, Plain::new().param(start.to_vec())) else { return (None, None) };
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
        let converged = exact || <NelderMead<Vec<f64>, f64> as Solver<Costs, Plain>>::terminate(&mut solver, &state).terminated();
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
fn first_simplex(start: &[f64], edge: f64) -> Vec<Vec<f64>> {
    let moved = (0..start.len()).map(|axis| {
        let step = |(at, u): (usize, &f64)| if at == axis { u + if *u > 0.5 { -edge } else { edge } } else { *u };
        start.iter().enumerate().map(step).collect::<Vec<f64>>()
    });
    std::iter::once(start.to_vec()).chain(moved).map(|vertex| vertex.into_iter().map(unit_to_line).collect()).collect()
}

/// The best points of the global stage, and of searches with other seeds, that lie apart, best first.
fn distinct_best<'e>(known: impl IntoIterator<Item = &'e Evaluation>, most: usize) -> Vec<Evaluation> {
    let mut order: Vec<&Evaluation> = known.into_iter().collect();
    order.sort_by(|a, b| a.global_cost.total_cmp(&b.global_cost));
    let mut chosen: Vec<Evaluation> = Vec::new();
    for evaluation in order {
        let apart = |other: &Evaluation| other.unit.iter().zip(&evaluation.unit).any(|(a, b)| (a - b).abs() > DISTINCT);
        if chosen.iter().all(apart) {
            chosen.push(evaluation.clone());
        }
        if chosen.len() == most {
            break;
        }
    }
    chosen
}

/// Counts steps without progress.
struct Patience {
    allowed: usize,
    gain: f64,
    mark: f64,
    waited: usize,
}

impl Patience {
    fn new(allowed: usize, gain: f64) -> Self {
        Self { allowed, gain, mark: f64::MAX, waited: 0 }
    }

    fn is_over(&mut self, cost: f64) -> bool {
        if cost < self.mark * (1.0 - self.gain) {
            self.mark = cost;
            self.waited = 0;
        } else {
            self.waited += 1;
        }
        self.waited > self.allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evaluation(unit: &[f64], cost: f64) -> Evaluation {
        Evaluation { unit: unit.to_vec(), values: vec![], cost, global_cost: cost, features: vec![], failure: None }
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

    #[test]
    fn the_first_simplex_stays_in_the_box_and_is_not_flat() {
        let vertices = first_simplex(&[0.0, 1.0], 0.05);
        let units: Vec<Vec<f64>> = vertices.iter().map(|v| v.iter().map(|z| line_to_unit(*z)).collect()).collect();
        let expected = [[0.0, 1.0], [0.05, 1.0], [0.0, 0.95]];
        assert_eq!(units.len(), 3);
        for (unit, expected) in units.iter().flatten().zip(expected.iter().flatten()) {
            assert!((unit - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn patience_counts_steps_without_gain() {
        let mut patience = Patience::new(2, 0.01);
        let over: Vec<bool> = [10.0, 9.95, 9.0, 9.0, 8.95, 8.92].into_iter().map(|cost| patience.is_over(cost)).collect();
        assert_eq!(over, [false, false, false, false, false, true]);
    }
}
