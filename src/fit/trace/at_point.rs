//! How well traces fit at one point, with the starting states of the segments fitted and nothing else.

use super::chain::{MAX_STATE_STEPS, first_iterate};
use super::iterate::{Iterate, TraceSearchSettings};
use super::model::TraceModel;
use super::outer::{recording_models, segments_cost};
use super::residual::segment_residuals;
use super::states::{RescuePolicy, fit_states, join_states};
use std::collections::BTreeMap;

/// The segments of the last stage at a point, their states where they fit best; `None` where a scene refuses
/// the point. A function of the point alone.
#[must_use]
pub fn fit_states_at(model: &TraceModel, segment_s: &[f64], point: &[f64]) -> Option<Iterate> {
    let last = TraceSearchSettings { segment_s: segment_s.last().copied().into_iter().collect(), twins: 0 };
    let mut at = first_iterate(model, &last, point)?;
    let points = recording_models(model, point)?;
    fit_states(&points, &mut at.segments, MAX_STATE_STEPS, RescuePolicy::Thorough);
    join_states(&points, &mut at.segments, MAX_STATE_STEPS);
    at.plain = true;
    at.cost = segments_cost(&at.segments, true) + model.unknowns.prior_cost(point);
    Some(at)
}

/// Whitened residuals of every frame that is fitted, recording by recording, tip before head; `None` where
/// the model has none.
#[must_use]
pub fn frame_residuals(model: &TraceModel, at: Option<&Iterate>) -> Vec<Option<f64>> {
    let mut known = BTreeMap::new();
    for segment in at.map(|at| segment_residuals(model, at)).unwrap_or_default() {
        let place = |frame: &usize| (segment.recording, segment.is_drop, *frame);
        known.extend(segment.frames.iter().map(place).zip(segment.whitened.iter().copied()));
    }
    let films = model.recordings.iter().enumerate().flat_map(|(film, shoot)| {
        let [first, last] = shoot.observation.settings.frames;
        let [tip, drop] = shoot.observation.data_frames(first, last);
        let of = move |is_drop: bool| move |frame: usize| (film, is_drop, frame);
        tip.into_iter().map(of(false)).chain(drop.into_iter().map(of(true)))
    });
    films.map(|place| known.get(&place).copied()).collect()
}
