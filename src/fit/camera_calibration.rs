//! Calibration errors of cameras and their effect on features.
//!
//! A camera measures a deflection `d` as `(1 + scale) * d + offset`: the scale is known only to half a
//! percent, and a marker is never exactly on the hinge. Scale and offset are unknowns with priors, common to
//! all features of a recording. Their effect is computed without a run of the model, so they are not
//! parameters of the search. At every point of the search, `CameraFit::estimate` chooses the values that
//! minimise the cost, and the Jacobian is projected onto the complement of their derivatives (variable
//! projection, Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413, in the form of Kaufman, BIT 15 (1975)
//! 49).

use super::evaluation::{Observation, Observed};
use super::objective::{LOSS_KNEE, residual, robust_loss, total_sd};
use super::target_value::{MAX_RATIO, TargetValue};
use crate::feature::ValueComparison;
use crate::fit::target_value::TargetCalibration;
use nalgebra::{DMatrix, Matrix2, Vector2};
use portable_math as math;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Maximum number of Gauss-Newton steps. From a few standard deviations away, three steps converge to
/// rounding error; from far away, a dozen.
const MAX_STEPS: usize = 60;
/// Maximum number of halvings of a step that raises the cost.
const MAX_HALVINGS: usize = 12;
/// Length of a step, in prior standard deviations, below which the descent ends.
const MIN_STEP: f64 = 1e-12;
/// Difference between the random seeds of successive cameras. It is so large that no two draws use the same
/// random numbers.
const CAMERA_SEEDS: u64 = 1 << 40;
/// Variance of a uniform variable in the unit interval.
const BOX_VARIANCE: f64 = 1.0 / 12.0;

/// Estimated scale or offset of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CameraEstimate {
    /// Index of the condition to which the camera belongs, from 0.
    pub condition: usize,
    /// Name of the scale or offset in a result.
    pub name: &'static str,
    /// Standard deviation of the prior of this number, in the unit that `name` states; the mean of the prior
    /// is 0.
    pub prior_sd: f64,
    /// Estimated value, in the unit that `name` states.
    pub estimate: f64,
    /// Half width of the 95 % interval by the linear model, in the unit of `estimate`; `None` without a
    /// linear model.
    pub half_95: Option<f64>,
}

/// The camera of a condition: prior standard deviations of scale and offset, and the estimated values divided
/// by these standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ConditionCamera {
    condition: usize,
    sds: [f64; 2],
    place: [f64; 2],
}

impl ConditionCamera {
    fn scale_and_offset(&self) -> [f64; 2] {
        [self.sds[0] * self.place[0], self.sds[1] * self.place[1]]
    }
}

/// Names of the scale and the offset of a camera in a result.
const CAMERA_NUMBER_NAMES: [&str; 2] = ["scale_relative", "offset_x_m"];

/// The cameras of the targets, with the scales and offsets that minimise the cost of the features.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraFit(Vec<ConditionCamera>);

impl CameraFit {
    /// Estimates the cameras of `targets`; `features` are in the same order. A camera without features gets
    /// the prior means, which are 0.
    pub(crate) fn estimate(targets: &[TargetValue], features: &[Observed]) -> Self {
        let mut cameras: Vec<ConditionCamera> = Vec::new();
        for calibration in targets.iter().filter_map(|target| target.calibration) {
            let condition = calibration.condition;
            let at = cameras.iter().position(|camera| camera.condition == condition).unwrap_or_else(|| {
                cameras.push(ConditionCamera { condition, sds: [0.0; 2], place: [0.0; 2] });
                cameras.len() - 1
            });
            let sds = cameras[at].sds;
            cameras[at].sds = [0, 1].map(|k| sds[k].max(calibration.standard_deviations()[k]));
        }
        for camera in &mut cameras {
            let pairs = targets.iter().zip(features).filter_map(|(target, observed)| {
                let calibration = target.calibration.filter(|c| c.condition == camera.condition)?;
                Some((target, calibration, *observed.observation()?))
            });
            camera.place = minimize_camera_cost(&pairs.collect::<Vec<_>>());
        }
        Self(cameras)
    }

    /// Number of estimated scales and offsets of all cameras.
    pub(crate) fn count_unknowns(&self) -> usize {
        self.free_numbers().count()
    }

    /// All estimated scales and offsets. Each is given as its camera and an index: 0 for the scale, 1 for the
    /// offset.
    fn free_numbers(&self) -> impl Iterator<Item = (&ConditionCamera, usize)> {
        let all = self.0.iter().flat_map(|camera| [0, 1].map(|k| (camera, k)));
        all.filter(|(camera, k)| camera.sds[*k] > 0.0)
    }

    /// Distances of the estimated scales and offsets from their prior means, in prior standard deviations.
    pub(crate) fn prior_residuals(&self) -> impl Iterator<Item = f64> {
        self.free_numbers().map(|(camera, k)| camera.place[k])
    }

    /// The observation with the estimated scale and offset of its camera applied.
    pub(crate) fn apply(&self, target: &TargetValue, observation: &Observation) -> Observation {
        let Some(calibration) = target.calibration else { return *observation };
        let camera = self.0.iter().find(|camera| camera.condition == calibration.condition);
        let apply =
            |camera: &ConditionCamera| calibration.apply(observation.value, camera.scale_and_offset());
        Observation { value: camera.map_or(observation.value, apply), ..*observation }
    }

    /// Value of a feature with the estimated scale and offset of its camera applied.
    pub(crate) fn apply_to_value(&self, target: &TargetValue, observed: &Observed) -> Option<f64> {
        observed.observation().map(|observation| self.apply(target, observation).value)
    }

    /// Projects the columns of `jacobian` onto the orthogonal complement of the derivatives with respect to
    /// the camera unknowns. The projection uses the weights of the cost. The first rows of `jacobian` belong
    /// to the features, the last rows to the camera unknowns.
    pub(crate) fn project_jacobian(
        &self,
        jacobian: DMatrix<f64>,
        targets: &[TargetValue],
        features: &[Observed],
    ) -> DMatrix<f64> {
        if self.count_unknowns() == 0 {
            return jacobian;
        }
        let (own, weights) = self.jacobian(jacobian.nrows(), targets, features);
        let weighted = weight_rows(&own, &weights);
        let normal = own.tr_mul(&weighted);
        let Some(normal) = normal.cholesky() else { return jacobian };
        let followed = normal.solve(&weighted.tr_mul(&jacobian));
        jacobian - own * followed
    }

    /// The estimated scales and offsets, with 95 % intervals by the linear model. `jacobian` has the same
    /// rows as in [`Self::project_jacobian`].
    pub(crate) fn estimates(
        &self,
        jacobian: Option<&DMatrix<f64>>,
        targets: &[TargetValue],
        features: &[Observed],
    ) -> Vec<CameraEstimate> {
        let sds = jacobian.and_then(|jacobian| self.standard_deviations(jacobian, targets, features));
        let estimate = |(at, (camera, k)): (usize, (&ConditionCamera, usize))| CameraEstimate {
            condition: camera.condition,
            name: CAMERA_NUMBER_NAMES[k],
            prior_sd: camera.sds[k],
            estimate: camera.scale_and_offset()[k],
            half_95: sds.as_ref().map(|sds| super::linear_model::Z_95 * sds[at] * camera.sds[k]),
        };
        self.free_numbers().enumerate().map(estimate).collect()
    }

    /// Marginal standard deviations of the camera unknowns, divided by the prior standard deviations. Each
    /// parameter is given a prior with the variance of a uniform variable in the unit box.
    fn standard_deviations(
        &self,
        jacobian: &DMatrix<f64>,
        targets: &[TargetValue],
        features: &[Observed],
    ) -> Option<Vec<f64>> {
        let (own, weights) = self.jacobian(jacobian.nrows(), targets, features);
        let all = DMatrix::from_fn(own.nrows(), jacobian.ncols() + own.ncols(), |row, column| {
            match column.checked_sub(jacobian.ncols()) {
                None => jacobian[(row, column)],
                Some(column) => own[(row, column)],
            }
        });
        let mut information = all.tr_mul(&weight_rows(&all, &weights));
        for at in 0..jacobian.ncols() {
            information[(at, at)] += 1.0 / BOX_VARIANCE;
        }
        let covariance = information.cholesky()?.inverse();
        Some((jacobian.ncols()..all.ncols()).map(|at| covariance[(at, at)].sqrt()).collect())
    }

    /// Two results: the derivatives of all residuals with respect to the camera unknowns, which are in units
    /// of their prior standard deviations, and the weights of the residuals in the cost. `rows` is the number
    /// of residuals.
    fn jacobian(
        &self,
        rows: usize,
        targets: &[TargetValue],
        features: &[Observed],
    ) -> (DMatrix<f64>, Vec<f64>) {
        let free: Vec<(&ConditionCamera, usize)> = self.free_numbers().collect();
        let mut slopes = DMatrix::zeros(rows, free.len());
        let mut weights = vec![1.0; rows];
        for (row, (target, observed)) in targets.iter().zip(features).enumerate() {
            let Some(observation) = observed.observation() else { continue };
            weights[row] = robust_weight(residual(&self.apply(target, observation), target));
            let Some(calibration) = target.calibration else { continue };
            for (column, (camera, k)) in free.iter().enumerate() {
                if camera.condition == calibration.condition {
                    let pair = (target, calibration, *observation);
                    slopes[(row, column)] = linearize_residual(&pair, camera.place).1[*k];
                }
            }
        }
        for (column, (camera, k)) in free.iter().enumerate() {
            let row = rows - free.len() + column;
            (slopes[(row, column)], weights[row]) = (1.0, robust_weight(camera.place[*k]));
        }
        (slopes, weights)
    }
}

/// Features as seen by cameras whose errors are drawn from the priors; `draw` is the number of the twin.
pub(crate) fn draw_camera_errors(targets: &[TargetValue], features: &[Observed], draw: u64) -> Vec<Observed> {
    let one = |(target, observed): (&TargetValue, &Observed)| match (target.calibration, observed) {
        (Some(calibration), Observed::Value(observation)) => {
            let seed = draw + calibration.condition as u64 * CAMERA_SEEDS;
            let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
            let numbers =
                calibration.standard_deviations().map(|sd| sd * generator.sample::<f64, _>(StandardNormal));
            let value = calibration.apply(observation.value, numbers);
            Observed::Value(Observation { value, ..*observation })
        }
        _ => observed.clone(),
    };
    targets.iter().zip(features).map(one).collect()
}

fn weight_rows(matrix: &DMatrix<f64>, weights: &[f64]) -> DMatrix<f64> {
    let mut weighted = matrix.clone();
    weights.iter().enumerate().for_each(|(row, weight)| weighted.row_mut(row).scale_mut(*weight));
    weighted
}

/// Weight of a squared residual in the normal equations: the derivative of [`robust_loss`] with respect to
/// the squared residual.
fn robust_weight(residual: f64) -> f64 {
    math::powi(LOSS_KNEE / residual.abs().max(LOSS_KNEE), 2)
}

/// A target, how it depends on the calibration of its camera, and the feature of the model.
type TargetObservation<'a> = (&'a TargetValue, TargetCalibration, Observation);

/// Residual of a feature, and the derivatives of this residual with respect to scale and offset. `place` is
/// the scale and the offset, each in prior standard deviations.
fn linearize_residual(
    (target, calibration, observation): &TargetObservation,
    place: [f64; 2],
) -> (f64, [f64; 2]) {
    let sds = calibration.standard_deviations();
    let numbers = [sds[0] * place[0], sds[1] * place[1]];
    let value = calibration.apply(observation.value, numbers);
    let distance = target.distance(value);
    let sd = total_sd(observation, target);
    let per_metre = match target.measure {
        // a distance from the target that is limited to ln(MAX_RATIO) has zero slope
        _ if distance.abs() >= math::ln(MAX_RATIO) => 0.0,
        ValueComparison::Log => 1.0 / value,
        ValueComparison::Linear { scale } => 1.0 / scale,
    };
    let slopes = calibration.derivatives(observation.value, numbers);
    (distance / sd, [0, 1].map(|k| slopes[k] * sds[k] * per_metre / sd))
}

/// Scale and offset of a camera, in prior standard deviations, that minimise the cost of the features. Far
/// from the target the cost grows only logarithmically and may have two minima, so the descent starts from
/// the prior means and from the least-squares solution.
fn minimize_camera_cost(pairs: &[TargetObservation]) -> [f64; 2] {
    let cost = |place: &[f64; 2]| camera_cost(pairs, *place, robust_loss);
    let squares = gauss_newton_descent(pairs, [0.0; 2], |r| r * r, |_| 1.0);
    let [near, far] =
        [[0.0; 2], squares].map(|start| gauss_newton_descent(pairs, start, robust_loss, robust_weight));
    if cost(&far) < cost(&near) { far } else { near }
}

/// Cost of the features that a camera shows, plus the cost of the priors of its scale and offset.
fn camera_cost(pairs: &[TargetObservation], place: [f64; 2], cost: fn(f64) -> f64) -> f64 {
    let of = |pair| {
        let residual = linearize_residual(pair, place).0;
        if residual.is_finite() { cost(residual) } else { 0.0 }
    };
    pairs.iter().map(of).sum::<f64>() + place.into_iter().map(cost).sum::<f64>()
}

/// Minimises the total `cost` from `start` by weighted Gauss-Newton steps, each halved until the cost falls.
fn gauss_newton_descent(
    pairs: &[TargetObservation],
    start: [f64; 2],
    cost: fn(f64) -> f64,
    weight: fn(f64) -> f64,
) -> [f64; 2] {
    let (mut place, mut lowest) = (start, camera_cost(pairs, start, cost));
    for _ in 0..MAX_STEPS {
        let mut normal = Matrix2::from_diagonal(&Vector2::from(place.map(weight)));
        let mut right = Vector2::from(place.map(|z| weight(z) * z));
        for pair in pairs {
            let (residual, slopes) = linearize_residual(pair, place);
            if residual.is_finite() {
                let slopes = Vector2::from(slopes);
                normal += weight(residual) * slopes * slopes.transpose();
                right += weight(residual) * residual * slopes;
            }
        }
        let Some(step) = normal.cholesky().map(|normal| normal.solve(&right)) else { return place };
        let shorter = (0..MAX_HALVINGS).map(|halvings| {
            let share = math::powi(0.5, halvings as i32);
            [place[0] - share * step[0], place[1] - share * step[1]]
        });
        let better =
            shorter.map(|place| (place, camera_cost(pairs, place, cost))).find(|(_, cost)| *cost < lowest);
        let Some(better) = better else { return place };
        (place, lowest) = better;
        if step.amax() < MIN_STEP {
            return place;
        }
    }
    place
}

#[cfg(test)]
mod tests;
