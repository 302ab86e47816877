//! Damped Gauss-Newton steps: simplices crawl along a valley that is much longer than wide, and such a valley
//! is what one precise frequency and several imprecise features make.
//!
//! Levenberg's dampings are tried side by side; the Jacobian is measured by differences, corrected after
//! every step by Broyden's rule and measured again when a step gains nothing. argmin's Gauss-Newton has no
//! damping, no bounds and stops at the first failure.

use super::costs::Costs;
use super::rules::{EXACT, WORTH};
use crate::fit::evaluation::Evaluation;
use crate::fit::ledger::{Ledger, Stop};
use crate::fit::linear::{Slopes, correct, jacobian, moved, points, residuals, step};
use crate::fit::stage::Stage;
use nalgebra::DMatrix;

/// Dampings tried at every step. The first is a prior of one length of the box, negligible for any
/// informative direction; the others turn towards plain descent.
const DAMPINGS: [f64; 4] = [1.0, 3e1, 1e3, 3e4];
/// Most steps from one point: a curved valley a hundred times longer than wide takes about twenty.
const MOST_STEPS: usize = 60;

/// Where damped Gauss-Newton steps lead from `start`, and why they were stopped, if they were.
pub(super) fn gauss_newton(ledger: &mut Ledger, start: &[f64]) -> (Vec<f64>, Option<Stop>) {
    let mut costs = Costs::new(ledger, Stage::Local);
    let mut steps = Steps::from(&mut costs, start);
    for _ in 0..MOST_STEPS {
        let stop = costs.stop();
        if stop.is_some() || steps.stalled || steps.cost <= EXACT {
            return (steps.unit, stop);
        }
        steps.next(&mut costs);
    }
    (steps.unit, None)
}

/// Steps in the unit box until one from a measured Jacobian gains less than [`WORTH`].
struct Steps {
    unit: Vec<f64>,
    cost: f64,
    model: Option<DMatrix<f64>>,
    fresh: bool,
    stalled: bool,
}

impl Steps {
    fn from(costs: &mut Costs, start: &[f64]) -> Self {
        let cost = costs.of_one(start.to_vec());
        Self { unit: start.to_vec(), cost, model: None, fresh: false, stalled: false }
    }

    fn next(&mut self, costs: &mut Costs) {
        let before = residuals_at(costs, &self.unit);
        let mut model = self.model.take().unwrap_or_else(|| self.measure(costs));
        if self.stalled || before.len() != model.nrows() {
            self.stalled = true;
            return;
        }
        let trials: Vec<Vec<f64>> = DAMPINGS
            .iter()
            .filter_map(|damping| step(&model, &before, *damping, None))
            .map(|step| moved(&self.unit, &step))
            .collect();
        let tried = costs.of(&trials);
        let best = trials.into_iter().zip(tried).min_by(|a, b| a.1.total_cmp(&b.1));
        let gained = best.filter(|(_, found)| *found < self.cost);
        let gain = gained.as_ref().map_or(0.0, |(_, found)| self.cost - found);
        if gain <= WORTH {
            (self.stalled, self.fresh) = (self.fresh, false);
        }
        let Some((point, found)) = gained else { return };
        if gain > WORTH {
            let taken: Vec<f64> = point.iter().zip(&self.unit).map(|(to, from)| to - from).collect();
            correct(&mut model, &before, &residuals_at(costs, &point), &taken);
            (self.model, self.fresh) = (Some(model), false);
        }
        (self.unit, self.cost) = (point, found);
    }

    /// The Jacobian by differences; it stalls where they cannot be evaluated.
    fn measure(&mut self, costs: &mut Costs) -> DMatrix<f64> {
        costs.of(&points(&self.unit));
        let ledger = costs.ledger();
        let found = || {
            let around: Option<Vec<&Evaluation>> =
                points(&self.unit).iter().map(|point| ledger.find(point)).collect();
            let (centre, objective) = (ledger.find(&self.unit)?, ledger.objective());
            let slopes = Slopes::of(objective.targets(), centre, &around?);
            Some(jacobian(objective, centre, &slopes))
        };
        let found = found();
        (self.fresh, self.stalled) = (true, found.is_none());
        found.unwrap_or_else(|| DMatrix::zeros(0, self.unit.len()))
    }
}

/// Residuals at a point; none where it cannot be evaluated.
fn residuals_at(costs: &mut Costs, unit: &[f64]) -> Vec<Option<f64>> {
    costs.of(&[unit.to_vec()]);
    let ledger = costs.ledger();
    ledger.find(unit).map_or_else(Vec::new, |found| residuals(ledger.objective(), found))
}
