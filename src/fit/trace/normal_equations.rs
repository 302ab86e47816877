//! Normal equations of all segments, and a step of the outer search.

use super::iterate::{Iterate, SegmentState, is_slider};
use super::model::{TraceModel, TraceRecording};
use super::segment_simulation::{LinkState, RecordingModel};
use super::variable_projection::{ProjectedSegment, project_out_state};
use nalgebra::{DMatrix, DVector};
use portable_math as math;
use rayon::prelude::*;

/// Chi2 per measured value at which the weight of a segment falls to one half. Thus segments with a wrong
/// starting state do not dominate the cost.
const ROBUST_CHI2: f64 = 10.0;

/// Weight of a segment: the derivative of the segment's robust cost with respect to the segment's chi2.
fn segment_weight(segment: &SegmentState, plain: bool) -> f64 {
    if plain { 1.0 } else { 1.0 / (1.0 + segment.chi2 / (segment.data.max(1) as f64 * ROBUST_CHI2)) }
}

/// Cost of all segments: in the robust phase the sum over the segments of `n * c * ln(1 + chi2 / (n * c))`,
/// where `n` is the number of measured values in a segment and `c` is [`ROBUST_CHI2`]; in the plain phase the
/// sum of chi2.
pub(super) fn segments_cost(segments: &[SegmentState], plain: bool) -> f64 {
    /// Chi2 per measured value that is assigned to a segment whose run fails.
    const FAILED: f64 = 1e6;
    let one = |segment: &SegmentState| {
        let data = segment.data.max(segment.last - segment.first) as f64;
        let chi2 = segment.chi2.min(FAILED * data);
        if plain { chi2 } else { data * ROBUST_CHI2 * math::ln_1p(chi2 / (data * ROBUST_CHI2)) }
    };
    segments.iter().map(one).sum()
}

/// Normal equations of all segments and priors.
pub(super) struct NormalEquations {
    pub matrix: DMatrix<f64>,
    pub slope: DVector<f64>,
    pub parts: Vec<Option<ProjectedSegment>>,
}

/// The models of all recordings at a point; `None` if a scene refuses the point.
pub(super) fn recording_models<'a>(model: &'a TraceModel, z: &[f64]) -> Option<Vec<RecordingModel<'a>>> {
    let recordings = model.recordings.iter().enumerate();
    recordings.map(|(number, shoot)| RecordingModel::new(shoot, number, &model.unknowns, z)).collect()
}

/// Normal equations of all segments and priors at a point.
pub(super) fn normal_equations(
    model: &TraceModel,
    z: &[f64],
    segments: &[SegmentState],
    plain: bool,
) -> Option<NormalEquations> {
    let points = recording_models(model, z)?;
    let project = |s: &SegmentState| {
        let fits = s.chi2.is_finite();
        project_out_state(&fits.then(|| points[s.recording].linearize(s.frames(), &s.start_state()))??)
    };
    let parts: Vec<Option<ProjectedSegment>> = segments.par_iter().map(project).collect();
    let n = z.len();
    let (mut total, mut slope) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (part, segment) in parts.iter().zip(segments) {
        let Some(part) = part else { continue };
        let weight = segment_weight(segment, plain);
        total += &part.matrix * weight;
        slope += &part.slope * weight;
    }
    for (i, unknown) in model.unknowns.0.iter().enumerate() {
        if let Some([residual, per_unit]) = unknown.prior_residual(z[i]) {
            total[(i, i)] += per_unit * per_unit;
            slope[i] += residual * per_unit;
        }
    }
    Some(NormalEquations { matrix: total, slope, parts })
}

/// Changes normal equations so that the step of unknown `i` is zero.
fn hold_unknown(matrix: &mut DMatrix<f64>, slope: &mut DVector<f64>, i: usize) {
    matrix.row_mut(i).fill(0.0);
    matrix.column_mut(i).fill(0.0);
    (matrix[(i, i)], slope[i]) = (1.0, 0.0);
}

/// The point after a damped step of the unknowns, within their ranges; with `held`, the constants keep their
/// values.
pub(super) fn damped_step(
    model: &TraceModel,
    z: &[f64],
    at: &NormalEquations,
    damping: f64,
    held: bool,
) -> Option<Vec<f64>> {
    /// Largest allowed change of a parameter's coordinate in one step: a factor of 1.6 in the value of a
    /// logarithmic parameter, half of the range of a linear parameter.
    const LONGEST: f64 = 0.5;
    let (mut damped, mut slope) = (at.matrix.clone(), at.slope.clone());
    for i in 0..z.len() {
        damped[(i, i)] += damping * at.matrix[(i, i)] + 1e-9;
        if held && model.unknowns.is_constant(i) {
            hold_unknown(&mut damped, &mut slope, i);
        }
    }
    let mut step = -damped.clone().cholesky()?.solve(&slope);
    // an unknown at an end of its range whose step points outwards keeps its value
    while let Some(i) = (0..z.len()).find(|&i| {
        let [low, high] = model.unknowns.0[i].range;
        (z[i] <= low && step[i] < 0.0) || (z[i] >= high && step[i] > 0.0)
    }) {
        hold_unknown(&mut damped, &mut slope, i);
        step = -damped.clone().cholesky()?.solve(&slope);
    }
    let longest = model.unknowns.parameters().map(|i| step[i].abs()).fold(0.0, f64::max);
    if longest > LONGEST {
        step *= LONGEST / longest;
    }
    let moved: Vec<f64> = z.iter().zip(step.iter()).map(|(z, d)| z + d).collect();
    Some(model.unknowns.clamp_to_ranges(&moved))
}

/// The segments after the step `moved` of the unknowns. Each starting state takes the step that the linear
/// model gives for it, limited in length.
pub(super) fn carry_states(
    model: &TraceModel,
    segments: &[SegmentState],
    at: &NormalEquations,
    moved: &DVector<f64>,
) -> Vec<SegmentState> {
    /// Largest allowed change, rad, of an angle of a starting state in one step.
    const ANGLE: f64 = 0.05;
    /// Largest allowed change of an angular velocity of a starting state in one step, rad per first segment
    /// length.
    const RATE: f64 = 0.8;
    let mut segments = segments.to_vec();
    for (segment, part) in segments.iter_mut().zip(&at.parts) {
        let Some(part) = part else { continue };
        let follow = &part.move_by_unknown * moved;
        let step = -LinkState::from_fn(|i, _| part.move_held[i] + follow[i]);
        let TraceRecording { scene, observation, .. } = &model.recordings[segment.recording];
        let [neck, lip] = scene.linkage.angle_units();
        let size = |i: usize| {
            let of_neck = if neck > 0.0 { step[i].abs() } else { 0.0 };
            of_neck.max(step[i + 1].abs() / lip)
        };
        let angle = ANGLE / size(0).max(1e-9);
        let rate = RATE / observation.first_segment_s / size(2).max(1e-9);
        segment.start = (segment.start_state() + step * angle.min(rate).min(1.0)).into();
    }
    segments
}

/// Covariance of the coordinates of the unknowns, and the scatter of the cost gradients between segments.
#[derive(Debug, Clone)]
pub(crate) struct TraceCovariance {
    /// Information matrix of the recordings and the priors.
    pub information: DMatrix<f64>,
    /// Covariance from the curvature of the cost: the inverse of the information matrix, plus `heads`.
    pub curvature: DMatrix<f64>,
    /// Part of `curvature` that comes from the errors of the priors: C P C with the inverse C of the
    /// information matrix and the information P of the priors.
    pub priors: DMatrix<f64>,
    /// Sum of the squared cost gradients of the segments, relative to the sum that noise of the measured size
    /// and the errors of the recorded heads give on average. It is 1 on average if the model is right and the
    /// residuals are white.
    pub gradient_scatter: f64,
    /// Ratio of the scatter of estimates around the truth to that of the linear model.
    pub beyond_linear: f64,
    /// Covariance due to errors of the recorded head positions.
    pub heads: DMatrix<f64>,
}

/// Ratio of the scatter of estimates around the truth to that of the linear model for a blade. The linear
/// model knows neither the curvature of the cost nor errors that all segments share. The motion of a slider
/// is nearly linear in its parameters.
const BEYOND_LINEAR: f64 = 1.3;

/// Covariance of the unknowns at an iterate; `None` if the information matrix is singular.
pub(crate) fn trace_covariance(model: &TraceModel, at: &Iterate) -> Option<TraceCovariance> {
    let found = normal_equations(model, &at.point, &at.segments, true)?;
    let inverse = found.matrix.clone().cholesky()?.inverse();
    let prior = model.unknowns.0.iter().zip(&at.point).map(|(unknown, z)| {
        let residual = unknown.prior_residual(*z);
        residual.map_or(0.0, |[_, slope]| slope * slope)
    });
    let prior = DVector::from_iterator(at.point.len(), prior);
    let heads = head_curve_covariance(model, at)?;
    let gradient_scatter = compare_gradients(&found, &inverse, &heads);
    let priors = &inverse * DMatrix::from_diagonal(&prior) * &inverse;
    let heads = &inverse * heads.total * &inverse;
    let curvature = inverse + &heads;
    let beyond_linear = if is_slider(model) { 1.0 } else { BEYOND_LINEAR };
    let information = found.matrix;
    Some(TraceCovariance { information, curvature, priors, gradient_scatter, beyond_linear, heads })
}

impl TraceCovariance {
    /// Variance of the coordinate of unknown `i` if the variance of the noise is `widening` times the
    /// measured one; the part by noise also grows by the square of `beyond_linear`.
    pub(super) fn variance(&self, i: usize, widening: f64) -> f64 {
        let at = (i, i);
        let by_noise = self.curvature[at] - self.heads[at] - self.priors[at];
        math::powi(self.beyond_linear, 2) * widening * by_noise + self.priors[at] + self.heads[at]
    }
}

/// Sum of the squared cost gradients of the segments at the minimum, relative to its mean for a right model;
/// see [`TraceCovariance::gradient_scatter`]. The squares are weighted by the inverse `C` of the information
/// matrix.
///
/// At the minimum, the gradient of a segment with the matrix `M` is `g - M C G`, where `g` is its gradient at
/// the true values, and `G` is the sum of all gradients and prior pulls. So its mean square is the trace of
/// `C (V - 2 M C W + M C S C M)`, where `V`, `W` and `S` are the covariances of `g`, of `G` with `g`, and of
/// `G`.
fn compare_gradients(found: &NormalEquations, inverse: &DMatrix<f64>, heads: &HeadCovariance) -> f64 {
    let of_sum = inverse * (&found.matrix + &heads.total);
    let (mut square, mut expected) = (0.0, 0.0);
    for (part, head) in found.parts.iter().zip(&heads.by_segment) {
        let Some(part) = part else { continue };
        let information = inverse * &part.matrix;
        let [own, with_sum] = head.as_ref().map_or([0.0; 2], |[own, with_sum]| {
            [(inverse * own).trace(), (&information * inverse * with_sum).trace()]
        });
        square += part.slope.dot(&(inverse * &part.slope));
        expected += information.trace() + own - 2.0 * ((&information * &information).trace() + with_sum)
            + (&information * &of_sum * &information).trace();
    }
    if expected > 0.0 { square / expected } else { 1.0 }
}

/// Covariances of cost gradients due to errors of the recorded head positions. The curve through the
/// positions is smooth, so its error extends over many segments and does not average out like noise.
struct HeadCovariance {
    /// Covariance of the sum over all segments.
    total: DMatrix<f64>,
    /// Covariances of the gradient of each segment with itself, and of the sum with it.
    by_segment: Vec<Option<[DMatrix<f64>; 2]>>,
}

fn head_curve_covariance(model: &TraceModel, at: &Iterate) -> Option<HeadCovariance> {
    let points = recording_models(model, &at.point)?;
    let n = at.point.len();
    let mut heads = HeadCovariance { total: DMatrix::zeros(n, n), by_segment: vec![None; at.segments.len()] };
    for (film, shoot) in model.recordings.iter().enumerate() {
        let Some(curve) = &shoot.observation.own_curve else { continue };
        let mine = |segment: &SegmentState| segment.recording == film && segment.chi2.is_finite();
        let slopes = |segment: &SegmentState| head_curve_slopes(&points[film], segment);
        let parts: Vec<Option<(usize, DMatrix<f64>)>> =
            at.segments.par_iter().map(|segment| mine(segment).then(|| slopes(segment))?).collect();
        // covariance of the coefficients times slopes by them, given by the first coefficient and its columns
        let weighted = |from: usize, slopes: &DMatrix<f64>| {
            let mut weighted = DMatrix::zeros(curve.coefficient_count(), n);
            for i in 0..n {
                let mut row = vec![0.0; curve.coefficient_count()];
                row[from..].iter_mut().zip(&slopes.row(i)).for_each(|(place, slope)| *place = *slope);
                curve.multiply_covariance(&mut row);
                weighted.column_mut(i).copy_from_slice(&row);
            }
            weighted
        };
        let mut all = DMatrix::zeros(n, curve.coefficient_count());
        for (from, part) in parts.iter().flatten() {
            let mut place = all.columns_mut(*from, part.ncols());
            place += part;
        }
        let of_all = weighted(0, &all);
        heads.total += &all * &of_all;
        let covariances = |(from, part): &(usize, DMatrix<f64>)| {
            let columns = |weighted: &DMatrix<f64>| part * weighted.rows(*from, part.ncols());
            [columns(&weighted(*from, part)), columns(&of_all).transpose()]
        };
        let found: Vec<Option<[DMatrix<f64>; 2]>> =
            parts.par_iter().map(|part| part.as_ref().map(covariances)).collect();
        for (own, found) in heads.by_segment.iter_mut().zip(found) {
            *own = found.or_else(|| own.take());
        }
    }
    Some(heads)
}

/// Derivatives of the gradient of a segment's cost with respect to the coefficients of the curve through the
/// recorded head positions. Returns the index of the first coefficient with an effect, and one column per
/// coefficient.
fn head_curve_slopes(point: &RecordingModel<'_>, segment: &SegmentState) -> Option<(usize, DMatrix<f64>)> {
    let (from, columns) = point.observation.head_curve_derivatives(segment.frames())?;
    let mut linear = point.linearize(segment.frames(), &segment.start_state())?;
    let n = linear.by_unknown.ncols();
    linear.by_unknown = DMatrix::from_fn(columns.nrows(), n + columns.ncols(), |row, k| {
        if k < n { linear.by_unknown[(row, k)] } else { columns[(row, k - n)] }
    });
    let part = project_out_state(&linear)?;
    Some((from, part.matrix.view((0, n), (n, columns.ncols())).into_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use portable_math::StandardNormal;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Ten segments tell five unknowns, one of which hardly any other segment than the first tells. Their
    /// gradients scatter as noise says, times `size` squared. Mean of the ratio over many draws.
    fn mean_scatter(size: f64) -> f64 {
        const UNKNOWNS: usize = 5;
        const SEGMENTS: usize = 10;
        const DRAWS: usize = 400;
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut normal = || generator.sample::<f64, _>(StandardNormal);
        let roots: Vec<DMatrix<f64>> = (0..SEGMENTS)
            .map(|k| {
                let weight = |i: usize| if i == 0 && k > 0 { 0.01 } else { 1.0 };
                DMatrix::from_fn(UNKNOWNS, 8, |i, _| weight(i) * normal())
            })
            .collect();
        let matrices: Vec<DMatrix<f64>> = roots.iter().map(|root| root * root.transpose()).collect();
        let matrix = matrices.iter().fold(DMatrix::zeros(UNKNOWNS, UNKNOWNS), |sum, one| sum + one);
        let inverse = matrix.clone().cholesky().unwrap().inverse();
        let total = DMatrix::zeros(UNKNOWNS, UNKNOWNS);
        let heads = HeadCovariance { total, by_segment: vec![None; SEGMENTS] };
        let ratios = (0..DRAWS).map(|_| {
            let gradients: Vec<DVector<f64>> =
                roots.iter().map(|root| root * DVector::from_fn(8, |_, _| size * normal())).collect();
            let sum = gradients.iter().fold(DVector::zeros(UNKNOWNS), |sum, one| sum + one);
            let part = |(own, gradient): (&DMatrix<f64>, &DVector<f64>)| {
                Some(ProjectedSegment {
                    matrix: own.clone(),
                    slope: gradient - own * &inverse * &sum,
                    move_held: LinkState::zeros(),
                    move_by_unknown: DMatrix::zeros(4, UNKNOWNS),
                })
            };
            let parts = matrices.iter().zip(&gradients).map(part).collect();
            let found = NormalEquations { matrix: matrix.clone(), slope: DVector::zeros(UNKNOWNS), parts };
            compare_gradients(&found, &inverse, &heads)
        });
        ratios.sum::<f64>() / DRAWS as f64
    }

    #[test]
    fn gradients_scatter_as_noise_of_the_measured_size_says() {
        assert!((mean_scatter(1.0) - 1.0).abs() < 0.05, "{}", mean_scatter(1.0));
        assert!((mean_scatter(1.5) / 2.25 - 1.0).abs() < 0.05, "{}", mean_scatter(1.5));
    }
}
