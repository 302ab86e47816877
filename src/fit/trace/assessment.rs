//! What is known at the end of a search: intervals, and whether anything speaks against them.

use super::checkpoint::{Iterate, TraceSearchSettings, chi2_per_dof};
use super::levenberg_marquardt::MAX_STEPS;
use super::model::TraceModel;
use super::normal_equations::trace_covariance;
use super::search::{SAME_END_SD, TraceDescent};
use super::uncertainty_run::{SearchEnd, UncertaintyRun, Z_95, profile_distances};
use super::unknowns::UnknownKind;
use crate::fit::bootstrap::MIN_TWINS;
use crate::math;
use nalgebra::DMatrix;
use std::collections::BTreeSet;

/// Least eigenvalue of the information, in units of its diagonal, that counts as known: below it rounding
/// decides.
const MIN_EIGENVALUE: f64 = 1e-10;

/// An unknown at the end of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownEstimate {
    /// What it is.
    pub kind: UnknownKind,
    /// Value in its SI unit.
    pub value: f64,
    /// Ends of the 95 % interval by curvature, segments and rise of the cost, in its SI unit.
    pub ends_95: [f64; 2],
    /// Standard deviation of its coordinate.
    pub sd: f64,
    /// Ends of the 95 % interval of refitted twins alone, in its SI unit, where there are enough.
    pub twins_95: Option<[f64; 2]>,
    /// Variance of its coordinate that is left by the recorded heads.
    by_heads: f64,
    /// Whether it lies at an end of its range.
    pub at_bound: bool,
}

impl UnknownEstimate {
    /// Ends of the widest 95 % interval, in its SI unit.
    #[must_use]
    pub fn widest_95(&self) -> [f64; 2] {
        let [low, high] = self.ends_95;
        self.twins_95.map_or([low, high], |[below, above]| [low.min(below), high.max(above)])
    }
}

/// Everything that is known at the best end.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceAssessment {
    /// One an unknown, in order.
    pub estimates: Vec<UnknownEstimate>,
    /// Correlation of the estimates.
    pub correlation: DMatrix<f64>,
    /// Number of combinations of the parameters that the recordings themselves determine.
    pub rank: usize,
    /// Where the segments of the stage before lead from the end.
    pub shorter: Option<Iterate>,
    /// Number of twins that were fitted again.
    pub twins: usize,
    /// Doubts that hold for every parameter.
    pub doubts: Vec<String>,
}

impl TraceAssessment {
    /// Adds the intervals that follow from the scatter of refitted twins about the end. (The twins move by
    /// the same head, so that what is not known of it is added.)
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

/// What is known at the end of the best of some descents; `branches` are its branches, and where they end.
pub(super) fn assess_end(
    end: &SearchEnd<'_>,
    (descents, best): (&[TraceDescent], usize),
    branches: &[(UncertaintyRun, Option<Iterate>)],
) -> TraceAssessment {
    let SearchEnd { model, settings, at, sd, .. } = end;
    let (curvature, information) = (&end.covariance.curvature, &end.covariance.information);
    let n = at.point.len();
    let ended = |wanted: UncertaintyRun| {
        let found = branches.iter().find(|(branch, _)| *branch == wanted);
        found.and_then(|(_, last)| last.as_ref())
    };
    let distances = profile_distances(end, ended);
    let rank = count_determined(model, information);
    let shorter = ended(UncertaintyRun::Shorter);
    let mut doubts = shared_doubts(model, settings, descents, best, sd, rank);
    let lengths = shorter.and_then(|shorter| SegmentLengthComparison::new(model, at, shorter, sd));
    doubts.extend(lengths.as_ref().and_then(|lengths| lengths.disagreement(model)));
    let bias = |i: usize| lengths.as_ref().map_or(0.0, |lengths| lengths.bias[i]);
    let estimates = (0..n)
        .map(|i| {
            let by_heads = end.covariance.heads[(i, i)];
            let ends = distances[i].map(|end| math::hypot(end, Z_95 * bias(i)));
            UnknownEstimate { by_heads, ..estimate_unknown(model, at, i, math::hypot(sd[i], bias(i)), ends) }
        })
        .collect();
    let correlation =
        DMatrix::from_fn(n, n, |i, j| curvature[(i, j)] / (curvature[(i, i)] * curvature[(j, j)]).sqrt());
    let shorter = shorter.cloned();
    let mut known = TraceAssessment { estimates, correlation, rank, shorter, twins: 0, doubts };
    let twins = branches.iter().filter(|(branch, _)| branch.is_twin());
    let refits: Vec<&[f64]> =
        twins.filter_map(|(_, last)| last.as_ref()).map(|last| &last.point[..]).collect();
    known.add_twins(model, at, &refits);
    known
}

fn estimate_unknown(
    model: &TraceModel,
    end: &Iterate,
    i: usize,
    sd: f64,
    [below, above]: [f64; 2],
) -> UnknownEstimate {
    let (unknown, z) = (&model.unknowns.0[i], end.point[i]);
    UnknownEstimate {
        kind: unknown.kind.clone(),
        value: unknown.value(z),
        ends_95: [-below, above].map(|far| unknown.value(z + far)),
        sd,
        twins_95: None,
        by_heads: 0.0,
        at_bound: is_at_bound(model, end, i),
    }
}

/// Whether unknown `i` lies at an end of its range.
fn is_at_bound(model: &TraceModel, end: &Iterate, i: usize) -> bool {
    let [low, high] = model.unknowns.0[i].range;
    let near = 1e-6 * (high - low);
    end.point[i] <= low + near || end.point[i] >= high - near
}

/// Whether the interval of unknown `i` leaves its range at both ends.
fn is_interval_open(model: &TraceModel, end: &Iterate, i: usize, sd: f64) -> bool {
    let [low, high] = model.unknowns.0[i].range;
    end.point[i] - Z_95 * sd <= low && end.point[i] + Z_95 * sd >= high
}

/// Combinations of the parameters without a prior that the recordings determine.
fn count_determined(model: &TraceModel, information: &DMatrix<f64>) -> usize {
    let free: Vec<usize> = (0..information.nrows())
        .filter(|&i| model.unknowns.is_parameter(i) && model.unknowns.0[i].prior.is_none())
        .collect();
    let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        let (i, j) = (free[a], free[b]);
        information[(i, j)] / (information[(i, i)] * information[(j, j)]).sqrt().max(f64::MIN_POSITIVE)
    });
    let priors = (0..information.nrows())
        .filter(|&i| model.unknowns.is_parameter(i) && model.unknowns.0[i].prior.is_some())
        .count();
    scaled.symmetric_eigenvalues().iter().filter(|value| **value > MIN_EIGENVALUE).count() + priors
}

fn shared_doubts(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    descents: &[TraceDescent],
    best: usize,
    sd: &[f64],
    rank: usize,
) -> Vec<String> {
    let Some(end) = descents[best].last_iterate() else { return Vec::new() };
    let mut doubts = Vec::new();
    let bad = end.segments.iter().filter(|segment| segment.is_bad()).count();
    if bad > 0 {
        doubts.push(format!("{bad} of {} segments fit worse than noise ever does", end.segments.len()));
    }
    if end.number >= MAX_STEPS {
        doubts.push(format!("the search still moved after {MAX_STEPS} steps"));
    }
    if end.stage + 1 < settings.segment_s.len() {
        doubts.push("the search did not reach the longest segments".to_owned());
    }
    let agree =
        descents.iter().enumerate().filter(|(at, _)| *at != best).filter_map(|(_, d)| d.last_iterate());
    let agree = agree
        .filter(|other| {
            let pairs = end.point.iter().zip(&other.point).zip(sd);
            other.stage == end.stage
                && pairs.into_iter().all(|((a, b), sd)| (a - b).abs() <= SAME_END_SD * sd)
        })
        .count();
    if agree == 0 {
        doubts.push(format!("no two of {} starts end at the same place", descents.len()));
    }
    let rivals = count_rivals(end, descents, sd);
    if rivals > 0 {
        doubts.push(format!("{rivals} of {} starts end elsewhere and fit nearly as well", descents.len()));
    }
    let parameters = (0..end.point.len()).filter(|&i| model.unknowns.is_parameter(i)).count();
    if rank < parameters {
        doubts.push(format!("the recordings determine {rank} combinations of {parameters} parameters"));
    }
    let names = |which: &dyn Fn(usize) -> bool| -> Option<String> {
        let named =
            (0..end.point.len()).filter(|i| which(*i)).filter_map(|i| match &model.unknowns.0[i].kind {
                UnknownKind::Parameter { name, .. } => Some(name.as_str()),
                UnknownKind::Camera { .. } => None,
            });
        let named: Vec<&str> = named.collect::<BTreeSet<&str>>().into_iter().collect();
        (!named.is_empty()).then(|| named.join(", "))
    };
    if let Some(names) = names(&|i| is_at_bound(model, end, i)) {
        doubts.push(format!("{names} ends at a bound, which may exclude a better value"));
    }
    if let Some(names) = names(&|i| is_interval_open(model, end, i, sd[i])) {
        doubts.push(format!("nothing within the bounds is excluded for {names}, nor for what depends on it"));
    }
    doubts
}

// Whether what should agree does: the two longest lengths of segments, and starts that fit as well.

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
    pub(crate) fn new(model: &TraceModel, end: &Iterate, shorter: &Iterate, sd: &[f64]) -> Option<Self> {
        let earlier = trace_covariance(model, shorter)?;
        let variance = |i: usize| earlier.curvature[(i, i)].max(earlier.sandwich[(i, i)]).max(sd[i] * sd[i]);
        let moved: Vec<f64> = (0..sd.len()).map(|i| shorter.point[i] - end.point[i]).collect();
        let apart = (0..sd.len()).map(|i| moved[i].abs() / variance(i).sqrt()).collect();
        let left = |i: usize| moved[i] * moved[i] - 4.0 * (variance(i) - sd[i] * sd[i]);
        let bias = (0..sd.len()).map(|i| left(i).max(0.0).sqrt()).collect();
        Some(Self { apart, bias })
    }

    /// A parameter whose estimates differ by more than they may: where one is off, all are.
    pub(crate) fn disagreement(&self, model: &TraceModel) -> Option<String> {
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
