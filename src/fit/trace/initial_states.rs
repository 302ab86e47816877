//! The starting state of a segment, fitted with everything else held.

use super::checkpoint::SegmentState;
use super::segment_simulation::{LinkState, RecordingModel, STATE_STEPS};
use nalgebra::{DMatrix, DVector, Matrix4};
use rayon::prelude::*;

/// How a segment that does not fit is tried again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RescuePolicy {
    Never,
    /// From the state that the recording shows and from where the segment before ends, where chi2 exceeds
    /// this many times the number of data.
    Beyond(f64),
    /// Also along the two weakest directions, where chi2 exceeds what noise explains.
    Thorough,
}

/// Share of the segments that may have a wrong state.
const MAX_RESCUED_SHARE: f64 = 0.4;

/// Gain of chi2 below which a state is fitted, absolute and per datum.
const MIN_CHI2_GAIN: f64 = 1e-3;

/// A starting state with the residuals from there and, where they were asked for, their derivatives.
struct StateTrial {
    state: LinkState,
    residuals: DVector<f64>,
    jacobian: Option<DMatrix<f64>>,
}

impl StateTrial {
    fn with_jacobian(point: &RecordingModel<'_>, frames: [usize; 2], state: LinkState) -> Option<Self> {
        let (residuals, jacobian) = point.residuals_by_state(frames, &state)?;
        Some(Self { state, residuals, jacobian: Some(jacobian) })
    }

    /// The same without derivatives, at a third of the cost.
    fn without_jacobian(point: &RecordingModel<'_>, frames: [usize; 2], state: LinkState) -> Option<Self> {
        Some(Self { state, residuals: point.differentiable_residuals(frames, &state)?, jacobian: None })
    }

    fn cost(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// Gain from which on another step is worth its run.
    fn least_gain(&self) -> f64 {
        MIN_CHI2_GAIN * self.cost().min(self.residuals.len() as f64)
    }
}

/// Levenberg-Marquardt on the four numbers of a segment's start, at most `most` steps.
pub(super) fn refine_state(point: &RecordingModel<'_>, segment: &mut SegmentState, most: usize) {
    let frames = [segment.first, segment.last];
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
    segment.set_start_state(&at.state);
    (segment.chi2, segment.data) = (at.cost(), at.residuals.len());
}

/// A step that lowers the cost, its damping tried upwards.
fn lower_cost_step(
    point: &RecordingModel<'_>,
    frames: [usize; 2],
    at: &StateTrial,
    is_last: bool,
    damping: &mut f64,
) -> Option<StateTrial> {
    const TRIALS: usize = 6;
    let own;
    let jacobian = match &at.jacobian {
        Some(jacobian) => jacobian,
        None => {
            own = point.residuals_by_state(frames, &at.state)?.1;
            &own
        }
    };
    let normal = jacobian.transpose() * jacobian;
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
            // derivatives are needed where the step is taken and another follows: not where it is the last
            // that the model expects, nor where the first trial has failed
            is_small = 2.0 * slope.dot(&step) - step.dot(&(&normal * &step)) < at.least_gain();
            let ends = is_last || is_small || trial > 0;
            if ends {
                StateTrial::without_jacobian(point, frames, state)
            } else {
                StateTrial::with_jacobian(point, frames, state)
            }
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

/// Segments whose states have followed a step of the unknowns: those that fit worse than before are refined.
pub(super) fn update_states(points: &[RecordingModel<'_>], segments: &mut [SegmentState], most: usize) {
    /// Rise of chi2 from which a state is refined, in its standard deviations.
    const RISE_SD: f64 = 0.05;
    segments.par_iter_mut().for_each(|segment| {
        let point = &points[segment.recording];
        let found = point.whitened_residuals([segment.first, segment.last], &segment.start_state());
        let chi2 = found.map_or(f64::INFINITY, |residuals| residuals.norm_squared());
        let allowed = segment.chi2 + RISE_SD * (2.0 * segment.data as f64).sqrt();
        segment.chi2 = chi2;
        if chi2 > allowed {
            refine_state(point, segment, most);
        }
    });
}

/// Fits the states of all segments; those that do not fit are tried from elsewhere.
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

/// Tries segments that do not fit from elsewhere.
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
    // (where many do not fit it is the unknowns, and not their states)
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
            let mut tried = segment.clone();
            tried.set_start_state(&state);
            refine_state(point, &mut tried, most.max(6));
            if tried.chi2 < segment.chi2 {
                *segment = tried;
            }
            if segment.chi2 < enough {
                return;
            }
        }
    });
}

/// State in which the segment before each ends.
fn previous_end_states(points: &[RecordingModel<'_>], segments: &[SegmentState]) -> Vec<Option<LinkState>> {
    let ends: Vec<Option<LinkState>> = segments
        .par_iter()
        .map(|s| {
            s.chi2.is_finite().then(|| points[s.recording].end_state([s.first, s.last], &s.start_state()))?
        })
        .collect();
    let from = |k: usize| {
        let before = k.checked_sub(1)?;
        let joined =
            segments[before].recording == segments[k].recording && segments[before].last == segments[k].first;
        ends[before].filter(|_| joined)
    };
    (0..segments.len()).map(from).collect()
}

/// Tries every segment from where the one before ends: the motion is one, and a state in another valley of a
/// segment's chi2 is found by that.
pub(super) fn join_states(points: &[RecordingModel<'_>], segments: &mut [SegmentState], most: usize) {
    let follows = previous_end_states(points, segments);
    segments.par_iter_mut().zip(follows).for_each(|(segment, follows)| {
        let Some(state) = follows else { return };
        let mut tried = segment.clone();
        tried.set_start_state(&state);
        refine_state(&points[segment.recording], &mut tried, most);
        if tried.chi2 < segment.chi2 {
            *segment = tried;
        }
    });
}

fn rescue_candidates(
    point: &RecordingModel<'_>,
    segment: &SegmentState,
    follows: Option<LinkState>,
    rescue: RescuePolicy,
) -> Vec<LinkState> {
    /// Rates by which the first guess may be off, rad/s.
    const RATES: [[f64; 2]; 4] = [[60.0, 0.0], [-60.0, 0.0], [0.0, 120.0], [0.0, -120.0]];
    let seen = segment.recorded_state();
    let mut states = vec![seen];
    if rescue == RescuePolicy::Thorough {
        states.extend(weakest_direction_states(point, segment).unwrap_or_default());
    }
    states.extend(follows);
    states.extend(RATES.map(|[neck, lip]| seen + LinkState::new(0.0, 0.0, neck, lip)));
    states
}

/// States 3, 10 and 30 standard deviations along the two directions that the segment determines least.
fn weakest_direction_states(point: &RecordingModel<'_>, segment: &SegmentState) -> Option<Vec<LinkState>> {
    let (frames, state) = ([segment.first, segment.last], segment.start_state());
    let (_, jacobian) = point.residuals_by_state(frames, &state)?;
    let scaled = Matrix4::from_fn(|a, b| {
        jacobian.column(a).dot(&jacobian.column(b)) * STATE_STEPS[a] * STATE_STEPS[b]
    });
    let eigen = scaled.symmetric_eigen();
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mut states = Vec::new();
    for &i in &order[..2] {
        let sd = 1.0 / eigen.eigenvalues[i].max(1e-9).sqrt();
        let direction = LinkState::from_fn(|k, _| eigen.eigenvectors[(k, i)] * STATE_STEPS[k]);
        states.extend([3.0, -3.0, 10.0, -10.0, 30.0, -30.0].map(|times| state + direction * (times * sd)));
    }
    Some(states)
}
