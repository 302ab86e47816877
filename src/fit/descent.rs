//! Damped Gauss-Newton steps from the best point: simplices crawl along a valley that is much longer than wide, and such a
//! valley is what one precise frequency beside imprecise features makes.
//!
//! Levenberg, Quart. Appl. Math. 2 (1944) 164, with the weights `min(1, KNEE / |r|)` that belong to the cost (Huber).

use super::journal::Stage;
use super::ledger::{Ledger, Stop};
use super::objective::{Evaluation, KNEE, Objective, residual};
use super::scale::clamp_unit;
use super::uncertainty::{jacobian, points, slopes};
use nalgebra::{DMatrix, DVector};

/// Dampings tried at every step. The first is a prior of one length of the box, negligible for any informative direction;
/// the others turn towards plain descent.
const DAMPINGS: [f64; 7] = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6];
/// Longest step in the unit box: the linear model does not hold farther.
const LONGEST: f64 = 0.2;
/// Most steps from one point: a curved valley a hundred times longer than wide takes about twenty.
const STEPS: usize = 40;

/// Steps until one gains less than `worth`.
///
/// # Errors
/// [`Stop`] when the evaluations are used up or may not go on.
pub fn descend(ledger: &mut Ledger, objective: &Objective, worth: f64) -> Result<(), Stop> {
    for _ in 0..STEPS {
        let Some(best) = ledger.best().filter(|best| best.failure.is_none()).cloned() else { return Ok(()) };
        let around: Vec<Evaluation> = ledger.evaluate(Stage::Local, &points(&best.unit))?.into_iter().cloned().collect();
        ledger.evaluate(Stage::Local, &trials(objective, &best, &around.iter().collect::<Vec<_>>()))?;
        if ledger.best().is_none_or(|now| best.cost - now.cost <= worth) {
            return Ok(());
        }
    }
    Ok(())
}

/// One point for each damping.
fn trials(objective: &Objective, best: &Evaluation, around: &[&Evaluation]) -> Vec<Vec<f64>> {
    let targets = objective.targets();
    let mut matrix = jacobian(targets, best, &slopes(targets.len(), best, around));
    let mut right = DVector::zeros(matrix.nrows());
    for (row, (feature, target)) in best.features.iter().zip(targets).enumerate() {
        let r = feature.value().map_or(0.0, |value| residual(value, target));
        let weight = (KNEE / r.abs().max(KNEE)).sqrt();
        matrix.row_mut(row).scale_mut(weight);
        right[row] = -weight * r;
    }
    DAMPINGS
        .iter()
        .filter_map(|damping| step(&matrix, &right, *damping))
        .map(|step| best.unit.iter().zip(&step).map(|(u, d)| clamp_unit(u + d)).collect())
        .collect()
}

/// Solves `(J^T J + damping) d = J^T b` and shortens it to [`LONGEST`].
fn step(matrix: &DMatrix<f64>, right: &DVector<f64>, damping: f64) -> Option<Vec<f64>> {
    let mut normal = matrix.transpose() * matrix;
    for at in 0..normal.nrows() {
        normal[(at, at)] += damping;
    }
    let solution = normal.cholesky()?.solve(&(matrix.transpose() * right));
    let longest = solution.amax();
    let shorten = if longest > LONGEST { LONGEST / longest } else { 1.0 };
    longest.is_finite().then(|| solution.iter().map(|d| d * shorten).collect())
}
