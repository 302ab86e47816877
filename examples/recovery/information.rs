//! Descents from the true values, and the Cramér-Rao standard deviations at their ends, from finite
//! differences.

use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use wiperlab::fit::Problem;
use wiperlab::fit::trace::{
    Iterate, TraceModel, TraceSearchSettings, TraceUnknown, UnknownKind, chi2_per_dof, first_iterate,
    next_iterate, segment_residuals, start_point,
};
use wiperlab::simulate::scene::Scene;

/// Name of an unknown that is a parameter of the scene.
fn parameter_name(unknown: &TraceUnknown) -> Option<&str> {
    match &unknown.kind {
        UnknownKind::Parameter { name, .. } => Some(name),
        UnknownKind::Camera { .. } => None,
    }
}

/// Standard deviations of the priors of the constants, in the logarithm, by name.
pub fn read_priors(model: &TraceModel) -> BTreeMap<String, f64> {
    let unknowns = model.unknowns.0.iter();
    unknowns.filter_map(|unknown| Some((parameter_name(unknown)?.to_owned(), unknown.prior?[1]))).collect()
}

/// The end of a descent that starts at the values of the scene `truth`; `None` if the model does not run
/// through every segment, or if there is only one length of segments. Camera errors start at the values at which a search starts.
pub fn descend_from(problem: &Problem, truth: &Scene) -> Option<(TraceModel, Iterate)> {
    let model = problem.trace_model()?.ok()?;
    let mut point = start_point(&model, 1, 0);
    for (coordinate, unknown) in point.iter_mut().zip(&model.unknowns.0) {
        if let Some(value) = parameter_name(unknown).and_then(|name| truth.value(name)) {
            *coordinate = value.ln().clamp(unknown.range[0], unknown.range[1]);
        }
    }
    let settings = TraceSearchSettings::without_twins(problem.segment_s().to_vec());
    let follow = |mut at: Iterate| {
        while let Some(next) = next_iterate(&model, &settings, &at) {
            at = next;
        }
        at
    };
    let short = follow(first_iterate(&model, &settings, &point)?);
    // the last stage again, with segments that count to their end, as in a fit; it follows the end of the
    // stage before it
    let before_last = settings.segment_s.len().checked_sub(2)?;
    let at = follow(Iterate { stage: before_last, whole: true, plain: false, settled: true, ..short });
    // otherwise the cost is not chi2, or the model cannot run through a segment
    (at.plain && chi2_per_dof(&model, &at).0.is_finite()).then_some((model, at))
}

/// Whitened residuals by segment and by channel, which is `true` for the drop.
type Residuals = BTreeMap<(usize, bool), Vec<f64>>;

fn whitened(model: &TraceModel, at: &Iterate) -> Residuals {
    segment_residuals(model, at)
        .into_iter()
        .map(|part| ((part.segment, part.is_drop), part.whitened))
        .collect()
}

/// Central differences: residuals `above` minus `below` over twice the step. A segment or channel that one of
/// them lacks is left out.
fn slopes(above: &Residuals, below: &Residuals, step: f64) -> Residuals {
    let slope = |(key, above): (&(usize, bool), &Vec<f64>)| {
        let below = below.get(key)?;
        Some((*key, above.iter().zip(below).map(|(a, b)| (a - b) / (2.0 * step)).collect()))
    };
    above.iter().filter_map(slope).collect()
}

/// Cramér-Rao standard deviations of the logarithms of the parameters, by name: from the inverse of the
/// information of residuals and priors, with unknown starting states of the segments. `state_steps` are the
/// steps of the four numbers of a starting state; a number whose step is zero does not vary.
pub fn find_deviations(
    model: &TraceModel,
    at: &Iterate,
    state_steps: [f64; 4],
) -> Option<BTreeMap<String, f64>> {
    const STEP_SD: f64 = 0.02;
    const STEP: f64 = 1e-3;
    let difference = |moved: &dyn Fn(&mut Iterate, f64), step: f64| {
        let [above, below] = [step, -step].map(|by| {
            let mut iterate = at.clone();
            moved(&mut iterate, by);
            whitened(model, &iterate)
        });
        slopes(&above, &below, step)
    };
    let n = at.point.len();
    let by_unknown: Vec<Residuals> = (0..n)
        .map(|i| {
            let step = model.unknowns.0[i].prior.map_or(STEP, |[_, sd]| STEP_SD * sd);
            difference(&|iterate, by| iterate.point[i] += by, step)
        })
        .collect();
    let by_state: Vec<Residuals> = (0..4)
        .filter(|i| state_steps[*i] > 0.0)
        .map(|i| {
            let step = state_steps[i];
            let move_all = |iterate: &mut Iterate, by: f64| {
                iterate.segments.iter_mut().for_each(|segment| segment.start[i] += by);
            };
            // per step, so that the slopes of angles and rates have similar sizes
            let mut slopes = difference(&move_all, step);
            slopes.values_mut().flatten().for_each(|slope| *slope *= step);
            slopes
        })
        .collect();
    let mut information = DMatrix::<f64>::zeros(n, n);
    for segment in 0..at.segments.len() {
        let column = |of: &Residuals| {
            let parts = [false, true].map(|drop| of.get(&(segment, drop)).cloned().unwrap_or_default());
            DVector::from_vec(parts.concat())
        };
        let own: Vec<DVector<f64>> = by_unknown.iter().map(column).collect();
        let states: Vec<DVector<f64>> = by_state.iter().map(column).collect();
        if own.iter().chain(&states).any(|one| one.len() != own[0].len()) {
            continue;
        }
        let count = states.len();
        let mut of_states = DMatrix::from_fn(count, count, |i, j| states[i].dot(&states[j]));
        of_states += DMatrix::identity(count, count) * (1e-10 * of_states.trace());
        let Some(inverse) = of_states.try_inverse() else { continue };
        let crossed: Vec<DVector<f64>> =
            own.iter().map(|one| DVector::from_fn(count, |i, _| states[i].dot(one))).collect();
        for i in 0..n {
            for j in 0..n {
                information[(i, j)] += own[i].dot(&own[j]) - crossed[i].dot(&(&inverse * &crossed[j]));
            }
        }
    }
    for (i, unknown) in model.unknowns.0.iter().enumerate() {
        information[(i, i)] += unknown.prior.map_or(0.0, |[_, sd]| 1.0 / (sd * sd));
    }
    let covariance = information.cholesky()?.inverse();
    let named = |(i, unknown): (usize, &TraceUnknown)| {
        Some((parameter_name(unknown)?.to_owned(), covariance[(i, i)].sqrt()))
    };
    Some(model.unknowns.0.iter().enumerate().filter_map(named).collect())
}
