//! Compares different ends of a search, and tests whether the recordings decide between them.

use super::initial_states::RescuePolicy;
use super::iterate::{Iterate, is_same_end};
use super::levenberg_marquardt::{MAX_STATE_STEPS, refit};
use super::segment_simulation::segment_residuals;
use super::uncertainty_run::SearchEnd;
use crate::model::parameters::find_parameter;
use crate::text::format_trimmed;
use std::collections::BTreeMap;

/// Smallest difference of the chi2 of two ends that decides against the worse one, in standard deviations of
/// this difference.
const LOST_SD: f64 = 4.0;
/// Rise of the cost above which a barrier separates two minima. Within one minimum, the cost rises by as much
/// at two standard deviations from the estimate.
const LEAST_BARRIER: f64 = 4.0;
/// Smallest number of frames in a block.
const MIN_BLOCK_FRAMES: usize = 4;

/// Whether `other` is no rival: the recordings decide against it, it belongs to the same minimum, or its cost
/// is not comparable.
pub(super) fn has_lost(end: &SearchEnd<'_>, other: &Iterate) -> bool {
    let comparable = (other.stage, other.plain, other.whole) == (end.at.stage, end.at.plain, end.at.whole);
    !comparable
        || !other.plain
        || is_same_end(end.model, end.at, other, &end.sd)
        || evidence_against(end, other) >= LOST_SD
        || is_same_valley(end, other)
}

/// Whether another end belongs to the same minimum as the best end: they are close, or no barrier of the cost
/// lies between them. A search may stop anywhere along a direction that the recordings hardly determine.
pub(super) fn is_same_minimum(end: &SearchEnd<'_>, other: &Iterate) -> bool {
    other.plain == end.at.plain
        && (is_same_end(end.model, end.at, other, &end.sd) || (other.plain && is_same_valley(end, other)))
}

/// Whether the cost at five places on the straight line from one end to another never exceeds that of the
/// higher end by more than [`LEAST_BARRIER`]. The places are not evenly spaced, so that they do not all fall
/// into minima of a periodic cost. At each place the starting states are fitted again, from those of the
/// place before.
fn is_same_valley(end: &SearchEnd<'_>, other: &Iterate) -> bool {
    const PLACES: [f64; 5] = [0.25, 0.4, 0.5, 0.6, 0.75];
    let at = end.at;
    if (other.stage, other.whole) != (at.stage, at.whole) {
        return false;
    }
    let highest = at.cost.max(other.cost) + LEAST_BARRIER;
    let mut place = Some(at.clone());
    PLACES.iter().all(|share| {
        let moved = place.take().and_then(|mut place| {
            let between = at.point.iter().zip(&other.point).map(|(a, b)| a + share * (b - a));
            place.point = between.collect();
            refit(end.model, place, MAX_STATE_STEPS, RescuePolicy::Never)
        });
        place = moved.filter(|place| place.cost <= highest);
        place.is_some()
    })
}

/// A reason to doubt the estimate of a parameter if the minimum `rival`, against which the recordings do not
/// decide, moves it by more than a standard deviation.
pub(super) fn describe_rival(end: &SearchEnd<'_>, rival: &Iterate, i: usize) -> Option<String> {
    let unknowns = &end.model.unknowns;
    let name = unknowns.parameter_name(i)?;
    if (rival.point[i] - end.at.point[i]).abs() <= end.sd[i] {
        return None;
    }
    let unit = find_parameter(name).map_or("1", |parameter| parameter.unit);
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    let value = format_trimmed(unknowns.0[i].value(rival.point[i]), 3);
    Some(format!("another minimum, with {name} at {value}{unit}, fits nearly as well"))
}

/// Evidence against `other`: the difference of chi2, with the cost of the priors, in standard deviations.
/// If the noise is white, the standard deviation of a difference of chi2 is twice its root. Otherwise it
/// shows in the scatter of the difference over blocks of equal time. This scatter is larger where most of
/// the difference lies in a few blocks, so the smaller of the two standard deviations counts. (Segments
/// are not suitable as blocks, because most of the difference may lie in the one long segment.)
fn evidence_against(search: &SearchEnd<'_>, other: &Iterate) -> f64 {
    let SearchEnd { model, settings, at: end, widening, .. } = search;
    let block_s = 0.25 * settings.segment_s[0];
    let by_frame = |at: &Iterate| {
        let mut found: BTreeMap<(usize, usize, bool), f64> = BTreeMap::new();
        for part in segment_residuals(model, at) {
            let squares = part.frames.iter().zip(&part.whitened).map(|(frame, r)| (*frame, r * r));
            found.extend(squares.map(|(frame, square)| ((part.recording, frame, part.is_drop), square)));
        }
        found
    };
    let (own, others) = (by_frame(end), by_frame(other));
    let mut blocks: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for (place, square) in &own {
        let (recording, frame, _) = *place;
        let rate_hz = model.recordings[recording].observation.rate_hz;
        let frames = ((block_s * rate_hz).round() as usize).max(MIN_BLOCK_FRAMES);
        if let Some(other) = others.get(place) {
            *blocks.entry((recording, frame / frames)).or_default() += other - square;
        }
    }
    let (count, sum) = (blocks.len() as f64, blocks.values().sum::<f64>());
    let scatter: f64 = blocks.values().map(|d| (d - sum / count) * (d - sum / count)).sum();
    let sd = (scatter * count / (count - 1.0)).sqrt();
    let sd = sd.min(2.0 * (widening * sum.max(0.0)).sqrt());
    let sum = sum + model.unknowns.prior_cost(&other.point) - model.unknowns.prior_cost(&end.point);
    if sd > 0.0 { sum / sd } else { 0.0 }
}
