//! How far the cost itself lets a parameter go: the ends of an interval by curvature, looked at with
//! everything else fitted again.

use super::chain::stepped;
use super::iterate::Iterate;
use super::model::TraceModel;
use super::outer::{cost, points};
use super::states::{Rescue, settle};
use super::unknown::Kind;
use crate::math;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Steps with the parameter pinned, from where the valley is thought to lie.
const STEPS: usize = 1;
/// Deviation of the pin, in those of the parameter.
const PIN: f64 = 1e-3;
/// Furthest that an end is moved outwards, in its distance by curvature.
const FURTHEST: f64 = 3.0;

/// Distances from the estimates at which the cost has risen by what 95 % take, below and above, in the
/// coordinate; at least `distances`. `None` for an unknown of a camera, which is not looked at.
pub(super) fn distances(
    model: &TraceModel,
    end: &Iterate,
    covariance: &DMatrix<f64>,
    distances: &[f64],
    rise: f64,
) -> Vec<Option<[f64; 2]>> {
    let one = |i: usize| {
        matches!(model.unknowns.0[i].kind, Kind::Parameter { .. }).then(|| {
            [-1.0, 1.0].map(|side| {
                let distance = distances[i];
                let found = risen(model, end, covariance, i, side * distance);
                // (a run that fails there stands for a rise)
                let stretch = found.map_or(1.0, |risen| (rise / risen.max(1e-9)).sqrt());
                distance * stretch.clamp(1.0, FURTHEST)
            })
        })
    };
    (0..end.point.len()).into_par_iter().map(one).collect()
}

/// By how much the cost rises where unknown `i` is moved and everything else is fitted again.
fn risen(model: &TraceModel, end: &Iterate, covariance: &DMatrix<f64>, i: usize, moved: f64) -> Option<f64> {
    let sd = covariance[(i, i)].sqrt();
    let pinned_at = end.point[i] + moved;
    let mut pinned = TraceModel { shoots: model.shoots.clone(), unknowns: model.unknowns.clone() };
    let prior = pinned.unknowns.0[i].prior.replace([pinned_at, PIN * sd]);
    let own = |z: f64| prior.map_or(0.0, |[mean, sd]| math::powi((z - mean) / sd, 2));
    let point: Vec<f64> =
        (0..end.point.len()).map(|k| end.point[k] + covariance[(k, i)] / (sd * sd) * moved).collect();
    let point = pinned.unknowns.clamped(&point);
    let mut segments = end.segments.clone();
    let points = points(&pinned, &point)?;
    settle(&points, &mut segments, 2, Rescue::Never);
    let start = cost(&segments, true) + pinned.unknowns.prior_cost(&point);
    let mut at = Iterate { point, segments, cost: start, plain: true, settled: false, ..end.clone() };
    for _ in 0..STEPS {
        if at.settled {
            break;
        }
        at = stepped(&pinned, &at);
    }
    let pin = math::powi((at.point[i] - pinned_at) / (PIN * sd), 2);
    Some(at.cost - pin + own(at.point[i]) - end.cost).filter(|risen| risen.is_finite())
}
