//! The search as a chain of iterates. Each iterate is a pure function of the previous one, so a search that
//! resumes from a journal continues with exactly the same numbers.

use super::camera_observation::CameraObservation;
use super::initial_states::{RescuePolicy, fit_states, join_states, rescue_states, update_states};
use super::iterate::{Iterate, SegmentState, TraceDescent, TraceSearchSettings, is_slider};
use super::model::TraceModel;
use super::normal_equations::{NormalEquations, carry_states, damped_step, normal_equations};
use super::normal_equations::{recording_models, segments_cost};
use super::segment_simulation::{LinkState, RecordingModel};
use super::segmentation::{SegmentBoundary, nominal_frames, segment_boundaries};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Maximum number of outer steps (steps of the unknowns) in a phase.
pub(super) const MAX_STEPS: usize = 40;
/// Maximum number of outer steps of a stage, after the first, whose iterates explain nothing. With a right
/// model, the end of the stage before already fits well, so more steps would not help.
const MAX_JUNK_STEPS: usize = 6;
/// Maximum number of steps in the fit of a segment's starting state after each outer step.
pub(super) const MAX_STATE_STEPS: usize = 8;
/// Maximum number of iterates of a search that is not the main one.
const MAX_ITERATES: usize = 60;
const FIRST_DAMPING: f64 = 1e-3;

/// The first iterate of a search that starts at `point`; `None` if a scene refuses the point.
#[must_use]
pub fn first_iterate(model: &TraceModel, settings: &TraceSearchSettings, point: &[f64]) -> Option<Iterate> {
    start_stage(model, settings, (0, false), point, &[])
}

/// Cost of the segments and the priors at a point.
fn total_cost(model: &TraceModel, point: &[f64], segments: &[SegmentState], plain: bool) -> f64 {
    segments_cost(segments, plain) + model.unknowns.prior_cost(point)
}

/// The iterate with its starting states fitted in at most `most` steps; `None` if a scene refuses the
/// iterate's point.
pub(super) fn refit(
    model: &TraceModel,
    mut at: Iterate,
    most: usize,
    rescue: RescuePolicy,
) -> Option<Iterate> {
    let points = recording_models(model, &at.point)?;
    fit_states(&points, &mut at.segments, most, rescue);
    at.cost = total_cost(model, &at.point, &at.segments, at.plain);
    Some(at)
}

/// The first iterate of a search with plain chi2 that starts at `point`, on the segments of `end`; `None` if
/// a scene refuses the point.
pub(crate) fn restart_search(model: &TraceModel, end: &Iterate, point: Vec<f64>) -> Option<Iterate> {
    let first =
        Iterate { point, plain: true, settled: false, number: 0, damping: FIRST_DAMPING, ..end.clone() };
    refit(model, first, MAX_STATE_STEPS, RescuePolicy::Beyond(3.0))
}

/// The iterate with plain chi2 as cost and with its starting states fitted as well as possible; `None` if a
/// scene refuses the iterate's point.
pub(super) fn refit_plain(model: &TraceModel, mut at: Iterate) -> Option<Iterate> {
    let points = recording_models(model, &at.point)?;
    fit_states(&points, &mut at.segments, MAX_STATE_STEPS, RescuePolicy::Thorough);
    join_states(&points, &mut at.segments, MAX_STATE_STEPS);
    at.plain = true;
    at.cost = total_cost(model, &at.point, &at.segments, true);
    Some(at)
}

/// The iterate that follows `before`; `None` at the end of the search.
#[must_use]
pub fn next_iterate(model: &TraceModel, settings: &TraceSearchSettings, before: &Iterate) -> Option<Iterate> {
    if !before.settled {
        return Some(outer_step(model, before, holds_constants(model, settings, before)));
    }
    if holds_constants(model, settings, before) {
        let next = Iterate { settled: false, number: 0, damping: FIRST_DAMPING, ..before.clone() };
        return Some(Iterate { repeats: 1, ..next });
    }
    if before.is_junk(model) {
        // neither other starting states nor longer segments help
        return is_slider(model).then(|| continue_plain(model, settings, before))?;
    }
    let bad = before.count_bad_segments();
    let stage = before.stage + 1;
    // (if many segments are bad, the parameters are wrong rather than the starting states)
    if bad > 0
        && 4 * bad <= before.segments.len()
        && let Some(rescued) = rescue_segments(model, before)
    {
        return Some(rescued);
    }
    if stage == settings.segment_s.len() && !before.plain && bad == 0 {
        let next = Iterate { settled: false, number: 0, ..before.clone() };
        return refit_plain(model, next);
    }
    if stage < settings.segment_s.len() {
        return start_stage(model, settings, (stage, before.whole), &before.point, &before.segments);
    }
    resegment(model, settings, before)
}

/// The iterate that follows the end of a stage of a slider that explains nothing: the same stage, and then
/// the next one, with plain chi2 as cost; `None` at the end of the search. A law of friction hardly ever
/// explains sensors that resolve a thousandth of the motion. The least-squares fit still gives the friction
/// that is nearest, with intervals from the scatter of the segments.
fn continue_plain(model: &TraceModel, settings: &TraceSearchSettings, before: &Iterate) -> Option<Iterate> {
    let stage = before.stage + 1;
    if !before.plain {
        return refit_plain(model, Iterate { settled: false, number: 0, ..before.clone() });
    }
    if stage == settings.segment_s.len() {
        return None;
    }
    let next = start_stage(model, settings, (stage, before.whole), &before.point, &before.segments)?;
    let cost = total_cost(model, &next.point, &next.segments, true);
    Some(Iterate { plain: true, cost, ..next })
}

/// The search through all stages that begins with the iterate `first`.
///
/// # Errors
/// The error of `check_stop`, which is called before each step.
pub(crate) fn follow_stages<E>(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    first: Iterate,
    check_stop: &mut dyn FnMut() -> Result<(), E>,
) -> Result<TraceDescent, E> {
    let mut descent = TraceDescent { start: 0, stages: vec![first.clone()], iterates: 1 };
    let mut at = first;
    while descent.iterates < MAX_ITERATES {
        check_stop()?;
        let Some(next) = next_iterate(model, settings, &at) else { break };
        descent.stages.pop_if(|before| before.stage == next.stage);
        descent.stages.push(next.clone());
        descent.iterates += 1;
        at = next;
    }
    Ok(descent)
}

/// The iterate after bad segments were restarted from other starting states; `None` if this lowers the cost
/// too little.
fn rescue_segments(model: &TraceModel, before: &Iterate) -> Option<Iterate> {
    const MOST_TIMES: usize = 3;
    /// The stage continues only if the restarts lower the cost by more than this amount.
    const LEAST_GAIN: f64 = 1.0;
    if before.rescues == MOST_TIMES {
        return None;
    }
    let next = Iterate { number: 0, settled: false, damping: FIRST_DAMPING, ..before.clone() };
    let next = Iterate { rescues: before.rescues + 1, ..next };
    refit(model, next, MAX_STATE_STEPS, RescuePolicy::Thorough)
        .filter(|next| next.cost < before.cost - LEAST_GAIN)
}

/// Repeats the last stage if the parameters and camera errors at its end give other segment boundaries, so
/// that the result does not depend on the path of the search. `None` if the boundaries do not change.
fn resegment(model: &TraceModel, settings: &TraceSearchSettings, before: &Iterate) -> Option<Iterate> {
    const MOST_REPEATS: usize = 3;
    let points = recording_models(model, &before.point)?;
    let cut = cut_stage(&points, settings, (before.stage, before.whole));
    let frames = |segment: &SegmentState| (segment.recording, segment.frames());
    if cut.iter().map(frames).eq(before.segments.iter().map(frames)) || before.repeats == MOST_REPEATS {
        return None;
    }
    let again = start_stage(model, settings, (before.stage, before.whole), &before.point, &before.segments)?;
    if before.plain && again.count_bad_segments() > 0 {
        return None;
    }
    let cost = total_cost(model, &again.point, &again.segments, before.plain);
    Some(Iterate { repeats: before.repeats + 1, plain: before.plain, cost, ..again })
}

/// The first iterate of a stage: new segments whose starting states lie on the fitted motion of the segments
/// `before`. With `whole`, segments keep all their frames; otherwise a segment that is much longer than the
/// length of the stage ends after that length. `None` if a scene refuses the point.
pub(crate) fn start_stage(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    (stage, whole): (usize, bool),
    point: &[f64],
    before: &[SegmentState],
) -> Option<Iterate> {
    let points = recording_models(model, point)?;
    let mut segments = cut_stage(&points, settings, (stage, whole));
    segments.par_iter_mut().for_each(|segment| {
        if let Some(state) = carry_state_over(&points[segment.recording], before, segment) {
            segment.start = state.into();
        }
    });
    let first = Iterate {
        stage,
        number: 0,
        repeats: 0,
        rescues: 0,
        whole,
        plain: false,
        settled: segments.is_empty(),
        damping: FIRST_DAMPING,
        point: point.to_vec(),
        segments,
        cost: f64::INFINITY,
    };
    refit(model, first, MAX_STATE_STEPS, RescuePolicy::Beyond(3.0))
}

/// Divides all recordings into the segments of a stage, of which at most the number in `settings` is kept.
fn cut_stage(
    points: &[RecordingModel<'_>],
    settings: &TraceSearchSettings,
    (stage, whole): (usize, bool),
) -> Vec<SegmentState> {
    let mut segments = cut_recordings(points, settings.segment_s[stage], whole);
    if let Some(most) = settings.max_segments.filter(|most| *most < segments.len()) {
        let count = segments.len();
        segments = (0..most).map(|k| segments[k * count / most].clone()).collect();
    }
    segments
}

/// Divides all recordings into segments. Without `whole`, a segment that is much longer than `length_s` ends
/// after `length_s`.
pub(super) fn cut_recordings(points: &[RecordingModel<'_>], length_s: f64, whole: bool) -> Vec<SegmentState> {
    let mut segments: Vec<SegmentState> =
        points.iter().enumerate().flat_map(|(film, at)| cut_recording(at, film, length_s)).collect();
    for segment in segments.iter_mut().filter(|_| !whole) {
        let film = points[segment.recording].observation;
        if is_long(film, segment, length_s) {
            segment.last = segment.first + nominal_frames(film, length_s);
            segment.data = film.count_data(segment.first, segment.last);
        }
    }
    segments
}

/// Whether a segment is much longer than the length `length_s` of its stage. No segment starts while the tip
/// sticks or the blade flips over, so one segment spans the whole reversal of the head.
pub(super) fn is_long(film: &CameraObservation, segment: &SegmentState, length_s: f64) -> bool {
    const LONG: f64 = 1.5;
    (segment.last - segment.first) as f64 > LONG * nominal_frames(film, length_s) as f64
}

fn cut_recording(at: &RecordingModel<'_>, film: usize, length_s: f64) -> Vec<SegmentState> {
    let starts = segment_boundaries(&at.scene, at.observation, &at.geometry.camera, length_s);
    let end = at.observation.settings.frames[1];
    let lasts = starts.iter().skip(1).map(|next| next.frame).chain([end]);
    let segment = |(start, last): (&SegmentBoundary, usize)| SegmentState {
        recording: film,
        first: start.frame,
        last,
        start: start.state.into(),
        shown: start.state.into(),
        chi2: f64::INFINITY,
        data: at.observation.count_data(start.frame, last),
    };
    starts.iter().zip(lasts).map(segment).collect()
}

/// State of the blade at the start of a new segment, on the fitted motion of an old segment; `None` if the
/// old segment fits badly.
fn carry_state_over(
    point: &RecordingModel<'_>,
    before: &[SegmentState],
    segment: &SegmentState,
) -> Option<LinkState> {
    let holds = |old: &&SegmentState| {
        old.recording == segment.recording && (old.first..old.last).contains(&segment.first)
    };
    let old = before.iter().find(holds)?;
    if old.chi2 >= 1.5 * old.data as f64 + 20.0 {
        return None;
    }
    if old.first == segment.first {
        return Some(old.start_state());
    }
    point.end_state([old.first, segment.first], &old.start_state())
}

/// Whether the constants are held at their prior means. They are held in the first stage until it is
/// repeated, because far from the minimum they would absorb the misfit of wrong parameters. Longer segments
/// do not fit with wrong constants.
fn holds_constants(model: &TraceModel, settings: &TraceSearchSettings, at: &Iterate) -> bool {
    at.stage == 0
        && at.repeats == 0
        && settings.segment_s.len() > 1
        && (0..at.point.len()).any(|i| model.unknowns.is_constant(i))
}

/// One outer step; with `held`, the constants keep their values. If no step of the unknowns lowers the cost,
/// only the starting states are fitted; if this does not lower the cost either, the iterate is settled.
pub(crate) fn outer_step(model: &TraceModel, before: &Iterate, held: bool) -> Iterate {
    /// Smallest decrease of the cost after which another step is made if only the starting states were
    /// fitted: that of a step of a tenth of a standard deviation.
    const LEAST_STATE_GAIN: f64 = 1e-2;
    const TRIALS: usize = 6;
    let number = before.number + 1;
    let is_late = !held && before.stage > 0 && number >= MAX_JUNK_STEPS;
    // (a least-squares fit goes on to its minimum)
    let is_lost = is_late && before.is_junk(model) && !(before.plain && is_slider(model));
    let used_up = number >= MAX_STEPS || is_lost;
    let stay = || Iterate { number, settled: true, ..before.clone() };
    let Some(at) = normal_equations(model, &before.point, &before.segments, before.plain) else {
        return stay();
    };
    let mut damping = before.damping;
    // The plain phase (cost chi2) ends when a step is shorter than a hundredth of a standard deviation. The
    // robust phase only prepares the plain phase. It ends with a step that lowers the cost by much less than
    // noise changes it, because many such steps would follow along a direction that short segments hardly
    // determine.
    let (least_gain, least_move) = if before.plain { (1e-4, 1e-2) } else { (0.1, f64::INFINITY) };
    // both thresholds scale with the misfit per datum, because a large remaining misfit also makes the
    // estimates less certain
    let unit = (before.cost / before.count_data().max(1) as f64).max(1.0);
    let (least_gain, least_move) = (least_gain * unit, least_move * unit.sqrt());
    for _ in 0..TRIALS {
        let tried = damped_step(model, &before.point, &at, damping, held)
            .and_then(|point| accept_if_lower(model, before, &at, point));
        if let Some(found) = tried {
            let gain = before.cost - found.cost;
            let moved = step_in_sds(&at.matrix, &before.point, &found.point);
            let settled = !(gain > least_gain || moved > least_move) || used_up;
            return Iterate { damping: (damping * 0.2).max(1e-6), settled, number, ..found };
        }
        damping *= 10.0;
    }
    match refit(model, before.clone(), MAX_STATE_STEPS, RescuePolicy::Beyond(3.0)) {
        Some(found) if before.cost - found.cost > LEAST_STATE_GAIN * unit => {
            Iterate { damping: FIRST_DAMPING, settled: used_up, number, ..found }
        }
        _ => stay(),
    }
}

/// Length of the step between `from` and `to` in standard deviations (Mahalanobis distance).
fn step_in_sds(normal: &DMatrix<f64>, from: &[f64], to: &[f64]) -> f64 {
    let step = DVector::from_iterator(from.len(), to.iter().zip(from).map(|(to, from)| to - from));
    step.dot(&(normal * &step)).max(0.0).sqrt()
}

/// The iterate at `point`, if it has a lower cost than `before`.
fn accept_if_lower(
    model: &TraceModel,
    before: &Iterate,
    at: &NormalEquations,
    point: Vec<f64>,
) -> Option<Iterate> {
    let moved = DVector::from_iterator(point.len(), point.iter().zip(&before.point).map(|(a, b)| a - b));
    let mut segments = carry_states(model, &before.segments, at, &moved);
    let points = recording_models(model, &point)?;
    update_states(&points, &before.segments, &mut segments, MAX_STATE_STEPS);
    rescue_states(&points, &mut segments, MAX_STATE_STEPS, RescuePolicy::Beyond(4.0));
    let cost = total_cost(model, &point, &segments, before.plain);
    (cost < before.cost).then(|| Iterate { point, segments, cost, ..before.clone() })
}
