//! The search as a chain of iterates, each a pure function of the one before: what a journal keeps of one is
//! all that a resumed search needs, and it goes on bit for bit.

use super::checkpoint::{Iterate, SegmentState, TraceSearchSettings};
use super::initial_states::{RescuePolicy, fit_states, join_states, rescue_states, update_states};
use super::model::TraceModel;
use super::normal_equations::{carry_states, damped_step, normal_equations, recording_models, segments_cost};
use super::segment_simulation::{LinkState, RecordingModel};
use super::segmentation::{SegmentBoundary, segment_boundaries};
use super::unknowns::CameraParameters;
use nalgebra::DVector;
use rayon::prelude::*;

/// Most outer steps of a phase.
pub(super) const MAX_STEPS: usize = 40;
/// Most steps of a segment's state after one.
pub(super) const MAX_STATE_STEPS: usize = 8;
const FIRST_DAMPING: f64 = 1e-3;

/// The first iterate of a search from a point.
#[must_use]
pub fn first_iterate(model: &TraceModel, settings: &TraceSearchSettings, point: &[f64]) -> Option<Iterate> {
    start_stage(model, settings, 0, point.to_vec(), &[])
}

/// The iterate after one; `None` at the end of the search.
#[must_use]
pub fn next_iterate(model: &TraceModel, settings: &TraceSearchSettings, before: &Iterate) -> Option<Iterate> {
    if !before.settled {
        return Some(outer_step(model, before));
    }
    let bad = before.segments.iter().filter(|segment| segment.is_bad()).count();
    let is_last = before.stage + 1 == settings.segment_s.len();
    // (where most of them do not fit it is not their states)
    if bad > 0
        && 4 * bad <= before.segments.len()
        && let Some(mended) = rescue_segments(model, before)
    {
        return Some(mended);
    }
    if is_last && !before.plain && bad == 0 {
        let mut next = Iterate { plain: true, settled: false, number: 0, ..before.clone() };
        next.damping = FIRST_DAMPING;
        let points = recording_models(model, &next.point)?;
        fit_states(&points, &mut next.segments, MAX_STATE_STEPS, RescuePolicy::Thorough);
        join_states(&points, &mut next.segments, MAX_STATE_STEPS);
        next.cost = segments_cost(&next.segments, true) + model.unknowns.prior_cost(&next.point);
        return Some(next);
    }
    let stage = before.stage + 1;
    if stage < settings.segment_s.len() {
        return start_stage(model, settings, stage, before.point.clone(), &before.segments);
    }
    resegment(model, settings, before)
}

/// The same place with the states of segments that do not fit found elsewhere, where that lowers the cost.
fn rescue_segments(model: &TraceModel, before: &Iterate) -> Option<Iterate> {
    const MOST_TIMES: usize = 3;
    /// Fall of the cost for which the stage goes on.
    const LEAST_GAIN: f64 = 1.0;
    if before.rescues == MOST_TIMES {
        return None;
    }
    let points = recording_models(model, &before.point)?;
    let mut segments = before.segments.clone();
    fit_states(&points, &mut segments, MAX_STATE_STEPS, RescuePolicy::Thorough);
    let cost = segments_cost(&segments, before.plain) + model.unknowns.prior_cost(&before.point);
    let (mended, damping) = (before.rescues + 1, FIRST_DAMPING);
    let next =
        Iterate { segments, cost, rescues: mended, damping, number: 0, settled: false, ..before.clone() };
    (cost < before.cost - LEAST_GAIN).then_some(next)
}

/// The last stage once more where its end puts the boundaries elsewhere than its beginning did: the result
/// does not depend on the way to it. `None` where they stay.
fn resegment(model: &TraceModel, settings: &TraceSearchSettings, before: &Iterate) -> Option<Iterate> {
    const MOST_CUTS: usize = 3;
    let frames = |segments: &[SegmentState]| {
        segments.iter().map(|s| (s.recording, s.first, s.last)).collect::<Vec<_>>()
    };
    let points = recording_models(model, &before.point)?;
    let same = frames(&cut_recordings(&points, settings.segment_s[before.stage])) == frames(&before.segments);
    if same || before.cuts == MOST_CUTS {
        return None;
    }
    let again = start_stage(model, settings, before.stage, before.point.clone(), &before.segments)?;
    if before.plain && again.segments.iter().any(SegmentState::is_bad) {
        return None;
    }
    let cost = segments_cost(&again.segments, before.plain) + model.unknowns.prior_cost(&again.point);
    Some(Iterate { cuts: before.cuts + 1, plain: before.plain, cost, ..again })
}

/// The first iterate of an earlier stage, from the end of a search; `None` where a scene refuses that.
pub(super) fn restart_stage(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    stage: usize,
    end: &Iterate,
) -> Option<Iterate> {
    start_stage(model, settings, stage, end.point.clone(), &end.segments)
}

/// The first iterate of a stage: new segments, their states those of the fitted motion so far.
fn start_stage(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    stage: usize,
    point: Vec<f64>,
    before: &[SegmentState],
) -> Option<Iterate> {
    let points = recording_models(model, &point)?;
    let mut segments = cut_recordings(&points, settings.segment_s[stage]);
    segments.par_iter_mut().for_each(|segment| {
        if let Some(state) = carry_state_over(&points[segment.recording], before, segment) {
            segment.set_start_state(&state);
        }
    });
    fit_states(&points, &mut segments, MAX_STATE_STEPS, RescuePolicy::Beyond(3.0));
    let cost = segments_cost(&segments, false) + model.unknowns.prior_cost(&point);
    let (number, plain, settled) = (0, false, segments.is_empty());
    let (damping, cuts, mended) = (FIRST_DAMPING, 0, 0);
    Some(Iterate { stage, number, cuts, rescues: mended, plain, settled, damping, point, segments, cost })
}

/// The segments of all recordings.
fn cut_recordings(points: &[RecordingModel<'_>], length_s: f64) -> Vec<SegmentState> {
    points.iter().enumerate().flat_map(|(film, at)| cut_recording(at, film, &at.camera, length_s)).collect()
}

fn cut_recording(
    at: &RecordingModel<'_>,
    film: usize,
    view: &CameraParameters,
    length_s: f64,
) -> Vec<SegmentState> {
    let starts = segment_boundaries(&at.scene, at.observation, view, length_s);
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

/// State at the start of a new segment on the fitted motion of an old one, where that fits.
fn carry_state_over(
    point: &RecordingModel<'_>,
    before: &[SegmentState],
    segment: &SegmentState,
) -> Option<LinkState> {
    let old = before
        .iter()
        .find(|old| old.recording == segment.recording && (old.first..old.last).contains(&segment.first))?;
    if old.chi2 >= 1.5 * old.data as f64 + 20.0 {
        return None;
    }
    if old.first == segment.first {
        return Some(old.start_state());
    }
    point.end_state([old.first, segment.first], &old.start_state())
}

/// One outer step; where none lowers the cost, the states alone are fitted, and where that does not lower it
/// either, the same iterate, settled.
pub(super) fn outer_step(model: &TraceModel, before: &Iterate) -> Iterate {
    const TRIALS: usize = 6;
    let number = before.number + 1;
    let used_up = number >= MAX_STEPS;
    let stay = || Iterate { number, settled: true, ..before.clone() };
    let Some(at) = normal_equations(model, &before.point, &before.segments, before.plain) else {
        return stay();
    };
    let mut damping = before.damping;
    // the plain phase ends where a step is a hundredth of a deviation; the robust one only leads there
    let (least_gain, least_move) = if before.plain { (1e-4, 1e-2) } else { (1e-2, 0.3) };
    // (both in units of a cost that no model lowers)
    let data: usize = before.segments.iter().map(|segment| segment.data).sum();
    let unit = (before.cost / data.max(1) as f64).max(1.0);
    let (least_gain, least_move) = (least_gain * unit, least_move * unit.sqrt());
    for _ in 0..TRIALS {
        let tried = damped_step(model, &before.point, &at, damping)
            .and_then(|point| accept_if_lower(model, before, &at, point));
        if let Some(found) = tried {
            let gain = before.cost - found.cost;
            let moved = step_in_sds(&at.matrix, &before.point, &found.point);
            let settled = !(gain > least_gain || moved > least_move) || used_up;
            return Iterate { damping: (damping * 0.2).max(1e-6), settled, number, ..found };
        }
        damping *= 10.0;
    }
    match refit_states(model, before) {
        Some(found) if before.cost - found.cost > least_gain => {
            Iterate { damping: FIRST_DAMPING, settled: used_up, number, ..found }
        }
        _ => stay(),
    }
}

/// The same place with all states fitted.
fn refit_states(model: &TraceModel, before: &Iterate) -> Option<Iterate> {
    let points = recording_models(model, &before.point)?;
    let mut segments = before.segments.clone();
    fit_states(&points, &mut segments, MAX_STATE_STEPS, RescuePolicy::Beyond(3.0));
    let cost = segments_cost(&segments, before.plain) + model.unknowns.prior_cost(&before.point);
    Some(Iterate { segments, cost, ..before.clone() })
}

/// Largest move of a coordinate in its conditional standard deviations.
fn step_in_sds(normal: &nalgebra::DMatrix<f64>, from: &[f64], to: &[f64]) -> f64 {
    (0..from.len()).map(|i| ((to[i] - from[i]) * normal[(i, i)].sqrt()).abs()).fold(0.0, f64::max)
}

/// The iterate at a point, if it lowers the cost.
fn accept_if_lower(
    model: &TraceModel,
    before: &Iterate,
    at: &super::normal_equations::NormalEquations,
    point: Vec<f64>,
) -> Option<Iterate> {
    let moved = DVector::from_iterator(point.len(), point.iter().zip(&before.point).map(|(a, b)| a - b));
    let mut segments = carry_states(&before.segments, at, &moved);
    let points = recording_models(model, &point)?;
    update_states(&points, &mut segments, MAX_STATE_STEPS);
    rescue_states(&points, &mut segments, MAX_STATE_STEPS, RescuePolicy::Beyond(4.0));
    let cost = segments_cost(&segments, before.plain) + model.unknowns.prior_cost(&point);
    (cost < before.cost).then(|| Iterate { point, segments, cost, ..before.clone() })
}
