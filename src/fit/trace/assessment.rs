//! Intervals of the estimates at the end of a search, and reasons to doubt them.

use super::iterate::Iterate;
use super::levenberg_marquardt::MAX_STEPS;
use super::model::TraceModel;
use super::normal_equations::trace_covariance;
use super::prior_conflict::prior_conflicts;
use super::rivals::{describe_rival, has_lost};
use super::uncertainty_run::{SearchEnd, UncertaintyRun, Z_95, profile_distances};
use super::unknowns::UnknownKind;
use crate::fit::bootstrap::MIN_TWINS;
use crate::model::parameters::find_parameter;
use nalgebra::DMatrix;
use portable_math as math;
use std::collections::BTreeSet;

/// Smallest eigenvalue of the scaled information matrix that counts as different from zero. A direction with
/// a smaller eigenvalue is not determined, because such an eigenvalue is a rounding error.
const MIN_EIGENVALUE: f64 = 1e-10;

/// Estimate of an unknown at the end of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownEstimate {
    /// Parameter of the scene, or error of a camera.
    pub kind: UnknownKind,
    /// Estimated value, in the SI unit of the unknown.
    pub value: f64,
    /// Ends of the 95 % interval, in the SI unit of the unknown. The interval combines curvature, scatter of
    /// the segments, profile and bias. If another minimum fits nearly as well, it also contains the value
    /// there, plus and minus 1.96 standard deviations.
    pub ends_95: [f64; 2],
    /// Standard deviation of the unknown's coordinate, including the bias.
    pub sd: f64,
    /// Ends of the 95 % interval from the refits to simulated recordings (twins) only, in the SI unit of the
    /// unknown; `None` if there are too few twins.
    pub twins_95: Option<[f64; 2]>,
    /// Part of the variance of the unknown's coordinate that comes from errors of the recorded head
    /// positions.
    by_heads: f64,
    /// Whether the estimate is at an end of the range of the unknown.
    pub at_bound: bool,
    /// Reasons to doubt this estimate alone.
    pub doubts: Vec<String>,
}

impl UnknownEstimate {
    /// Ends of the smallest interval that contains `ends_95` and `twins_95`, in the SI unit of the unknown.
    #[must_use]
    pub fn widest_95(&self) -> [f64; 2] {
        let [low, high] = self.ends_95;
        self.twins_95.map_or([low, high], |[below, above]| [low.min(below), high.max(above)])
    }
}

/// Estimates at the best end of a search, with their intervals and reasons to doubt them.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceAssessment {
    /// One estimate per unknown, in the order of the unknowns.
    pub estimates: Vec<UnknownEstimate>,
    /// Correlation matrix of the estimates.
    pub correlation: DMatrix<f64>,
    /// Number of independent combinations of parameters that the recordings or priors determine.
    pub rank: usize,
    /// Last iterate of a further fit that starts at the best end and uses the shorter segments of the
    /// previous stage; `None` if there is no such fit.
    pub shorter: Option<Iterate>,
    /// Number of refitted twins.
    pub twins: usize,
    /// Reasons to doubt the estimates of all parameters.
    pub doubts: Vec<String>,
}

impl TraceAssessment {
    /// Adds the intervals from the scatter of refitted twins around the best end. All twins use the same
    /// recorded head motion, so the variance due to errors of this motion is added to the scatter.
    fn add_twins(&mut self, model: &TraceModel, end: &Iterate, refits: &[&[f64]]) {
        self.twins = refits.len();
        if refits.len() < MIN_TWINS {
            return;
        }
        for (i, found) in self.estimates.iter_mut().enumerate() {
            let scatter = refits.iter().map(|refit| math::powi(refit[i] - end.point[i], 2)).sum::<f64>();
            let sd = (scatter / refits.len() as f64 + found.by_heads).sqrt();
            let unknown = &model.unknowns.0[i];
            let [low, high] = [-Z_95, Z_95].map(|z| unknown.value(end.point[i] + z * sd));
            found.twins_95 = Some([low, high]);
        }
    }
}

/// Assesses the best end of a search. `others` are the ends that were compared with it. `lonely` is the
/// reason for doubt if no two starts agree. `runs` lists the uncertainty runs that start at this end, each
/// with its last iterate.
pub(super) fn assess_end(
    end: &SearchEnd<'_>,
    others: &[&Iterate],
    lonely: Option<String>,
    runs: &[(UncertaintyRun, Option<Iterate>)],
) -> TraceAssessment {
    let SearchEnd { model, at, sd, .. } = end;
    let curvature = &end.covariance.curvature;
    let n = at.point.len();
    let last_of = |wanted: UncertaintyRun| runs.iter().find(|(run, _)| *run == wanted)?.1.as_ref();
    let distances = profile_distances(end, last_of);
    let rank = count_determined(model, &end.covariance.information);
    let shorter = last_of(UncertaintyRun::Shorter);
    let mut doubts = shared_doubts(end, rank);
    doubts.extend(lonely);
    let rivals: Vec<&Iterate> = others.iter().copied().filter(|other| !has_lost(end, other)).collect();
    let lengths = shorter.and_then(|shorter| compare_segment_lengths(model, at, shorter, sd));
    let (biases, disagreement) = lengths.unwrap_or_else(|| (vec![0.0; n], None));
    doubts.extend(disagreement);
    doubts.extend(prior_conflicts(end));
    let estimate = |i: usize| {
        let (unknown, z, bias) = (&model.unknowns.0[i], at.point[i], biases[i]);
        let [below, above] = distances[i].map(|end| math::hypot(end, Z_95 * bias));
        let [low, high] = rivals.iter().fold([z - below, z + above], |[low, high], rival| {
            let place = rival.point[i];
            [low.min(place - Z_95 * sd[i]), high.max(place + Z_95 * sd[i])]
        });
        UnknownEstimate {
            kind: unknown.kind.clone(),
            value: unknown.value(z),
            ends_95: [low, high].map(|z| unknown.value(z)),
            sd: math::hypot(sd[i], bias),
            twins_95: None,
            by_heads: end.covariance.heads[(i, i)],
            at_bound: is_at_bound(model, at, i),
            doubts: rivals.iter().filter_map(|rival| describe_rival(end, rival, i)).collect(),
        }
    };
    let estimates = (0..n).map(estimate).collect();
    let correlation =
        DMatrix::from_fn(n, n, |i, j| curvature[(i, j)] / (curvature[(i, i)] * curvature[(j, j)]).sqrt());
    let shorter = shorter.cloned();
    let mut known = TraceAssessment { estimates, correlation, rank, shorter, twins: 0, doubts };
    let twins = runs.iter().filter(|(run, _)| run.is_twin());
    let refits: Vec<&[f64]> = twins.filter_map(|(_, last)| Some(&last.as_ref()?.point[..])).collect();
    known.add_twins(model, at, &refits);
    known
}

/// Whether unknown `i` is at an end of its range.
fn is_at_bound(model: &TraceModel, end: &Iterate, i: usize) -> bool {
    let [low, high] = model.unknowns.0[i].range;
    let near = 1e-6 * (high - low);
    end.point[i] <= low + near || end.point[i] >= high - near
}

/// Whether unknown `i` is at the lowest value that a scene accepts, such as a damping of 0. No better value
/// lies beyond it.
fn is_at_natural_limit(model: &TraceModel, end: &Iterate, i: usize) -> bool {
    let lowest = model.unknowns.parameter_name(i).and_then(find_parameter).and_then(|row| row.range.lowest());
    let [low, high] = model.unknowns.0[i].range;
    let is_low = end.point[i] <= low + 1e-6 * (high - low);
    is_low && lowest.is_some_and(|lowest| model.unknowns.0[i].value(low) <= lowest)
}

/// Number of combinations of parameters without a prior that the recordings determine, plus the number of
/// parameters with a prior.
fn count_determined(model: &TraceModel, information: &DMatrix<f64>) -> usize {
    let (free, priors): (Vec<usize>, Vec<usize>) =
        model.unknowns.parameters().partition(|&i| model.unknowns.0[i].prior.is_none());
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        let (i, j) = (free[a], free[b]);
        information[(i, j)] / (information[(i, i)] * information[(j, j)]).sqrt().max(f64::MIN_POSITIVE)
    });
    scaled.symmetric_eigenvalues().iter().filter(|value| **value > MIN_EIGENVALUE).count() + priors.len()
}

/// Reasons to doubt all parameters that follow from this end alone. Comparisons with other ends and with
/// shorter segments are not included.
fn shared_doubts(at: &SearchEnd<'_>, rank: usize) -> Vec<String> {
    let SearchEnd { model, settings, at: end, sd, .. } = at;
    let mut doubts = Vec::new();
    let bad = end.count_bad_segments();
    if bad > 0 {
        doubts.push(format!("{bad} of {} segments fit worse than noise ever does", end.segments.len()));
    }
    if end.number >= MAX_STEPS {
        doubts.push(format!("the search still moved after {MAX_STEPS} steps"));
    }
    if end.stage + 1 < settings.segment_s.len() {
        doubts.push("the search did not reach the longest segments".to_owned());
    }
    let parameters = model.unknowns.parameters().count();
    if rank < parameters {
        doubts.push(format!("the recordings determine {rank} combinations of {parameters} parameters"));
    }
    let names = |which: &dyn Fn(usize) -> bool| -> Option<String> {
        let chosen = (0..end.point.len()).filter(|i| which(*i));
        let names: BTreeSet<&str> = chosen.filter_map(|i| model.unknowns.parameter_name(i)).collect();
        (!names.is_empty()).then(|| names.into_iter().collect::<Vec<_>>().join(", "))
    };
    if let Some(names) = names(&|i| is_at_bound(model, end, i) && !is_at_natural_limit(model, end, i)) {
        let end = if names.contains(',') { "end" } else { "ends" };
        doubts.push(format!("{names} {end} at a bound, which may exclude a better value"));
    }
    let is_open = |i: usize| {
        let [low, high] = model.unknowns.0[i].range;
        end.point[i] - Z_95 * sd[i] <= low && end.point[i] + Z_95 * sd[i] >= high
    };
    if let Some(names) = names(&is_open) {
        doubts.push(format!("nothing within the bounds is excluded for {names}, nor for what depends on it"));
    }
    doubts
}

// Agreement of the fits with the two longest segment lengths.

/// Largest plausible difference between the estimates with two segment lengths, in standard deviations of
/// this difference.
const LENGTHS_AGREE_SD: f64 = 3.0;

/// Compares the estimates at the best end `end` with the estimates of the fit with shorter segments. `sd` are
/// the standard deviations of the coordinates at `end`.
///
/// Returns the bias of every unknown, in its coordinate: the difference of the two estimates, from which
/// the standard deviation of this difference is subtracted in quadrature. The longer the segments, the
/// smaller the bias, so the result is an upper limit of the bias at `end`. Also returns a reason for doubt
/// that names the parameter with the largest difference, if this difference is implausible: one wrong
/// parameter casts doubt on all.
fn compare_segment_lengths(
    model: &TraceModel,
    end: &Iterate,
    shorter: &Iterate,
    sd: &[f64],
) -> Option<(Vec<f64>, Option<String>)> {
    let earlier = trace_covariance(model, shorter)?;
    let widening = earlier.gradient_scatter.max(1.0);
    let variance = |i: usize| earlier.variance(i, widening).max(sd[i] * sd[i]);
    let moved = |i: usize| shorter.point[i] - end.point[i];
    let left = |i: usize| moved(i) * moved(i) - (variance(i) - sd[i] * sd[i]);
    let bias = (0..sd.len()).map(|i| left(i).max(0.0).sqrt()).collect();
    let apart = |i: usize| moved(i).abs() / variance(i).sqrt();
    let furthest = model.unknowns.parameters().max_by(|a, b| apart(*a).total_cmp(&apart(*b)));
    let disagreement = furthest.filter(|i| apart(*i) > LENGTHS_AGREE_SD).and_then(|i| {
        let (name, apart) = (model.unknowns.parameter_name(i)?, apart(i));
        Some(format!("segments of the two longest lengths differ by {apart:.1} deviations of {name}"))
    });
    Some((bias, disagreement))
}
