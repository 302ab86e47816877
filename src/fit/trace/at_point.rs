//! How well traces fit at one point, with the starting states of the segments fitted and nothing else.

use super::chain::{MOST_INNER, begin};
use super::iterate::{Iterate, Settings};
use super::model::TraceModel;
use super::outer::{cost, points};
use super::residual::residuals;
use super::states::{Rescue, join, settle};
use std::collections::BTreeMap;

/// The segments of the last stage at a point, their states where they fit best; `None` where a scene refuses
/// the point. A function of the point alone.
#[must_use]
pub fn at_point(model: &TraceModel, segment_s: &[f64], point: &[f64]) -> Option<Iterate> {
    let last = Settings { segment_s: segment_s.last().copied().into_iter().collect(), twins: 0 };
    let mut at = begin(model, &last, point)?;
    let points = points(model, point)?;
    settle(&points, &mut at.segments, MOST_INNER, Rescue::Thorough);
    join(&points, &mut at.segments, MOST_INNER);
    at.plain = true;
    at.cost = cost(&at.segments, true) + model.unknowns.prior_cost(point);
    Some(at)
}

/// Whitened residuals of every frame that is fitted, recording by recording, tip before head; `None` where
/// the model has none.
#[must_use]
pub fn frame_residuals(model: &TraceModel, at: Option<&Iterate>) -> Vec<Option<f64>> {
    let mut known = BTreeMap::new();
    for segment in at.map(|at| residuals(model, at)).unwrap_or_default() {
        let place = |frame: &usize| (segment.film, segment.is_drop, *frame);
        known.extend(segment.frames.iter().map(place).zip(segment.whitened.iter().copied()));
    }
    let films = model.shoots.iter().enumerate().flat_map(|(film, shoot)| {
        let [first, last] = shoot.film.settings.frames;
        let [tip, drop] = shoot.film.frames(first, last);
        let of = move |is_drop: bool| move |frame: usize| (film, is_drop, frame);
        tip.into_iter().map(of(false)).chain(drop.into_iter().map(of(true)))
    });
    films.map(|place| known.get(&place).copied()).collect()
}
