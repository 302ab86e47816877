//! Whether what should agree does: the two longest lengths of segments, and starts that fit as well.

use super::descent::{SAME_END_SD, TraceDescent};
use super::iterate::{Iterate, chi2_per_dof};
use super::model::TraceModel;
use super::outer::trace_covariance;
use super::unknown::UnknownKind;

/// Standard deviations by which estimates of two lengths of segments may differ.
const LENGTHS_AGREE_SD: f64 = 3.0;

/// What the two longest lengths of segments say of each other.
pub(super) struct SegmentLengthComparison {
    /// Differences of the estimates, in standard deviations.
    apart: Vec<f64>,
    /// What is left of them beyond twice the scatter that they may have: a bias of segments falls with their
    /// length, so that segments of twice the length have as much left as they differ by.
    pub bias: Vec<f64>,
}

impl SegmentLengthComparison {
    /// Compares an end with where the segments of the stage before lead from there; `sd` is that of the end.
    pub fn new(model: &TraceModel, end: &Iterate, shorter: &Iterate, sd: &[f64]) -> Option<Self> {
        let earlier = trace_covariance(model, shorter)?;
        let variance = |i: usize| earlier.curvature[(i, i)].max(earlier.sandwich[(i, i)]).max(sd[i] * sd[i]);
        let moved: Vec<f64> = (0..sd.len()).map(|i| shorter.point[i] - end.point[i]).collect();
        let apart = (0..sd.len()).map(|i| moved[i].abs() / variance(i).sqrt()).collect();
        let left = |i: usize| moved[i] * moved[i] - 4.0 * (variance(i) - sd[i] * sd[i]);
        let bias = (0..sd.len()).map(|i| left(i).max(0.0).sqrt()).collect();
        Some(Self { apart, bias })
    }

    /// A parameter whose estimates differ by more than they may: where one is off, all are.
    pub fn disagreement(&self, model: &TraceModel) -> Option<String> {
        let parameters = (0..self.apart.len()).filter(|&i| model.unknowns.is_parameter(i));
        let i = parameters.max_by(|a, b| self.apart[*a].total_cmp(&self.apart[*b]))?;
        let UnknownKind::Parameter { name, .. } = &model.unknowns.0[i].kind else { return None };
        let apart = self.apart[i];
        (apart > LENGTHS_AGREE_SD)
            .then(|| format!("segments of the two longest lengths differ by {apart:.1} deviations of {name}"))
    }
}

/// Starts that end elsewhere and fit nearly as well as the best one: by less than what the cost of a right
/// model scatters by from recording to recording.
pub(super) fn count_rivals(end: &Iterate, descents: &[TraceDescent], sd: &[f64]) -> usize {
    /// Difference of the costs, in standard deviations of chi2.
    const NEARLY: f64 = 2.0;
    let (widening, dof) = chi2_per_dof(end);
    let limit = end.cost + NEARLY * widening.max(1.0) * (2.0 * dof as f64).sqrt();
    let ends =
        descents.iter().filter_map(TraceDescent::last_iterate).filter(|other| other.stage == end.stage);
    ends.filter(|other| other.plain == end.plain && other.cost < limit)
        .filter(|other| {
            let mut pairs = end.point.iter().zip(&other.point).zip(sd);
            pairs.any(|((a, b), sd)| (a - b).abs() > SAME_END_SD * sd)
        })
        .count()
}
