use super::super::axis::Axis;
use super::super::evaluation::Observed;
use super::super::failure::RunFailure;
use super::super::ledger::Progress;
use super::super::linear::{Slopes, jacobian, points};
use super::super::model::Predict;
use super::super::objective::Objective;
use super::super::scale::{Bounds, Spacing};
use super::super::target::Target;
use super::*;
use crate::feature::Measure;
use crate::journal::Discard;
use std::ops::ControlFlow;

struct Curved;

/// A valley along `p` with a ridge across it: the cost rises above the threshold and falls again behind it.
struct Ridged;

impl Predict for Ridged {
    fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        let p = values[0].ln();
        let ridge = 0.9 * (-((p - 0.5) / 0.05).powi(2)).exp();
        Ok(vec![Observed::of((p + ridge).exp()), Observed::of(values[1])])
    }

    fn twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
        self.predict(values)
    }
}

/// A valley `q = p^2` that is bent and narrow: the other parameter has to follow far.
impl Predict for Curved {
    fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        Ok(vec![Observed::of(values[0]), Observed::of(values[1] / values[0].powi(2))])
    }

    fn twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
        self.predict(values)
    }
}

/// Profiles of two parameters about 1 by two features with these deviations, and the evaluations of the fit;
/// `met` is known before.
fn walked(model: &dyn Predict, sds: [f64; 2], met: &[Vec<f64>]) -> (Vec<Profile>, usize) {
    let target = |sd| Target {
        name: format!("sd {sd}"),
        value: 1.0,
        sd,
        scatter: 0.0,
        measure: Measure::Log,
        last: false,
        calibration: None,
    };
    let axes = vec![Axis::from(Bounds::new(0.01, 100.0, Spacing::Log).unwrap()); 2];
    let objective = Objective::new(axes, sds.map(target).to_vec(), model);
    let (mut journal, mut watch) = (Discard, |_: &Progress| ControlFlow::Continue(()));
    let mut ledger = Ledger::new(&objective, &[], &mut journal, &mut watch, usize::MAX);
    let best = objective.evaluate(&[0.5, 0.5]);
    ledger.evaluate(Stage::Local, &[met, std::slice::from_ref(&best.unit)].concat()).unwrap();
    let around: Vec<Evaluation> =
        ledger.evaluate(Stage::Sensitivity, &points(&best.unit)).unwrap().into_iter().cloned().collect();
    let slopes = Slopes::of(objective.targets(), &best, &around.iter().collect::<Vec<_>>());
    let found = profiles(&mut ledger, &best, &jacobian(&objective, &best, &slopes), 3.84).unwrap();
    (found, ledger.run().len())
}

#[test]
fn a_ridge_in_the_cost_does_not_end_a_profile() {
    let length = 1e4_f64.ln();
    let (found, _) = walked(&Ridged, [0.5, 0.01], &[]);
    let half = 3.84_f64.sqrt() * 0.5 / length;
    assert!((found[0].upper.unwrap() - 0.5 - half).abs() < 0.03 * half, "{:?}", found[0]);
    // a point of the fit behind a wide ridge is walked on from
    let far = vec![0.5 + 0.95 * half, 0.5];
    let (found, _) = walked(&Ridged, [0.5, 0.01], &[far]);
    assert!((found[0].upper.unwrap() - 0.5 - half).abs() < 0.03 * half, "{:?}", found[0]);
}

#[test]
fn the_floor_of_a_narrow_valley_is_found_in_few_evaluations() {
    let (found, evaluations) = walked(&Curved, [0.2, 0.001], &[]);
    let length = 1e4_f64.ln();
    for (profile, slope) in found.iter().zip([1.0, 2.0]) {
        // along p the rise is (ln p / 0.2)^2; along q it is nearly (ln q / 2 / 0.2)^2
        for (u, cost) in &profile.points {
            let expected = ((u - 0.5) * length / slope / 0.2).powi(2);
            assert!(
                (cost - expected).abs() < 0.02 * expected.max(0.5),
                "at {u}: {cost}, expected {expected}"
            );
        }
        let half = 3.84_f64.sqrt() * 0.2 * slope / length;
        assert!(
            (profile.upper.unwrap() - 0.5 - half).abs() < 0.02 * half
                && (0.5 - profile.lower.unwrap() - half).abs() < 0.02 * half,
            "{profile:?}"
        );
    }
    assert!(evaluations < 110, "{evaluations}");
}
