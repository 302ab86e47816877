//! Fits the starting state of each segment while the parameters and the camera errors are held fixed.

use super::iterate::SegmentState;
use super::segment_simulation::{LinkState, RecordingModel};
use nalgebra::{DMatrix, DVector, Matrix4};
use rayon::prelude::*;
use std::borrow::Cow;

/// Selects the segments that are fitted again, and the starting states from which they are fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RescuePolicy {
    Never,
    /// Restarts a segment whose chi2 exceeds this multiple of its number of data: from the recorded state,
    /// from the recorded state with changed angular velocities, and from the end of the previous segment.
    Beyond(f64),
    /// Restarts a segment whose chi2 is larger than noise explains, from the states of [`Self::Beyond`] and
    /// from states along the two least determined directions.
    Thorough,
}

/// [`RescuePolicy::Beyond`] restarts segments only if at most this fraction of all segments is bad. If more
/// segments are bad, the parameters are wrong rather than the starting states.
const MAX_RESCUED_SHARE: f64 = 0.4;

/// The fit of a starting state ends when a step lowers chi2 by less than this factor times the smaller of
/// chi2 and the number of residuals.
const MIN_CHI2_GAIN: f64 = 1e-3;

/// A starting state with the residuals of its segment and, where needed, the derivatives of the residuals
/// with respect to the state.
struct StateTrial {
    state: LinkState,
    residuals: DVector<f64>,
    jacobian: Option<DMatrix<f64>>,
}

impl StateTrial {
    fn with_jacobian(point: &RecordingModel<'_>, frames: [usize; 2], state: LinkState) -> Option<Self> {
        let linear = point.linearize_state(frames, &state)?;
        Some(Self { state, residuals: linear.residuals, jacobian: Some(linear.by_state) })
    }

    /// A trial without derivatives. It takes a third of the time of a trial with derivatives.
    fn without_jacobian(point: &RecordingModel<'_>, frames: [usize; 2], state: LinkState) -> Option<Self> {
        Some(Self { state, residuals: point.differentiable_residuals(frames, &state)?, jacobian: None })
    }

    fn cost(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// Smallest decrease of chi2 after which another step is tried.
    fn least_gain(&self) -> f64 {
        MIN_CHI2_GAIN * self.cost().min(self.residuals.len() as f64)
    }
}

/// Fits the four numbers of the starting state of a segment by Levenberg-Marquardt in at most `most` steps.
pub(super) fn refine_state(point: &RecordingModel<'_>, segment: &mut SegmentState, most: usize) {
    let frames = segment.frames();
    let Some(mut at) = StateTrial::with_jacobian(point, frames, segment.start_state()) else {
        segment.chi2 = f64::INFINITY;
        return;
    };
    let mut damping = 1e-3;
    for left in (0..most).rev() {
        let Some(next) = lower_cost_step(point, frames, &at, left == 0, &mut damping) else { break };
        let gain = at.cost() - next.cost();
        at = next;
        if gain < at.least_gain() {
            break;
        }
    }
    (segment.start, segment.chi2, segment.data) = (at.state.into(), at.cost(), at.residuals.len());
}

/// The state after the first trial step that lowers chi2, or `None` if no trial does. The damping rises from
/// trial to trial.
fn lower_cost_step(
    point: &RecordingModel<'_>,
    frames: [usize; 2],
    at: &StateTrial,
    is_last: bool,
    damping: &mut f64,
) -> Option<StateTrial> {
    const TRIALS: usize = 6;
    let jacobian = match &at.jacobian {
        Some(jacobian) => Cow::Borrowed(jacobian),
        None => Cow::Owned(point.linearize_state(frames, &at.state)?.by_state),
    };
    let normal = jacobian.transpose() * &*jacobian;
    let slope = jacobian.transpose() * &at.residuals;
    for trial in 0..TRIALS {
        let mut damped = normal.clone();
        for i in 0..4 {
            damped[(i, i)] += (*damping + 1e-12) * normal[(i, i)].max(1e-30);
        }
        let mut is_small = false;
        let tried = damped.cholesky().and_then(|c| {
            let step = c.solve(&slope);
            let state = LinkState::from_fn(|i, _| at.state[i] - step[i]);
            is_small = 2.0 * slope.dot(&step) - step.dot(&(&normal * &step)) < at.least_gain();
            // derivatives are computed only if another step is likely to follow: not after the last allowed
            // step, a step of small expected gain, or a step with raised damping
            let ends = is_last || is_small || trial > 0;
            let build = if ends { StateTrial::without_jacobian } else { StateTrial::with_jacobian };
            build(point, frames, state)
        });
        let tried = tried.filter(|tried| tried.cost() < at.cost());
        if tried.is_some() {
            *damping = (*damping * 0.2).max(1e-7);
            return tried;
        }
        if is_small {
            return None; // a shorter step gains even less
        }
        *damping *= 8.0;
    }
    None
}

/// Computes chi2 of the segments after a step of the unknowns, and refits the starting states of the segments
/// whose chi2 has risen. `before` are the segments before the step.
pub(super) fn update_states(
    points: &[RecordingModel<'_>],
    before: &[SegmentState],
    segments: &mut [SegmentState],
    most: usize,
) {
    /// Rise of a segment's chi2 above which its starting state is refitted, in standard deviations of chi2.
    const RISE_SD: f64 = 0.05;
    segments.par_iter_mut().zip(before).for_each(|(segment, before)| {
        let point = &points[segment.recording];
        let found = point.whitened_residuals(segment.frames(), &segment.start_state());
        let chi2 = found.map_or(f64::INFINITY, |residuals| residuals.norm_squared());
        let allowed = before.chi2 + RISE_SD * (2.0 * before.data as f64).sqrt();
        segment.chi2 = chi2;
        if chi2 <= allowed && chi2.is_finite() {
            return;
        }
        refine_state(point, segment, most);
        // after a short step, the state before it is nearly right
        if segment.chi2 > allowed {
            try_state(point, segment, &before.start_state(), most);
        }
        // one segment without a run costs more than all others gain
        for state in rescue_candidates(point, segment, None, RescuePolicy::Never) {
            if segment.chi2.is_finite() {
                return;
            }
            try_state(point, segment, &state, most);
        }
    });
}

/// Fits the starting states of all segments, and restarts bad segments from other states.
pub(super) fn fit_states(
    points: &[RecordingModel<'_>],
    segments: &mut [SegmentState],
    most: usize,
    rescue: RescuePolicy,
) {
    if most > 0 {
        segments.par_iter_mut().for_each(|segment| refine_state(&points[segment.recording], segment, most));
    }
    rescue_states(points, segments, most, rescue);
}

/// Restarts bad segments from other states.
pub(super) fn rescue_states(
    points: &[RecordingModel<'_>],
    segments: &mut [SegmentState],
    most: usize,
    rescue: RescuePolicy,
) {
    if rescue == RescuePolicy::Never {
        return;
    }
    let enough = |segment: &SegmentState| {
        let data = segment.data.max(1) as f64;
        match rescue {
            RescuePolicy::Beyond(times) => times * data,
            _ => data - 4.0 + 2.0 * (2.0 * data).sqrt(),
        }
    };
    let bad = segments.iter().filter(|segment| segment.chi2 >= enough(segment)).count();
    let few = rescue == RescuePolicy::Thorough || bad as f64 <= MAX_RESCUED_SHARE * segments.len() as f64;
    if bad == 0 || !few {
        return;
    }
    let follows = previous_end_states(points, segments);
    segments.par_iter_mut().zip(follows).for_each(|(segment, follows)| {
        let (point, enough) = (&points[segment.recording], enough(segment));
        if segment.chi2 < enough {
            return;
        }
        for state in rescue_candidates(point, segment, follows, rescue) {
            try_state(point, segment, &state, most.max(6));
            if segment.chi2 < enough {
                return;
            }
        }
    });
}

/// Fits the starting state of a segment again from `state`, and keeps the result if it lowers chi2.
fn try_state(point: &RecordingModel<'_>, segment: &mut SegmentState, state: &LinkState, most: usize) {
    let mut tried = SegmentState { start: (*state).into(), ..segment.clone() };
    refine_state(point, &mut tried, most);
    if tried.chi2 < segment.chi2 {
        *segment = tried;
    }
}

/// For every segment, the state at the end of the previous segment; `None` if the two segments are not
/// adjacent or the run of the previous segment fails.
fn previous_end_states(points: &[RecordingModel<'_>], segments: &[SegmentState]) -> Vec<Option<LinkState>> {
    let end = |s: &SegmentState| {
        s.chi2.is_finite().then(|| points[s.recording].end_state(s.frames(), &s.start_state()))?
    };
    let ends: Vec<Option<LinkState>> = segments.par_iter().map(end).collect();
    let from = |k: usize| {
        let before = k.checked_sub(1)?;
        let joined =
            segments[before].recording == segments[k].recording && segments[before].last == segments[k].first;
        ends[before].filter(|_| joined)
    };
    (0..segments.len()).map(from).collect()
}

/// Fits every starting state again from the state at the end of the previous segment, and keeps the result if
/// it lowers chi2. The motion is continuous, so this can find a better minimum of chi2.
pub(super) fn join_states(points: &[RecordingModel<'_>], segments: &mut [SegmentState], most: usize) {
    let follows = previous_end_states(points, segments);
    segments.par_iter_mut().zip(follows).for_each(|(segment, follows)| {
        if let Some(state) = follows {
            try_state(&points[segment.recording], segment, &state, most);
        }
    });
}

fn rescue_candidates(
    point: &RecordingModel<'_>,
    segment: &SegmentState,
    follows: Option<LinkState>,
    rescue: RescuePolicy,
) -> Vec<LinkState> {
    /// Changes of the angular velocities of neck and lip, rad per first segment length, that are added to the
    /// recorded state, one at a time.
    const RATES: [[f64; 2]; 4] = [[0.24, 0.0], [-0.24, 0.0], [0.0, 0.48], [0.0, -0.48]];
    let per_s = 1.0 / point.observation.first_segment_s;
    let seen = LinkState::from(segment.shown);
    let mut states = vec![seen];
    if rescue == RescuePolicy::Thorough {
        states.extend(weakest_direction_states(point, segment).unwrap_or_default());
    }
    states.extend(follows);
    let units = point.scene.linkage.angle_units().map(|unit| unit * per_s);
    states.extend(RATES.map(|[neck, lip]| seen + LinkState::new(0.0, 0.0, neck * units[0], lip * units[1])));
    states
}

/// States 3, 10 and 30 standard deviations away from the segment's start state, both forwards and backwards
/// along each of the two least determined directions.
fn weakest_direction_states(point: &RecordingModel<'_>, segment: &SegmentState) -> Option<Vec<LinkState>> {
    let state = segment.start_state();
    let jacobian = point.linearize_state(segment.frames(), &state)?.by_state;
    let steps = point.state_steps();
    let scaled = Matrix4::from_fn(|a, b| jacobian.column(a).dot(&jacobian.column(b)) * steps[a] * steps[b]);
    let eigen = scaled.symmetric_eigen();
    let mut order = [0, 1, 2, 3];
    portable_math::sort_by_number(&mut order, |&a| eigen.eigenvalues[a]);
    let mut states = Vec::new();
    for &i in &order[..2] {
        let sd = 1.0 / eigen.eigenvalues[i].max(1e-9).sqrt();
        let direction = LinkState::from_fn(|k, _| eigen.eigenvectors[(k, i)] * steps[k]);
        states.extend([3.0, -3.0, 10.0, -10.0, 30.0, -30.0].map(|times| state + direction * (times * sd)));
    }
    Some(states)
}
