use super::*;
use crate::feature::LengthCalibration;
use crate::fit::bounds::{Bounds, BoundsSpacing};
use crate::fit::evaluation::Evaluation;
use crate::fit::evaluation::RunFailure;
use crate::fit::job::FreeParameter;
use crate::fit::linear_model::{FeatureSlopes, camera_estimates, difference_points, jacobian, residuals};
use crate::fit::model::FeaturePredictor;
use crate::fit::objective::Objective;

const FREE: TargetCalibration = TargetCalibration {
    condition: 0,
    scale_sd: 0.005,
    offset_sd_m: 1e-3,
    length: LengthCalibration::Position,
};
const SIZE: TargetCalibration =
    TargetCalibration { length: LengthCalibration::Size { floor_m: 0.0 }, ..FREE };

/// A target whose standard deviation is `sd_relative` times its value.
fn target(value: f64, sd_relative: f64, calibration: Option<TargetCalibration>) -> TargetValue {
    let sd = sd_relative * value.abs();
    let (name, measure) = (value.to_string(), ValueComparison::Log);
    TargetValue { name, value, sd, scatter: 0.0, measure, last: false, calibration }
}

fn observed(values: &[f64]) -> Vec<Observed> {
    values.iter().map(|value| Observed::from_value(*value)).collect()
}

/// Targets and features for three positions and a size. The features are the true values; the targets are the
/// values that a camera with the scale and offset `numbers` shows.
fn filmed(numbers: [f64; 2], sd_relative: f64) -> (Vec<TargetValue>, Vec<Observed>) {
    let model = [3e-3, -2e-3, 6e-3, 1e-3];
    let of = [FREE, FREE, FREE, SIZE];
    let [scale, offset_m] = numbers;
    let shown = [
        (1.0 + scale) * 3e-3 + offset_m,
        (1.0 + scale) * -2e-3 + offset_m,
        (1.0 + scale) * 6e-3 + offset_m,
        (1.0 + scale) * 1e-3,
    ];
    let targets = shown.iter().zip(of).map(|(value, of)| target(*value, sd_relative, Some(of)));
    (targets.collect(), observed(&model))
}

#[test]
fn a_known_offset_and_scale_are_given_back_and_meet_everything() {
    for numbers in [[0.004, 0.7e-3], [-0.006, -1.2e-3], [0.0, 0.0], [0.01, 3e-3]] {
        let (targets, features) = filmed(numbers, 1e-6);
        let cameras = CameraFit::estimate(&targets, &features);
        let found = cameras.0[0].scale_and_offset();
        assert!((found[0] - numbers[0]).abs() < 1e-7 && (found[1] - numbers[1]).abs() < 1e-9, "{found:?}");
        for (target, feature) in targets.iter().zip(&features) {
            let shown = cameras.apply(target, feature.observation().unwrap());
            assert!(residual(&shown, target).abs() < 0.1, "{shown:?} {target:?}");
        }
    }
}

#[test]
fn an_offset_of_seven_prior_deviations_is_not_taken_for_missed_features() {
    let (targets, features) = filmed([0.0, 7e-3], 0.01);
    let places: Vec<f64> = CameraFit::estimate(&targets, &features).prior_residuals().collect();
    assert!((places[1] - 7.0).abs() < 0.1, "{places:?}");
    // with a single position, the cost has another minimum at an offset of 2.6 prior standard deviations,
    // where the residual of the position is large
    let alone = [target(12e-3, 0.01, Some(FREE))];
    let places: Vec<f64> = CameraFit::estimate(&alone, &observed(&[5e-3])).prior_residuals().collect();
    assert!((places[1] - 7.0).abs() < 0.1, "{places:?}");
}

#[test]
fn a_single_length_is_met_by_what_is_likeliest() {
    // ln(shown / target) = z_scale 0.005 + ln(1 + z_offset 1e-3 / 5e-3): the offset explains almost all of
    // this deviation
    let targets = [target(5.5e-3, 0.01, Some(FREE))];
    let places: Vec<f64> = CameraFit::estimate(&targets, &observed(&[5e-3])).prior_residuals().collect();
    assert!((places[1] - 0.5).abs() < 0.01 && places[0] > 0.0 && places[0] < 0.02, "{places:?}");
    let cost = |z: f64| {
        let shown = FREE.apply(5e-3, [0.005 * places[0], 1e-3 * (places[1] + z)]);
        (target(5.5e-3, 0.01, None).distance(shown) / 0.01).powi(2) + (places[1] + z).powi(2)
    };
    assert!(cost(0.0) < cost(1e-3) && cost(0.0) < cost(-1e-3));
}

#[test]
fn held_numbers_are_none_and_missing_features_move_nothing() {
    let held = TargetCalibration { scale_sd: 0.0, ..SIZE };
    assert_eq!(
        CameraFit::estimate(&[target(5e-3, 0.01, Some(held))], &observed(&[4e-3])).count_unknowns(),
        0
    );
    let lost = [Observed::Missing("lost".to_owned())];
    let cameras = CameraFit::estimate(&[target(5e-3, 0.01, Some(FREE))], &lost);
    assert_eq!(cameras.prior_residuals().collect::<Vec<_>>(), [0.0, 0.0]);
    let other = TargetCalibration { condition: 1, ..FREE };
    let of_two = [target(5e-3, 0.01, Some(FREE)), target(5e-3, 0.01, Some(other))];
    let places: Vec<f64> = CameraFit::estimate(&of_two, &observed(&[5e-3, 4e-3])).prior_residuals().collect();
    assert_eq!((places.len(), &places[..2]), (4, &[0.0, 0.0][..]), "each recording has a camera of its own");
    assert!(places[3] > 0.5);
}

#[test]
fn what_a_floor_adds_has_no_scale() {
    let level = TargetCalibration { length: LengthCalibration::Size { floor_m: 3e-6 }, ..FREE };
    let shown = level.apply(5e-6, [0.1, 0.0]);
    assert!((shown - (4.4e-6_f64).hypot(3e-6)).abs() < 1e-15);
    let step = 1e-6;
    let slope = (level.apply(5e-6, [0.1 + step, 0.0]) - level.apply(5e-6, [0.1 - step, 0.0])) / (2.0 * step);
    assert!((level.derivatives(5e-6, [0.1, 0.0])[0] / slope - 1.0).abs() < 1e-8);
    assert_eq!(level.apply(2e-6, [0.1, 0.0]), 3e-6, "noise below its floor");
}

/// A model with the lengths `p`, `-p q` and `q`, in units of 5 mm, and the frequency `p q`.
struct LengthPredictor;

impl FeaturePredictor for LengthPredictor {
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        let (p, q) = (values[0], values[1]);
        Ok(observed(&[5e-3 * p, -5e-3 * p * q, 5e-3 * q, p * q]))
    }

    fn simulate_twin(&self, values: &[f64], _: u64) -> Result<Vec<Observed>, RunFailure> {
        self.predict_features(values)
    }
}

fn objective() -> Objective<'static> {
    let axes = vec![FreeParameter::from(Bounds::new(0.5, 2.0, BoundsSpacing::Log).unwrap()); 2];
    let targets = vec![
        target(5.4e-3, 0.02, Some(FREE)),
        target(-4.8e-3, 0.01, Some(FREE)),
        target(5.2e-3, 0.015, Some(FREE)),
        target(1.01, 0.01, None),
    ];
    Objective::new(axes, targets, &LengthPredictor)
}

/// The evaluation at the point `unit`, with the slopes of the features, the residuals and the Jacobian there.
fn local(objective: &Objective, unit: &[f64]) -> (Evaluation, FeatureSlopes, Vec<f64>, DMatrix<f64>) {
    let centre = objective.evaluate(unit);
    let around: Vec<Evaluation> =
        difference_points(unit).iter().map(|point| objective.evaluate(point)).collect();
    let slopes =
        FeatureSlopes::from_differences(objective.targets(), &centre, &around.iter().collect::<Vec<_>>());
    let rows = residuals(objective, &centre).into_iter().flatten().collect();
    let model = jacobian(objective, &centre, &slopes);
    (centre, slopes, rows, model)
}

#[test]
fn residuals_give_the_cost_and_the_linear_model_its_slope() {
    let objective = objective();
    // points near the minimum, and points at which some residuals exceed `LOSS_KNEE`
    for unit in [[0.5, 0.5], [0.52, 0.47], [0.6, 0.45]] {
        let (centre, _, rows, model) = local(&objective, &unit);
        assert_eq!((rows.len(), model.nrows()), (6, 6));
        assert!((rows.iter().map(|r| robust_loss(*r)).sum::<f64>() / centre.cost - 1.0).abs() < 1e-9);
        for axis in 0..2 {
            let predicted: f64 = rows
                .iter()
                .enumerate()
                .map(|(row, r)| 2.0 * robust_weight(*r) * r * model[(row, axis)])
                .sum();
            let at = |step: f64| {
                let mut unit = unit;
                unit[axis] += step;
                objective.evaluate(&unit).cost
            };
            let measured = (at(1e-4) - at(-1e-4)) / 2e-4;
            assert!((predicted - measured).abs() < 2e-3 * (1.0 + measured.abs()), "{predicted} {measured}");
        }
    }
}

#[test]
fn an_unknown_offset_takes_away_what_it_can_explain() {
    // near its minimum the cost is a parabola whose curvature follows from the projected Jacobian
    let objective = objective();
    let (_, _, _, model) = local(&objective, &[0.5, 0.5]);
    let cost = |a: f64, b: f64| objective.evaluate(&[0.5 + a, 0.5 + b]).cost;
    let h = 2e-3;
    let measured = (cost(h, 0.0) + cost(-h, 0.0) - 2.0 * cost(0.0, 0.0)) / (h * h);
    let predicted = 2.0 * model.column(0).norm_squared();
    assert!((predicted / measured - 1.0).abs() < 0.1, "{predicted} {measured}");
    let held: Vec<TargetValue> =
        objective.targets().iter().map(|t| TargetValue { calibration: None, ..t.clone() }).collect();
    let held = Objective::new(objective.axes().to_vec(), held, &LengthPredictor);
    let without = local(&held, &[0.5, 0.5]).3;
    assert_eq!(without.nrows(), 4);
    assert!(model.column(0).norm_squared() < 0.8 * without.column(0).norm_squared());
}

#[test]
fn the_interval_of_an_offset_is_that_of_least_squares() {
    // if only the offset is unknown and one position is measured, 1 / sd^2 = 1 + (1e-3 / 5e-3 / 0.02)^2
    let alone = TargetCalibration { scale_sd: 0.0, ..FREE };
    let axes = vec![FreeParameter::from(Bounds::new(0.5, 2.0, BoundsSpacing::Log).unwrap()); 2];
    let objective = |targets| Objective::new(axes.clone(), targets, &LengthPredictor);
    let unmoved = |sd| vec![target(1.0, sd, None); 3];
    let of = |first: TargetValue| {
        let targets = [vec![first], unmoved(1e9)].concat();
        let objective = objective(targets);
        let (centre, _, _, _) = local(&objective, &[0.5, 0.5]);
        let still = FeatureSlopes(vec![vec![Some(0.0); 2]; 4]);
        let found = camera_estimates(&objective, &centre, Some(&still));
        assert_eq!(camera_estimates(&objective, &centre, None)[0].half_95, None);
        found
    };
    let found = of(target(5e-3, 0.02, Some(alone)));
    let expected = 1.96 * 1e-3 / (1.0_f64 + (0.2_f64 / 0.02).powi(2)).sqrt();
    assert_eq!((found.len(), found[0].name, found[0].condition), (1, "offset_x_m", 0));
    assert!((found[0].half_95.unwrap() / expected - 1.0).abs() < 1e-9, "{found:?}");
}

#[test]
fn cameras_of_twins_scatter_as_their_priors_and_are_common_to_their_features() {
    let targets = [target(5e-3, 0.01, Some(FREE)), target(5e-3, 0.01, Some(FREE)), target(1.0, 0.01, None)];
    let features = observed(&[5e-3, -5e-3, 2.0]);
    let draws: Vec<Vec<f64>> = (1..=4000)
        .map(|draw| {
            draw_camera_errors(&targets, &features, draw).iter().filter_map(Observed::value).collect()
        })
        .collect();
    let sd = |of: &dyn Fn(&Vec<f64>) -> f64| {
        (draws.iter().map(|d| of(d).powi(2)).sum::<f64>() / draws.len() as f64).sqrt()
    };
    assert!((sd(&|d| 0.5 * (d[0] + d[1])) / 1e-3 - 1.0).abs() < 0.05, "the offset");
    assert!((sd(&|d| (d[0] - d[1]) / 1e-2 - 1.0) / 0.005 - 1.0).abs() < 0.05, "the scale");
    assert!(draws.iter().all(|d| d[2] == 2.0));
    assert_eq!(draw_camera_errors(&targets, &features, 3), draw_camera_errors(&targets, &features, 3));
}
