//! Parametric bootstrap: recordings that are simulated with the best model (twins) are measured like the real
//! recording and fitted again, starting from the best point (Efron and Tibshirani, An Introduction to the
//! Bootstrap, 1993, chapter 6).
//!
//! The spread of the refits contains the standard deviations of the targets and, in addition, the joint
//! effect of noise, lost frames and starting state on the features of this blade. The camera errors of each
//! twin are drawn from their priors. A refit takes damped Gauss-Newton steps from the best point. It uses the
//! Jacobian at the best point and corrects it by Broyden's rule. The spread of the refits is measured about
//! the best point, so it includes the bias.

use super::camera_calibration::draw_camera_errors;
use super::evaluation::{Evaluation, EvaluationStage, Observed};
use super::journal::StopReason;
use super::ledger::Ledger;
use super::linear_model::{broyden_update, damped_step, residuals_against, step_in_box};
use super::objective::Objective;
use super::target_value::TargetValue;
use nalgebra::DMatrix;
use portable_math as math;
use rayon::prelude::*;

/// Number of Gauss-Newton steps of a refit. A few suffice, because the features of a twin differ from those
/// of the best point by only a few standard deviations, and the linear model is accurate there.
const REFIT_STEPS: usize = 3;
/// Damping of a refit. It acts as a prior whose standard deviation is the side length of the unit box, and is
/// negligible in any direction that the features determine.
const REFIT_DAMPING: f64 = 1.0;
/// Minimum number of refits from which a spread is computed.
pub(crate) const MIN_TWINS: usize = 8;

/// Result of the refits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bootstrap {
    /// Points of the unit box at which the refits end, one per twin that could be simulated.
    pub refits: Vec<Vec<f64>>,
    /// Standard deviation of each feature over the twins, in the unit of the feature; `None` if fewer than
    /// two twins show the feature.
    pub feature_sd: Vec<Option<f64>>,
}

impl Bootstrap {
    /// Root mean square distance of the refits from the best point along one coordinate of the unit box;
    /// `None` with fewer than [`MIN_TWINS`] refits.
    pub(crate) fn refit_spread(&self, axis: usize, best: f64) -> Option<f64> {
        let places: Vec<f64> = self.refits.iter().filter_map(|unit| unit.get(axis).copied()).collect();
        let mean_square = places.iter().map(|u| math::powi(u - best, 2)).sum::<f64>() / places.len() as f64;
        (places.len() >= MIN_TWINS).then(|| mean_square.sqrt())
    }
}

/// Simulates `twins` recordings with the parameters of `best` and fits each of them; `jacobian` is the
/// Jacobian at `best`.
///
/// # Errors
/// [`StopReason`] when the evaluations are used up or the fit must stop.
pub(crate) fn bootstrap_refits(
    ledger: &mut Ledger,
    best: &Evaluation,
    jacobian: &DMatrix<f64>,
    twins: usize,
) -> Result<Bootstrap, StopReason> {
    let objective = ledger.objective();
    let draws: Vec<u64> = (1..=twins as u64).collect();
    let made: Vec<Option<Vec<Observed>>> =
        draws.par_iter().map(|draw| objective.simulate_twin(&best.values, *draw).ok()).collect();
    let seen: Vec<&Vec<Observed>> = made.iter().flatten().collect();
    let feature_sd = (0..objective.targets().len()).map(|at| standard_deviation(&seen, at)).collect();
    let refit = |(twin, draw): (&Option<Vec<Observed>>, &u64)| {
        let filmed = draw_camera_errors(objective.targets(), twin.as_ref()?, *draw);
        Some(Refit::new(objective, &filmed, best, jacobian))
    };
    let mut refits: Vec<Refit> = made.iter().zip(&draws).filter_map(refit).collect();
    for _ in 0..REFIT_STEPS {
        let points: Vec<Vec<f64>> = refits.iter().filter_map(Refit::next_point).collect();
        ledger.evaluate_points(EvaluationStage::Bootstrap, &points)?;
        for refit in &mut refits {
            if let Some(found) = refit.next_point().and_then(|point| ledger.find_evaluation(&point)) {
                refit.accept_step(found.clone(), objective);
            }
        }
    }
    Ok(Bootstrap { refits: refits.into_iter().map(|refit| refit.unit).collect(), feature_sd })
}

fn standard_deviation(seen: &[&Vec<Observed>], feature: usize) -> Option<f64> {
    let values: Vec<f64> = seen.iter().filter_map(|twin| twin.get(feature)?.value()).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let sum: f64 = values.iter().map(|v| math::powi(v - mean, 2)).sum();
    (values.len() > 1).then(|| (sum / (values.len() - 1) as f64).sqrt())
}

/// A twin that is being fitted again.
struct Refit {
    targets: Vec<TargetValue>,
    unit: Vec<f64>,
    residuals: Vec<Option<f64>>,
    model: DMatrix<f64>,
    done: bool,
}

impl Refit {
    fn new(objective: &Objective, twin: &[Observed], best: &Evaluation, jacobian: &DMatrix<f64>) -> Self {
        let target = |(target, seen): (&TargetValue, &Observed)| TargetValue {
            value: seen.value().unwrap_or(f64::NAN),
            ..target.clone()
        };
        let targets: Vec<TargetValue> = objective.targets().iter().zip(twin).map(target).collect();
        let residuals = residuals_against(objective.axes(), &targets, best);
        Self { targets, unit: best.unit.clone(), residuals, model: jacobian.clone(), done: false }
    }

    fn next_point(&self) -> Option<Vec<f64>> {
        if self.done {
            return None;
        }
        let step = damped_step(&self.model, &self.residuals, REFIT_DAMPING, None)?;
        Some(step_in_box(&self.unit, &step))
    }

    fn accept_step(&mut self, found: Evaluation, objective: &Objective) {
        let after = residuals_against(objective.axes(), &self.targets, &found);
        let size = |residuals: &[Option<f64>]| {
            residuals.iter().flatten().map(|r| super::objective::robust_loss(*r)).sum::<f64>()
        };
        if found.failure.is_some() || size(&after) >= size(&self.residuals) {
            self.done = true;
            return;
        }
        let taken: Vec<f64> = found.unit.iter().zip(&self.unit).map(|(to, from)| to - from).collect();
        broyden_update(&mut self.model, &self.residuals, &after, &taken);
        (self.unit, self.residuals) = (found.unit, after);
    }
}
