//! How far the cost itself lets a parameter go: the ends of an interval by curvature, looked at with
//! everything else fitted again.

use super::branch::{SearchEnd, UncertaintyRun, Z_95};
use super::iterate::Iterate;
use super::model::TraceModel;
use super::outer::{recording_models, segments_cost};
use super::states::{RescuePolicy, fit_states};
use crate::math;

/// Deviation of the pin, in those of the parameter.
const PIN_SD: f64 = 1e-3;
/// Furthest that an end is moved outwards, in its distance by curvature.
const MAX_STRETCH: f64 = 3.0;

/// Distances from the estimates at which the cost has risen by what 95 % take, below and above, in the
/// coordinate; at least those of the curvature, and those for an unknown of which no side was looked at.
/// `sides` gives the last iterate of each branch.
pub(super) fn profile_distances<'s>(
    end: &SearchEnd<'_>,
    sides: impl Fn(UncertaintyRun) -> Option<&'s Iterate>,
) -> Vec<[f64; 2]> {
    let rise = Z_95 * Z_95 * end.widening;
    let one = |unknown: usize| {
        [false, true].map(|above| {
            let moved = end.profile_offset(unknown, above);
            let found = sides(UncertaintyRun::Side { unknown, above });
            let risen = found.map(|at| cost_rise(end, unknown, moved, at)).filter(|risen| risen.is_finite());
            // (a run that fails there stands for a rise)
            let stretch = risen.map_or(1.0, |risen| (rise / risen.max(1e-9)).sqrt());
            moved.abs() * stretch.clamp(1.0, MAX_STRETCH)
        })
    };
    (0..end.at.point.len()).map(one).collect()
}

/// Where unknown `i` is pinned.
fn pin_prior(end: &SearchEnd<'_>, i: usize, moved: f64) -> (f64, f64) {
    (end.at.point[i] + moved, PIN_SD * end.covariance.curvature[(i, i)].sqrt())
}

/// The model with unknown `i` pinned away from its estimate, and where the valley is thought to lie then.
pub(super) fn pin_unknown(end: &SearchEnd<'_>, i: usize, moved: f64) -> (TraceModel, Option<Iterate>) {
    let covariance = &end.covariance.curvature;
    let mut pinned = end.model.clone();
    let (at, sd) = pin_prior(end, i, moved);
    if let Some(unknown) = pinned.unknowns.0.get_mut(i) {
        unknown.prior = Some([at, sd]);
    }
    let along = |k: usize| end.at.point[k] + covariance[(k, i)] / covariance[(i, i)] * moved;
    let point: Vec<f64> = (0..end.at.point.len()).map(along).collect();
    let point = pinned.unknowns.clamp_to_ranges(&point);
    let mut segments = end.at.segments.clone();
    let first = recording_models(&pinned, &point).map(|points| {
        fit_states(&points, &mut segments, 2, RescuePolicy::Never);
        let cost = segments_cost(&segments, true) + pinned.unknowns.prior_cost(&point);
        Iterate { point, segments, cost, plain: true, settled: false, ..end.at.clone() }
    });
    (pinned, first)
}

/// By how much the cost rises to an iterate with unknown `i` pinned, without what the pin itself costs.
fn cost_rise(end: &SearchEnd<'_>, i: usize, moved: f64, at: &Iterate) -> f64 {
    let (pinned_at, sd) = pin_prior(end, i, moved);
    let prior = end.model.unknowns.0[i].prior;
    let own = prior.map_or(0.0, |[mean, sd]| math::powi((at.point[i] - mean) / sd, 2));
    at.cost - math::powi((at.point[i] - pinned_at) / sd, 2) + own - end.at.cost
}
