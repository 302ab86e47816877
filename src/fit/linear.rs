//! The model near a point of the unit box, to first order: how its residuals change with the place.
//!
//! Rows are the features in the order of the targets, then the priors, then those of the cameras
//! ([`CameraFit`]), each in standard deviations; columns are the parameters, which the cameras follow. Slopes
//! are central differences of [`DIFFERENCE_STEP`], wide enough to average over the scatter of features that are read
//! from sampled traces.

use super::axis::{Prior, SearchAxis};
use super::cameras::{CameraEstimate, CameraFit};
use super::evaluation::Evaluation;
use super::objective::{LOSS_KNEE, Objective, prior_residuals, residual, total_sd};
use super::scale::clamp_unit;
use super::target::TargetValue;
use crate::feature::ValueComparison;
use crate::math;
use nalgebra::{DMatrix, DVector};

/// Step of the differences in the unit box: about 2 % of a parameter whose bounds are a decade apart.
pub const DIFFERENCE_STEP: f64 = 0.01;
/// Longest step in the unit box: a linear model does not hold farther.
const MAX_STEP: f64 = 0.2;

/// The points whose evaluations [`FeatureSlopes::from_differences`] needs: two a parameter, one step below and above `unit` where
/// the box allows.
#[must_use]
pub fn difference_points(unit: &[f64]) -> Vec<Vec<f64>> {
    let moved = |axis: usize, step: f64| {
        unit.iter().enumerate().map(|(at, u)| if at == axis { clamp_unit(u + step) } else { *u }).collect()
    };
    (0..unit.len()).flat_map(|axis| [moved(axis, -DIFFERENCE_STEP), moved(axis, DIFFERENCE_STEP)]).collect()
}

/// `d distance / d u` of every feature as its camera shows it, a row a feature; `None` where it is missing on
/// both sides, or at the point and on one.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureSlopes(pub Vec<Vec<Option<f64>>>);

impl FeatureSlopes {
    /// Of the evaluations `around` a point, in the order of [`difference_points`].
    #[must_use]
    pub fn from_differences(targets: &[TargetValue], centre: &Evaluation, around: &[&Evaluation]) -> Self {
        let cameras = CameraFit::estimate(targets, &centre.features);
        let of = |(feature, target): (usize, &TargetValue), axis: usize| {
            let shown = |e: &Evaluation| cameras.apply_to_value(target, e.features.get(feature)?);
            let sides = [Some(centre), around.get(2 * axis).copied(), around.get(2 * axis + 1).copied()];
            let [centre, below, above] = sides.map(|e| e.and_then(|e| Some((*e.unit.get(axis)?, shown(e)?))));
            feature_slope(target, below.or(centre)?, above.or(centre)?)
        };
        Self(
            targets
                .iter()
                .enumerate()
                .map(|row| (0..centre.unit.len()).map(|axis| of(row, axis)).collect())
                .collect(),
        )
    }
}

fn feature_slope(target: &TargetValue, below: (f64, f64), above: (f64, f64)) -> Option<f64> {
    let width = above.0 - below.0;
    let change = match target.measure {
        ValueComparison::Log => {
            let ratio = above.1 / below.1;
            (ratio > 0.0).then(|| math::ln(ratio))?
        }
        ValueComparison::Linear { scale } => (above.1 - below.1) / scale,
    };
    (width > 0.0 && change.is_finite()).then(|| change / width)
}

/// How far each feature departs from a straight line between the points next to a centre, as a standard
/// deviation in its own unit: `f(+) + f(-) - 2 f(0)` of independent scatter has six times its variance.
/// `None` where it is missing on the way.
#[must_use]
pub fn feature_scatter(
    targets: &[TargetValue],
    centre: &Evaluation,
    around: &[&Evaluation],
) -> Vec<Option<f64>> {
    let cameras = CameraFit::estimate(targets, &centre.features);
    let of = |(at, target): (usize, &TargetValue)| {
        let value = |e: &Evaluation| cameras.apply_to_value(target, e.features.get(at)?);
        let middle = value(centre)?;
        let bends = around.chunks(2).filter_map(|pair| {
            let [below, above] = pair else { return None };
            Some(math::powi(
                target.distance_between(value(below)?, middle)
                    + target.distance_between(value(above)?, middle),
                2,
            ))
        });
        let bends: Vec<f64> = bends.collect();
        let mean = bends.iter().sum::<f64>() / bends.len() as f64;
        (!bends.is_empty()).then(|| (mean / 6.0).sqrt() * target.reference_size())
    };
    targets.iter().enumerate().map(of).collect()
}

/// Residuals of an evaluation; `None` where a feature is missing.
#[must_use]
pub fn residuals(objective: &Objective, evaluation: &Evaluation) -> Vec<Option<f64>> {
    residuals_against(objective.axes(), objective.targets(), evaluation)
}

/// The same against other targets; `None` also where one is not a number.
#[must_use]
pub(crate) fn residuals_against(
    axes: &[SearchAxis],
    targets: &[TargetValue],
    evaluation: &Evaluation,
) -> Vec<Option<f64>> {
    let cameras = CameraFit::estimate(targets, &evaluation.features);
    let features = targets.iter().enumerate().map(|(at, target)| {
        let seen = evaluation.features.get(at).and_then(|feature| feature.observation())?;
        Some(residual(&cameras.apply(target, seen), target)).filter(|r| r.is_finite())
    });
    let priors = prior_residuals(axes, &evaluation.values).map(Some);
    features.chain(priors).chain(cameras.prior_residuals().map(Some)).collect()
}

/// `d r / d u` at a point, where the cameras follow; zero where it is unknown.
#[must_use]
pub fn jacobian(objective: &Objective, centre: &Evaluation, slopes: &FeatureSlopes) -> DMatrix<f64> {
    let (targets, features) = (objective.targets(), &centre.features);
    let cameras = CameraFit::estimate(targets, features);
    cameras.project_jacobian(
        jacobian_with_cameras_held(objective, centre, slopes, &cameras),
        targets,
        features,
    )
}

/// What is estimated of the cameras at a point, with intervals where its slopes are known.
#[must_use]
pub(crate) fn camera_estimates(
    objective: &Objective,
    centre: &Evaluation,
    slopes: Option<&FeatureSlopes>,
) -> Vec<CameraEstimate> {
    let (targets, features) = (objective.targets(), &centre.features);
    let cameras = CameraFit::estimate(targets, features);
    let held = slopes.map(|slopes| jacobian_with_cameras_held(objective, centre, slopes, &cameras));
    cameras.estimates(held.as_ref(), targets, features)
}

/// `d r / d u` with the cameras as they are at the point.
fn jacobian_with_cameras_held(
    objective: &Objective,
    centre: &Evaluation,
    slopes: &FeatureSlopes,
    cameras: &CameraFit,
) -> DMatrix<f64> {
    let columns = centre.unit.len();
    let features = slopes.0.iter().zip(objective.targets()).enumerate().map(|(at, (row, target))| {
        let sd = centre
            .features
            .get(at)
            .and_then(|f| f.observation())
            .map_or(target.relative_sd(), |seen| total_sd(seen, target));
        row.iter().map(|slope| slope.map_or(0.0, |slope| slope / sd)).collect::<Vec<f64>>()
    });
    let priors = objective.axes().iter().enumerate().filter_map(|(at, axis)| {
        let unit = *centre.unit.get(at)?;
        let slope = match axis.prior? {
            Prior::Linear { sd, .. } => axis.bounds.slope(unit) / sd,
            Prior::Log { sd_ln, .. } => axis.bounds.log_slope(unit)? / sd_ln,
        };
        Some((0..columns).map(|column| if column == at { slope } else { 0.0 }).collect::<Vec<f64>>())
    });
    let mut rows: Vec<Vec<f64>> = features.chain(priors).collect();
    rows.resize(rows.len() + cameras.count_unknowns(), vec![0.0; columns]);
    DMatrix::from_fn(rows.len(), columns, |row, column| rows[row][column])
}

/// The linear model after a step, corrected such that it explains what the step did (Broyden, Math. Comput.
/// 19 (1965) 577).
pub fn broyden_update(
    jacobian: &mut DMatrix<f64>,
    before: &[Option<f64>],
    after: &[Option<f64>],
    step: &[f64],
) {
    let length2: f64 = step.iter().map(|d| d * d).sum();
    if length2 == 0.0 {
        return;
    }
    for (row, (before, after)) in before.iter().zip(after).enumerate() {
        let (Some(before), Some(after)) = (before, after) else { continue };
        let expected: f64 = step.iter().enumerate().map(|(at, d)| jacobian[(row, at)] * d).sum();
        let missed = (after - before - expected) / length2;
        for (at, d) in step.iter().enumerate() {
            jacobian[(row, at)] += missed * d;
        }
    }
}

/// The step that a damped Gauss-Newton model suggests: `(J^T W J + damping) d = -J^T W r` with the weights
/// `min(1, KNEE / |r|)^2` that belong to the cost (Levenberg, Quart. Appl. Math. 2 (1944) 164), shortened to
/// a length at which it may hold. A coordinate that is `held` does not move.
#[must_use]
pub fn damped_step(
    jacobian: &DMatrix<f64>,
    residuals: &[Option<f64>],
    damping: f64,
    held: Option<usize>,
) -> Option<Vec<f64>> {
    let weight = |r: f64| LOSS_KNEE / r.abs().max(LOSS_KNEE);
    let mut weighted = jacobian.clone();
    let right =
        DVector::from_iterator(residuals.len(), residuals.iter().map(|r| r.map_or(0.0, |r| -weight(r) * r)));
    for (row, r) in residuals.iter().enumerate() {
        weighted.row_mut(row).scale_mut(r.map_or(0.0, weight));
    }
    if let Some(held) = held {
        weighted.column_mut(held).fill(0.0);
    }
    let mut normal = weighted.tr_mul(&weighted);
    for at in 0..normal.nrows() {
        normal[(at, at)] += damping;
    }
    let solution = normal.cholesky()?.solve(&weighted.tr_mul(&right));
    let longest = solution.amax();
    let shorten = if longest > MAX_STEP { MAX_STEP / longest } else { 1.0 };
    longest.is_finite().then(|| solution.iter().map(|d| d * shorten).collect())
}

/// The point one step away, inside the box.
#[must_use]
pub fn step_in_box(unit: &[f64], step: &[f64]) -> Vec<f64> {
    unit.iter().zip(step).map(|(u, d)| clamp_unit(u + d)).collect()
}
