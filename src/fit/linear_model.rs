//! Linear model of the residuals around a point of the unit box.
//!
//! Each row of the Jacobian belongs to one residual, in standard deviations: first the features in the order
//! of the targets, then the priors, then the camera unknowns (`CameraFit`). Each column belongs to one
//! parameter. Slopes are central differences with the step `DIFFERENCE_STEP`, which is wide enough to average
//! over the scatter of features that are measured on sampled traces.

use super::bounds::{Prior, clamp_unit};
use super::camera_calibration::{CameraEstimate, CameraFit};
use super::evaluation::Evaluation;
use super::job::FreeParameter;
use super::objective::{LOSS_KNEE, Objective, prior_residuals, residual, total_sd};
use super::target_value::TargetValue;
use crate::feature::ValueComparison;
use crate::model::parameters::describe_parameters;
use nalgebra::{DMatrix, DVector};
use portable_math as math;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Step of the finite differences in the unit box. For a parameter whose bounds are one decade apart, it is
/// about 2 % of the value.
pub(crate) const DIFFERENCE_STEP: f64 = 0.01;
/// Largest allowed length of a step in the unit box; the linear model is not trusted for longer steps.
const MAX_STEP: f64 = 0.2;

/// The points that [`FeatureSlopes::from_differences`] needs: for each parameter, one step below and one step
/// above `unit`, clamped to the box.
pub(crate) fn difference_points(unit: &[f64]) -> Vec<Vec<f64>> {
    let moved = |axis: usize, step: f64| {
        unit.iter().enumerate().map(|(at, u)| if at == axis { clamp_unit(u + step) } else { *u }).collect()
    };
    (0..unit.len()).flat_map(|axis| [moved(axis, -DIFFERENCE_STEP), moved(axis, DIFFERENCE_STEP)]).collect()
}

/// Derivatives of the distances of the features from their targets with respect to the coordinates of the
/// unit box: one row per feature, one column per coordinate. Each feature includes the estimated errors of
/// its camera. An entry is `None` if the feature has a value at fewer than two of the three points of the
/// difference.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FeatureSlopes(pub Vec<Vec<Option<f64>>>);

impl FeatureSlopes {
    /// Slopes from the evaluations `around` a point, in the order of [`difference_points`].
    pub(crate) fn from_differences(
        targets: &[TargetValue],
        centre: &Evaluation,
        around: &[&Evaluation],
    ) -> Self {
        let cameras = CameraFit::estimate(targets, &centre.features);
        let of = |(feature, target): (usize, &TargetValue), axis: usize| {
            let shown = |e: &Evaluation| cameras.apply_to_value(target, e.features.get(feature)?);
            let sides = [Some(centre), around.get(2 * axis).copied(), around.get(2 * axis + 1).copied()];
            let [centre, below, above] = sides.map(|e| e.and_then(|e| Some((*e.unit.get(axis)?, shown(e)?))));
            feature_slope(target, below.or(centre)?, above.or(centre)?)
        };
        let row = |row| (0..centre.unit.len()).map(|axis| of(row, axis)).collect();
        Self(targets.iter().enumerate().map(row).collect())
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

/// Scatter of each feature about a straight line through neighbouring points: a standard deviation, in the
/// unit of the feature. It is computed from `f(+) + f(-) - 2 f(0)`; if the three values scatter
/// independently, the variance of this sum is six times the variance of one value. `None` where the feature
/// is missing at the centre, or at one or both points of every pair of neighbours.
pub(crate) fn feature_scatter(
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
            let [below, above] = [value(below)?, value(above)?].map(|v| target.distance_between(v, middle));
            Some(math::powi(below + above, 2))
        });
        let bends: Vec<f64> = bends.collect();
        let mean = bends.iter().sum::<f64>() / bends.len() as f64;
        (!bends.is_empty()).then(|| (mean / 6.0).sqrt() * target.reference_size())
    };
    targets.iter().enumerate().map(of).collect()
}

/// Residuals of an evaluation against the targets of the objective; `None` where a feature is missing.
pub(crate) fn residuals(objective: &Objective, evaluation: &Evaluation) -> Vec<Option<f64>> {
    residuals_against(objective.axes(), objective.targets(), evaluation)
}

/// Residuals against the given targets; `None` where a feature is missing or its target is NaN.
pub(crate) fn residuals_against(
    axes: &[FreeParameter],
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

/// Jacobian `d r / d u` of the residuals `r`, with scales and offsets of the cameras estimated anew along
/// each step; entries whose slope is unknown are zero.
pub(crate) fn jacobian(objective: &Objective, centre: &Evaluation, slopes: &FeatureSlopes) -> DMatrix<f64> {
    let (targets, features) = (objective.targets(), &centre.features);
    let cameras = CameraFit::estimate(targets, features);
    let held = jacobian_with_cameras_held(objective, centre, slopes, &cameras);
    cameras.project_jacobian(held, targets, features)
}

/// Estimated scales and offsets of the cameras at a point, with 95 % intervals if `slopes` are given.
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

/// Jacobian `d r / d u` of the residuals `r`, with scales and offsets of the cameras fixed at their estimates
/// at the point.
fn jacobian_with_cameras_held(
    objective: &Objective,
    centre: &Evaluation,
    slopes: &FeatureSlopes,
    cameras: &CameraFit,
) -> DMatrix<f64> {
    let columns = centre.unit.len();
    let features = slopes.0.iter().zip(objective.targets()).enumerate().map(|(at, (row, target))| {
        let seen = centre.features.get(at).and_then(|f| f.observation());
        let sd = seen.map_or(target.relative_sd(), |seen| total_sd(seen, target));
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

/// Broyden's update of the Jacobian after a step: the updated Jacobian reproduces the change of the residuals
/// over this step (Math. Comput. 19 (1965) 577).
pub(crate) fn broyden_update(
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

/// Damped Gauss-Newton step `d` with `(J^T W J + damping) d = -J^T W r` and the weights `W = min(1, LOSS_KNEE
/// / |r|)^2` of the cost (Levenberg, Quart. Appl. Math. 2 (1944) 164), shortened to [`MAX_STEP`]. The step is
/// zero in the coordinate `held`, if it is given.
pub(crate) fn damped_step(
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

/// The point `unit + step`, clamped to the unit box.
pub(crate) fn step_in_box(unit: &[f64], step: &[f64]) -> Vec<f64> {
    unit.iter().zip(step).map(|(u, d)| clamp_unit(u + d)).collect()
}

// Rank, condition number, standard deviations, correlations and parameter combinations from the linear model.
//
// The Jacobian `J = d r / d u` is in standard deviations per side length of the unit box. A singular
// direction is informative if the 95 % interval along it is shorter than the box. The information matrix `J^T
// J` is inverted on the informative directions only.

/// Half width of a 95 % interval, in standard deviations of a normal variable.
pub(crate) const Z_95: f64 = 1.96;
/// Rise in cost at the ends of a 95 % interval (chi-squared with one degree of freedom).
pub(crate) const CHI_SQUARED_95: f64 = 3.84;
/// A direction is informative if its singular value, in standard deviations per side length of the unit box,
/// is at least this value. At this value the 95 % interval along the direction is as wide as the box.
pub(crate) const MIN_INFORMATIVE: f64 = 2.0 * Z_95;
/// A singular value below this fraction of the largest singular value counts as a rounding error.
pub(crate) const ROUNDING_SHARE: f64 = 1e-9;
/// A parameter is not determined if the squared projection of its unit vector onto the uninformative
/// directions reaches this value.
pub(crate) const OPEN_SHARE: f64 = 0.01;
/// Exponents below this fraction of the largest exponent of a combination are left out.
const MIN_NAMED_EXPONENT: f64 = 0.05;
/// Exponents below this fraction of the largest exponent, which is 1, are left out of a sentence. Two
/// exponents that differ from 1 and -1 by less than this are called a ratio.
const MIN_SPOKEN_EXPONENT: f64 = 0.2;

/// Singular directions of a Jacobian in the space of the parameters.
#[derive(Debug, Clone)]
pub(crate) struct SingularDirections {
    /// Singular values with their orthonormal directions, in descending order of the singular values.
    all: Vec<(f64, Vec<f64>)>,
    /// Number of informative directions.
    pub rank: usize,
}

/// A product of powers of the parameters; either the features determine it or they leave it undetermined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterCombination {
    /// Exponents by parameter name, scaled so that the largest is 1; exponents below 0.05 are left out.
    pub exponents: BTreeMap<String, f64>,
    /// Standard deviation of the logarithm of the product. For an undetermined combination it is limited by
    /// the size of the search box.
    pub sd_relative: f64,
    /// Whether the features determine the combination.
    pub determined: bool,
}

impl ParameterCombination {
    /// The product as text, such as `friction.c friction.a^0.31`.
    pub(crate) fn describe(&self) -> String {
        let mut factors: Vec<(&String, f64)> = self.exponents.iter().map(|(name, e)| (name, *e)).collect();
        math::sort_by_number(&mut factors, |a| -a.1.abs());
        let factor = |(name, e): (&String, f64)| {
            if (e - 1.0).abs() < 0.005 { name.clone() } else { format!("{name}^{e:.2}") }
        };
        factors.into_iter().map(factor).collect::<Vec<_>>().join(" ")
    }

    /// The product in words: the name of one parameter, "the ratio of X to Y", or "the combination of X, Y
    /// and Z". Parameters with a small exponent are left out.
    pub(crate) fn describe_in_words(&self) -> String {
        let named: Vec<(&str, f64)> = self.exponents.iter().map(|(name, e)| (name.as_str(), *e)).collect();
        let mut named: Vec<_> = named.into_iter().filter(|(_, e)| e.abs() >= MIN_SPOKEN_EXPONENT).collect();
        math::sort_by_number(&mut named, |a| -a.1);
        let is_plain = |e: f64| (e.abs() - 1.0).abs() < MIN_SPOKEN_EXPONENT;
        let words = |name| describe_parameters([name]);
        match named[..] {
            [(a, x), (b, y)] if is_plain(x) && is_plain(y) && y < 0.0 => {
                format!("the ratio of {} to {}", words(a), words(b))
            }
            [(a, _)] => words(a),
            _ => format!("the combination of {}", describe_parameters(named.iter().map(|(name, _)| *name))),
        }
    }
}

impl SingularDirections {
    /// Singular directions of a Jacobian with one column per parameter.
    pub(crate) fn from_jacobian(jacobian: &DMatrix<f64>) -> Self {
        let columns = jacobian.ncols();
        // with rows of zeros, which add no information, the decomposition yields all directions
        let padded = jacobian.clone().resize_vertically(jacobian.nrows().max(columns), 0.0);
        let svd = padded.svd(false, true);
        let rows = svd.v_t.iter().flat_map(|v_t| v_t.row_iter());
        let rows = rows.map(|row| row.iter().copied().collect::<Vec<f64>>());
        let mut all: Vec<(f64, Vec<f64>)> = svd.singular_values.iter().copied().zip(rows).collect();
        math::sort_by_number(&mut all, |a| -a.0);
        let threshold =
            all.first().map_or(MIN_INFORMATIVE, |(largest, _)| MIN_INFORMATIVE.max(ROUNDING_SHARE * largest));
        let rank = all.iter().filter(|(value, _)| *value > threshold).count();
        Self { all, rank }
    }

    /// Condition number: ratio of the largest to the smallest singular value; infinite if the smallest is
    /// zero or a rounding error.
    pub(crate) fn condition_number(&self) -> f64 {
        match (self.all.first(), self.all.last()) {
            (Some((largest, _)), Some((smallest, _))) if *smallest > ROUNDING_SHARE * largest => {
                largest / smallest
            }
            _ => f64::INFINITY,
        }
    }

    /// Two numbers for the coordinate `axis` of the unit box: its standard deviation within the informative
    /// directions, and the squared projection of the unit vector of this coordinate onto the uninformative
    /// directions.
    pub(crate) fn coordinate_sd(&self, axis: usize) -> (f64, f64) {
        let component = |direction: &Vec<f64>| math::powi(direction.get(axis).copied().unwrap_or(0.0), 2);
        let (known, open) = self.all.split_at(self.rank);
        let variance: f64 =
            known.iter().map(|(value, direction)| component(direction) / (value * value)).sum();
        (variance.sqrt(), open.iter().map(|(_, direction)| component(direction)).sum())
    }

    /// Whether the informative directions determine a coordinate of the unit box.
    pub(crate) fn determines(&self, axis: usize) -> bool {
        self.coordinate_sd(axis).1 < OPEN_SHARE
    }

    /// Directions that the features leave undetermined.
    pub(crate) fn open_directions(&self) -> Vec<&[f64]> {
        self.all.iter().skip(self.rank).map(|(_, direction)| direction.as_slice()).collect()
    }

    /// Correlation of the estimates of two parameters; `None` if either parameter is not determined.
    pub(crate) fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        if !(self.determines(a) && self.determines(b)) {
            return None;
        }
        let product = |direction: &[f64]| Some(direction.get(a)? * direction.get(b)?);
        let known = self.all.iter().take(self.rank);
        let terms = known.filter_map(|(value, direction)| Some(product(direction)? / (value * value)));
        let covariance: f64 = terms.sum();
        Some((covariance / (self.coordinate_sd(a).0 * self.coordinate_sd(b).0)).clamp(-1.0, 1.0))
    }

    /// Products of powers of the parameters at the point `unit`: first the determined products, the most
    /// precise first, then the undetermined products.
    pub(crate) fn combinations(
        &self,
        names: &[String],
        axes: &[FreeParameter],
        unit: &[f64],
    ) -> Vec<ParameterCombination> {
        let slopes: Vec<f64> =
            axes.iter().zip(unit).map(|(axis, u)| axis.bounds.log_slope(*u).unwrap_or(0.0)).collect();
        let one = |(rank, (value, direction)): (usize, &(f64, Vec<f64>))| {
            let determined = rank < self.rank;
            // with slope_i = d ln p_i / d u_i, a determined sum of d_i u_i is a product of powers with the
            // exponents d_i / slope_i; along an undetermined direction d, ln p_i changes by d_i slope_i
            let exponent = |(d, slope): (&f64, &f64)| {
                let determines = if *slope == 0.0 { 0.0 } else { d / slope };
                if determined { determines } else { d * slope }
            };
            let exponents: Vec<f64> = direction.iter().zip(&slopes).map(exponent).collect();
            let larger = |most: f64, e: &f64| if e.abs() > most.abs() { *e } else { most };
            let largest = exponents.iter().fold(0.0, larger);
            let is_named = |e: &f64| e.abs() >= MIN_NAMED_EXPONENT * largest.abs() && largest != 0.0;
            let named = names.iter().zip(&exponents).filter(|(_, e)| is_named(e));
            let sd = if determined {
                1.0 / (value * largest.abs())
            } else {
                largest.abs() / value.max(MIN_INFORMATIVE / 2.0 / Z_95)
            };
            let exponents = named.map(|(name, e)| (name.clone(), e / largest)).collect();
            ParameterCombination { exponents, sd_relative: if sd.is_finite() { sd } else { 0.0 }, determined }
        };
        self.all.iter().enumerate().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::bounds::{Bounds, BoundsSpacing};

    fn names() -> [String; 2] {
        ["p".to_owned(), "q".to_owned()]
    }

    fn axes() -> Vec<FreeParameter> {
        vec![
            Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap().into(),
            Bounds::new(1.0, 10.0, BoundsSpacing::Log).unwrap().into(),
        ]
    }

    /// Jacobian with one row for each `(a, b, sd)`: the derivatives of `r = ln(p^a q^b) / sd` with respect to
    /// the coordinates of the unit box.
    fn rows(of: &[(f64, f64, f64)]) -> DMatrix<f64> {
        let (lp, lq) = (100.0_f64.ln(), 10.0_f64.ln());
        DMatrix::from_fn(of.len(), 2, |row, column| {
            if column == 0 { of[row].0 * lp / of[row].2 } else { of[row].1 * lq / of[row].2 }
        })
    }

    #[test]
    fn a_product_is_named_with_its_exponents_and_deviation() {
        let found = SingularDirections::from_jacobian(&rows(&[(1.0, 0.5, 0.01)]));
        assert_eq!(found.rank, 1);
        assert!(!found.determines(0) && !found.determines(1) && found.condition_number().is_infinite());
        let combinations = found.combinations(&names(), &axes(), &[0.5, 0.5]);
        assert_eq!(combinations[0].describe(), "p q^0.50");
        assert!(combinations[0].determined && (combinations[0].sd_relative - 0.01).abs() < 1e-12);
        // in the direction ln q = -2 ln p the product p q^0.5 is constant
        let open = &combinations[1];
        assert!(
            !open.determined && (open.exponents["p"] / open.exponents["q"] + 0.5).abs() < 1e-9,
            "{open:?}"
        );
    }

    #[test]
    fn two_features_determine_both_and_their_correlation_is_that_of_least_squares() {
        // for r1 = ln p / 0.01 and r2 = ln(p q) / 0.02, the covariance of ln p and ln q is 1e-4 * [[1, -1],
        // [-1, 5]]
        let found = SingularDirections::from_jacobian(&rows(&[(1.0, 0.0, 0.01), (1.0, 1.0, 0.02)]));
        assert_eq!(found.rank, 2);
        assert!((found.coordinate_sd(0).0 * 100.0_f64.ln() - 0.01).abs() < 1e-12);
        assert!((found.coordinate_sd(1).0 * 10.0_f64.ln() - 0.01 * 5.0_f64.sqrt()).abs() < 1e-12);
        assert!((found.correlation(0, 1).unwrap() + 1.0 / 5.0_f64.sqrt()).abs() < 1e-12);
        assert!(found.condition_number() > 1.0 && found.open_directions().is_empty());
    }

    #[test]
    fn nothing_is_known_from_nothing() {
        let found = SingularDirections::from_jacobian(&DMatrix::zeros(0, 2));
        assert_eq!((found.rank, found.open_directions().len()), (0, 2));
        assert_eq!(found.correlation(0, 1), None);
    }
}
