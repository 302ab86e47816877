//! The search: clouds of points that adapt to the valley they lie in, one after another over the unit box;
//! then a local search from each of the best distinct points; then the best of all polished until nothing is
//! gained.
//!
//! argmin supplies the simplex and the frame in which the two solvers run that it does not have: covariance
//! matrix adaptation and damped Gauss-Newton steps. Each is driven step by step from here: budgets,
//! stagnation, the best point and every failure are kept in the ledger, so nothing depends on what the
//! solvers do with costs that are not numbers or with errors.

mod costs;
mod evolution;
mod gauss_newton;
mod local;

pub use local::polish;

use super::journal::Stage;
use super::ledger::{Ledger, Stop};
use super::objective::Evaluation;
use super::scale::clamp_unit;
use argmin::core::{Problem, Solver, State};
use costs::Costs;
use evolution::{Evolution, NEAR, Reach, WIDE};
use gauss_newton::Plain;
use local::local;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Points closer than this in every coordinate of the unit box are one starting point: a descent crosses half
/// of that in a step.
pub const DISTINCT: f64 = 0.2;
/// Edges of the simplices in the unit box, taken in turn from the best point: the first stays in a basin that
/// a cloud has found, the second steps over a kink or along a valley that has collapsed the first, the third
/// fits into a narrow one.
pub const SIMPLICES: [f64; 3] = [0.05, 0.2, 0.01];
/// Spread of the costs in a simplex at which it has converged, in squared standard deviations: a hundredth of
/// an sd of a feature.
pub const SPREAD: f64 = 1e-4;
/// Gain in cost below which another step is not worth taking: 2 % of the gain of 1 that a 68 % interval
/// spans.
pub const WORTH: f64 = 0.02;
/// Generations without a gain of [`STAGNANT_GAIN`] after which a cloud is left, unless the job says
/// otherwise.
pub const STAGNANT_GENERATIONS: usize = 20;
/// Relative gain in cost that counts as progress of a cloud.
pub const STAGNANT_GAIN: f64 = 1e-3;

/// Cost that leaves nothing to gain: a thousandth of a standard deviation in one feature.
pub const EXACT: f64 = 1e-6;

/// Ends of local searches about which a cloud looks for a better one.
const CLOUDED: usize = 3;
/// Steps of one simplex without a lower cost after which it is left, per vertex.
const STAGNANT_STEPS: usize = 20;
/// Most Gauss-Newton steps from one point: a curved valley a hundred times longer than wide takes about
/// twenty.
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
    searched.ended = local(
        ledger,
        settings,
        limit.min(made.saturating_add(settings.local_evaluations)),
        &mut searched.descents,
    );
    searched
}

/// Clouds of points, the first about the middle of the box and the others about random places, until the
/// evaluations of the stage are used up: each ends where it has shrunk or gains nothing any more. `None` when
/// the ledger was not stopped.
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

fn cloud(
    ledger: &mut Ledger,
    stage: Stage,
    middle: Vec<f64>,
    (reach, seed): (Reach, u64),
    settings: &Settings,
) -> Option<Stop> {
    let mut solver =
        Evolution::new(middle, settings.particles, reach, Xoshiro256PlusPlus::seed_from_u64(seed));
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
    use super::super::scale::line_to_unit;
    use super::local::{distinct_best, first_simplex};
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

    #[test]
    fn the_first_simplex_stays_in_the_box_and_is_not_flat() {
        let vertices = first_simplex(&[0.0, 1.0], 0.05);
        let units: Vec<Vec<f64>> =
            vertices.iter().map(|v| v.iter().map(|z| line_to_unit(*z)).collect()).collect();
        let expected = [[0.0, 1.0], [0.05, 1.0], [0.0, 0.95]];
        assert_eq!(units.len(), 3);
        for (unit, expected) in units.iter().flatten().zip(expected.iter().flatten()) {
            assert!((unit - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn patience_counts_steps_without_gain() {
        let mut patience = Patience::new(2, 0.01);
        let over: Vec<bool> =
            [10.0, 9.95, 9.0, 9.0, 8.95, 8.92].into_iter().map(|cost| patience.is_over(cost)).collect();
        assert_eq!(over, [false, false, false, false, false, true]);
    }
}
