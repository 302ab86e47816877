//! Populations of points in the unit box: covariance matrix adaptation (CMA-ES).
//!
//! Hansen and Ostermeier, Evol. Comput. 9 (2001) 159; formulas and defaults of Hansen, arXiv:1604.00772,
//! without negative weights. A population adapts to the shape of a valley of the cost and is not trapped by
//! ripples on the floor of the valley. A point outside the unit box is evaluated at its mirror image inside
//! the box. argmin does not provide this method.

use super::SearchSettings;
use super::costs::{LedgerCosts, ToUnit, run_solver};
use super::stagnation::StagnationCounter;
use crate::fit::bounds::clamp_unit;
use crate::fit::evaluation::EvaluationStage;
use crate::fit::journal::StopReason;
use crate::fit::ledger::Ledger;
use argmin::core::{Error, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use portable_math::{self as math, StandardNormal};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Smallest relative decrease of the cost that counts as progress of a population.
const STAGNANT_GAIN: f64 = 1e-3;

/// Runs populations until the evaluations of the stage are used up. The first population starts in the middle
/// of the box, the others at random points. Returns the reason if the ledger stopped.
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
        let place = (EvaluationStage::Global, &<[f64]>::to_vec as &ToUnit<'_>);
        if let stop @ Some(_) = evolve_population(ledger, place, middle, WIDE_EXTENT, seed, settings) {
            return stop;
        }
        middle = (0..dimensions).map(|_| generator.random()).collect();
        // if all points of a population are known, it makes no evaluation, and the loop would never end
        if ledger.remaining_evaluations() == used {
            break;
        }
        used = ledger.remaining_evaluations();
    }
    None
}

/// Evolves one population around the point `middle` until it converges or stagnates. Its evaluations have the
/// purpose `stage`, and `to_unit` maps its points to the unit box. Returns the reason if the ledger stopped
/// it.
pub(super) fn evolve_population<'l>(
    ledger: &'l mut Ledger<'_>,
    (stage, to_unit): (EvaluationStage, &'l ToUnit<'l>),
    middle: Vec<f64>,
    extent: PopulationExtent,
    seed: u64,
    settings: &SearchSettings,
) -> Option<StopReason> {
    let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let patience = StagnationCounter::new(settings.stagnation_generations, STAGNANT_GAIN);
    let solver = CmaEs::new(middle, settings.particles, extent, generator, patience);
    run_solver(ledger, stage, to_unit, solver, |state: GenerationState| state)
}

type GenerationState = IterState<Vec<f64>, (), (), (), (), f64>;

/// Lengths, in the unit box, of the longest principal axis of a population: `first` at the start, `last` at
/// convergence.
#[derive(Debug, Clone, Copy)]
pub(super) struct PopulationExtent {
    first: f64,
    last: f64,
}

/// Extent of a population that searches the whole unit box. Along each coordinate, three times the initial
/// length reaches from the middle to beyond the bounds. Below the final length, damped Gauss-Newton steps are
/// more efficient.
pub(super) const WIDE_EXTENT: PopulationExtent = PopulationExtent { first: 0.3, last: 0.01 };
/// Extent of a population for the neighbourhood of a point at which ripples of the cost trap Gauss-Newton
/// steps.
pub(super) const NEAR_EXTENT: PopulationExtent = PopulationExtent { first: 0.06, last: 0.003 };

/// State of a population between generations.
struct CmaEs {
    generator: Xoshiro256PlusPlus,
    points: usize,
    weights: Vec<f64>,
    rates: AdaptationRates,
    mean: DVector<f64>,
    length: f64,
    shape: DMatrix<f64>,
    /// Principal axes of the distribution as columns, each scaled by its length.
    axes: DMatrix<f64>,
    path_length: DVector<f64>,
    path_shape: DVector<f64>,
    generation: usize,
    last: f64,
    least_cost: f64,
    patience: StagnationCounter,
}

/// A step from the mean of the population, in units of `length`.
#[derive(Debug, Clone)]
struct PopulationStep {
    /// Coordinates of the step along the principal axes; they are standard normal variables.
    along: DVector<f64>,
    /// The step in coordinates of the unit box.
    inside: DVector<f64>,
}

/// Learning rates and constants of the adaptation.
struct AdaptationRates {
    effective: f64,
    length: f64,
    damping: f64,
    path: f64,
    rank_one: f64,
    rank_mu: f64,
    /// Expected length of a vector with one standard normal variable per parameter.
    expected: f64,
}

impl AdaptationRates {
    fn new(n: f64, weights: &[f64]) -> Self {
        let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let length = (effective + 2.0) / (n + effective + 5.0);
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + length;
        let path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let rank_one = 2.0 / (math::powi(n + 1.3, 2) + effective);
        let rank_mu = (1.0 - rank_one)
            .min(2.0 * (effective - 2.0 + 1.0 / effective) / (math::powi(n + 2.0, 2) + effective));
        let expected = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
        Self { effective, length, damping, path, rank_one, rank_mu, expected }
    }
}

impl CmaEs {
    /// A population of `points` points (at least 4) around the point `mean` of the unit box.
    fn new(
        mean: Vec<f64>,
        points: usize,
        extent: PopulationExtent,
        generator: Xoshiro256PlusPlus,
        patience: StagnationCounter,
    ) -> Self {
        let (n, points) = (mean.len(), points.max(4));
        let raw = |rank| math::ln((points as f64 + 1.0) / 2.0) - math::ln(rank as f64 + 1.0);
        let sum: f64 = (0..points / 2).map(raw).sum();
        let weights: Vec<f64> = (0..points / 2).map(|rank| raw(rank) / sum).collect();
        Self {
            generator,
            points,
            rates: AdaptationRates::new(n as f64, &weights),
            weights,
            mean: DVector::from_vec(mean),
            length: extent.first,
            shape: DMatrix::identity(n, n),
            axes: DMatrix::identity(n, n),
            path_length: DVector::zeros(n),
            path_shape: DVector::zeros(n),
            generation: 0,
            last: extent.last,
            least_cost: f64::INFINITY,
            patience,
        }
    }

    /// Whether the longest principal axis has shrunk to the length at convergence.
    fn has_converged(&self) -> bool {
        let longest = self.axes.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
        self.length * longest < self.last || !self.length.is_finite()
    }

    /// The point of the unit box that a step from the mean reaches.
    fn point_of(&self, step: &PopulationStep) -> Vec<f64> {
        (&self.mean + &step.inside * self.length).iter().map(|u| reflect_into_unit(*u)).collect()
    }

    fn draw_steps(&mut self) -> Vec<PopulationStep> {
        let mut draw = || {
            let normal = |_, _| self.generator.sample::<f64, _>(StandardNormal);
            let along = DVector::from_fn(self.mean.len(), normal);
            PopulationStep { inside: &self.axes * &along, along }
        };
        (0..self.points).map(|_| draw()).collect()
    }

    /// Adapts the distribution to the steps of a generation; `ranked` contains these steps from lowest to
    /// highest cost.
    fn update_distribution(&mut self, ranked: &[PopulationStep]) {
        let (n, rates) = (self.mean.len(), &self.rates);
        self.generation += 1;
        let sum = |of: fn(&PopulationStep) -> &DVector<f64>| {
            self.weights.iter().zip(ranked).fold(DVector::zeros(n), |sum, (w, step)| sum + of(step) * *w)
        };
        // C^(-1/2) times the mean step (C: covariance) is the mean step along the principal axes, rotated to
        // the coordinates of the box
        let (along, step) = (sum(|step| &step.along), sum(|step| &step.inside));
        self.mean += &step * self.length;
        let turned = self.rotate_to_box(&along);
        self.path_length = &self.path_length * (1.0 - rates.length)
            + turned * (rates.length * (2.0 - rates.length) * rates.effective).sqrt();
        let settled =
            1.0 - math::powi(1.0 - rates.length, 2 * i32::try_from(self.generation).unwrap_or(i32::MAX));
        let steady =
            self.path_length.norm() / settled.sqrt() < (1.4 + 2.0 / (n as f64 + 1.0)) * rates.expected;
        let kept = if steady { 1.0 } else { 0.0 };
        self.path_shape = &self.path_shape * (1.0 - rates.path)
            + &step * (kept * (rates.path * (2.0 - rates.path) * rates.effective).sqrt());
        let lost = (1.0 - kept) * rates.path * (2.0 - rates.path);
        let ranked = self.weights.iter().zip(ranked);
        let spread = ranked
            .fold(DMatrix::zeros(n, n), |sum, (w, step)| sum + &step.inside * step.inside.transpose() * *w);
        self.shape = &self.shape * (1.0 - rates.rank_one - rates.rank_mu + rates.rank_one * lost)
            + &self.path_shape * self.path_shape.transpose() * rates.rank_one
            + spread * rates.rank_mu;
        self.length *=
            math::exp((rates.length / rates.damping) * (self.path_length.norm() / rates.expected - 1.0))
                .min(std::f64::consts::E);
        self.decompose_shape();
    }

    /// Rotates coordinates along the principal axes to coordinates of the unit box, without scaling by the
    /// lengths of the axes.
    fn rotate_to_box(&self, along: &DVector<f64>) -> DVector<f64> {
        let mut turned = DVector::zeros(along.len());
        for (column, z) in self.axes.column_iter().zip(along.iter()) {
            let norm = column.norm();
            if norm > 0.0 {
                turned += column * (*z / norm);
            }
        }
        turned
    }

    fn decompose_shape(&mut self) {
        let symmetric = (&self.shape + self.shape.transpose()) * 0.5;
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(symmetric.clone());
        self.shape = symmetric;
        self.axes = eigenvectors * DMatrix::from_diagonal(&eigenvalues.map(|value| value.max(0.0).sqrt()));
    }
}

impl<'l, 'a> Solver<LedgerCosts<'l, 'a>, GenerationState> for CmaEs {
    fn name(&self) -> &str {
        "CMA-ES"
    }

    /// Draws and evaluates one generation of points, and adapts the distribution to the costs.
    fn next_iter(
        &mut self,
        problem: &mut Problem<LedgerCosts<'l, 'a>>,
        state: GenerationState,
    ) -> Result<(GenerationState, Option<KV>), Error> {
        let steps = self.draw_steps();
        let points: Vec<Vec<f64>> = steps.iter().map(|step| self.point_of(step)).collect();
        let costs = problem.bulk_cost(&points)?;
        let mut order: Vec<usize> = (0..points.len()).collect();
        portable_math::sort_by_number(&mut order, |a| costs[*a]);
        let ranked: Vec<_> = order.iter().map(|at| steps[*at].clone()).collect();
        self.update_distribution(&ranked);
        self.least_cost = order.first().map_or(self.least_cost, |at| self.least_cost.min(costs[*at]));
        Ok((state.cost(self.least_cost), None))
    }

    fn terminate(&mut self, _: &GenerationState) -> TerminationStatus {
        match self.has_converged() || self.patience.is_stagnant(self.least_cost) {
            true => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            false => TerminationStatus::NotTerminated,
        }
    }
}

/// Reflects a coordinate at 0 and 1 until it is in the unit interval.
fn reflect_into_unit(u: f64) -> f64 {
    let folded = u.rem_euclid(2.0);
    clamp_unit(if folded > 1.0 { 2.0 - folded } else { folded })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// The mean of a population after a number of generations on `cost`.
    fn run(cost: impl Fn(&[f64]) -> f64, generations: usize) -> Vec<f64> {
        let (generator, patience) = (Xoshiro256PlusPlus::seed_from_u64(1), StagnationCounter::new(20, 0.0));
        let mut cloud = CmaEs::new(vec![0.5; 3], 16, WIDE_EXTENT, generator, patience);
        for _ in 0..generations {
            let drawn = cloud.draw_steps();
            let mut steps: Vec<(f64, _)> =
                drawn.into_iter().map(|step| (cost(&cloud.point_of(&step)), step)).collect();
            portable_math::sort_by_number(&mut steps, |a| a.0);
            cloud.update_distribution(&steps.into_iter().map(|(_, step)| step).collect::<Vec<_>>());
        }
        cloud.mean.iter().map(|u| reflect_into_unit(*u)).collect()
    }

    #[test]
    fn a_narrow_turned_valley_is_learnt() {
        // a valley of the cost that is a hundred times longer than wide, with its long axis along (1, 1, 1)
        let minimum = [0.3, 0.35, 0.4];
        let cost = |p: &[f64]| {
            let d: Vec<f64> = p.iter().zip(minimum).map(|(a, b)| a - b).collect();
            let along = (d[0] + d[1] + d[2]) / 3.0;
            1e4 * d.iter().map(|d| (d - along).powi(2)).sum::<f64>() + along * along
        };
        let found = run(cost, 120);
        assert!(found.iter().zip(minimum).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}");
    }

    #[test]
    fn ripples_do_not_catch_it() {
        let cost = |p: &[f64]| {
            p.iter().map(|u| 100.0 * (u - 0.62).powi(2) + 1.0 - (60.0 * (u - 0.62)).cos()).sum::<f64>()
        };
        let found = run(cost, 80);
        assert!(found.iter().all(|u| (u - 0.62).abs() < 1e-3), "{found:?}");
    }

    #[test]
    fn a_minimum_on_a_side_of_the_box_is_reached() {
        let found = run(|p| p.iter().sum(), 100);
        assert!(found.iter().all(|u| *u < 1e-3), "{found:?}");
        assert_eq!([-0.25, 1.25, 2.5, 0.5].map(reflect_into_unit), [0.25, 0.75, 0.5, 0.5]);
    }
}
