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

/// A valley `q = p^2` that is bent and narrow: the other parameter has to follow far.
impl Predict for Curved {
    fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        Ok(vec![Observed::of(values[0]), Observed::of(values[1] / values[0].powi(2))])
    }

    fn twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
        self.predict(values)
    }
}

#[test]
fn the_floor_of_a_narrow_valley_is_found_in_few_evaluations() {
    let target = |name: &str, sd| Target {
        name: name.to_owned(),
        value: 1.0,
        sd,
        scatter: 0.0,
        measure: Measure::Log,
        last: false,
    };
    let axes = vec![Axis::from(Bounds::new(0.01, 100.0, Spacing::Log).unwrap()); 2];
    let objective = Objective::new(axes, vec![target("p", 0.2), target("q / p^2", 0.001)], &Curved);
    let (mut journal, mut watch) = (Discard, |_: &Progress| ControlFlow::Continue(()));
    let mut ledger = Ledger::new(&objective, &[], &mut journal, &mut watch, usize::MAX);
    let best = objective.evaluate(&[0.5, 0.5]);
    ledger.evaluate(Stage::Local, std::slice::from_ref(&best.unit)).unwrap();
    let around: Vec<Evaluation> =
        ledger.evaluate(Stage::Sensitivity, &points(&best.unit)).unwrap().into_iter().cloned().collect();
    let slopes = Slopes::of(objective.targets(), &best, &around.iter().collect::<Vec<_>>());
    let found = profiles(&mut ledger, &best, &jacobian(&objective, &best, &slopes), 3.84).unwrap();
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
    assert!(ledger.run().len() < 80, "{}", ledger.run().len());
}
