use super::super::checkpoint::FitHeader;
use super::super::context::FitContext;
use super::super::evaluation::Observed;
use super::super::journal::{FitProgress, Journal};
use super::super::model::FeaturePredictor;
use super::super::objective::Objective;
use super::*;
use crate::checkpoint::NullSink;
use crate::feature::ValueComparison;
use crate::fit::bounds::{Bounds, BoundsSpacing};
use crate::fit::evaluation::RunFailure;
use crate::fit::job::FreeParameter;
use crate::fit::linear_model::{FeatureSlopes, difference_points, jacobian};
use crate::fit::target_value::TargetValue;
use std::ops::ControlFlow;

struct CurvedPredictor;

/// A model whose cost has a valley along `p` with a ridge across it: along `p` the cost exceeds the threshold
/// and then falls again.
struct RidgedPredictor;

impl FeaturePredictor for RidgedPredictor {
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        let p = values[0].ln();
        let ridge = 0.9 * (-((p - 0.5) / 0.05).powi(2)).exp();
        Ok(vec![Observed::from_value((p + ridge).exp()), Observed::from_value(values[1])])
    }

    fn simulate_twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
        self.predict_features(values)
    }
}

/// A model whose cost has a narrow bent valley `q = p^2`: the profile of one parameter has to move the other
/// parameter far.
impl FeaturePredictor for CurvedPredictor {
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        Ok(vec![Observed::from_value(values[0]), Observed::from_value(values[1] / values[0].powi(2))])
    }

    fn simulate_twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
        self.predict_features(values)
    }
}

/// Returns the profiles of two parameters, whose best values are 1, and the number of evaluations. Two
/// features with the standard deviations `sds` are fitted. The points `met` are evaluated before the
/// profiles.
fn walked(model: &dyn FeaturePredictor, sds: [f64; 2], met: &[Vec<f64>]) -> (Vec<ProfileLikelihood>, usize) {
    let target = |sd| TargetValue {
        name: format!("sd {sd}"),
        value: 1.0,
        sd,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let axes = vec![FreeParameter::from(Bounds::new(0.01, 100.0, BoundsSpacing::Log).unwrap()); 2];
    let objective = Objective::new(axes, sds.map(target).to_vec(), model);
    let (mut journal, mut watch) = (NullSink, |_: &FitProgress| ControlFlow::Continue(()));
    let journal = Journal::new(&FitContext::default(), FitHeader::default(), &mut journal, &mut watch);
    let mut ledger = Ledger::new(&objective, journal.unwrap());
    let best = objective.evaluate(&[0.5, 0.5]);
    ledger
        .evaluate_points(EvaluationStage::Local, &[met, std::slice::from_ref(&best.unit)].concat())
        .unwrap();
    let around: Vec<Evaluation> = ledger
        .evaluate_points(EvaluationStage::Sensitivity, &difference_points(&best.unit))
        .unwrap()
        .into_iter()
        .cloned()
        .collect();
    let slopes =
        FeatureSlopes::from_differences(objective.targets(), &best, &around.iter().collect::<Vec<_>>());
    let found = profile_parameters(&mut ledger, &best, &jacobian(&objective, &best, &slopes), 3.84).unwrap();
    (found, ledger.run_evaluations().len())
}

#[test]
fn a_ridge_in_the_cost_does_not_end_a_profile() {
    let length = 1e4_f64.ln();
    let (found, _) = walked(&RidgedPredictor, [0.5, 0.01], &[]);
    let half = 3.84_f64.sqrt() * 0.5 / length;
    assert!((found[0].upper.unwrap() - 0.5 - half).abs() < 0.03 * half, "{:?}", found[0]);
    // the walk continues from an evaluated point on the far side of a wide ridge
    let far = vec![0.5 + 0.95 * half, 0.5];
    let (found, _) = walked(&RidgedPredictor, [0.5, 0.01], &[far]);
    assert!((found[0].upper.unwrap() - 0.5 - half).abs() < 0.03 * half, "{:?}", found[0]);
}

#[test]
fn the_floor_of_a_narrow_valley_is_found_in_few_evaluations() {
    let (found, evaluations) = walked(&CurvedPredictor, [0.2, 0.001], &[]);
    let length = 1e4_f64.ln();
    for (profile, slope) in found.iter().zip([1.0, 2.0]) {
        // the rise in cost is (ln p / 0.2)^2 along p and nearly (ln q / 2 / 0.2)^2 along q
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
