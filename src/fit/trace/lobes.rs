//! Minima (lobes) of the cost as a function of the frequency at which the blade rings while its tip sticks.
//!
//! No segment starts while the tip sticks, so the blade may ring freely through most of one long segment. A
//! frequency with half a cycle more or less in this time then fits nearly as well. The same ambiguity exists
//! for any frequency that is estimated from two parts of a record with a gap between them. The lobes are
//! evenly spaced in frequency, so all of them can be tried: the segments of normal length limit the
//! frequency, and the long segments decide between the lobes within these limits.

use super::initial_states::{RescuePolicy, fit_states, update_states};
use super::iterate::SegmentState;
use super::levenberg_marquardt::{MAX_STATE_STEPS, cut_recordings, is_long};
use super::normal_equations::{carry_states, normal_equations, recording_models};
use super::uncertainty_run::SearchEnd;
use crate::model::modes::{TipConstraint, natural_modes};
use nalgebra::DVector;

/// Maximum number of lobes from which a search descends.
pub(crate) const MAX_LOBES: usize = 8;
/// Lobes are sought within this distance from the end of a search, in standard deviations of the frequency of
/// the blade with a held tip. The segments of normal length exclude lobes at larger distances.
const SPAN_SD: f64 = 5.0;
/// Smallest number of half cycles within [`SPAN_SD`] that leaves room for another lobe.
const LEAST_LOBES: f64 = 0.5;
/// Smallest and largest number of points at which the cost of the long segments is computed, on either side
/// of the end.
const POINTS: [usize; 2] = [10, 20];
/// Number of points per lobe, within the limits of [`POINTS`].
const POINTS_PER_LOBE: f64 = 8.0;

/// Direction in the space of the unknowns along which the lobes follow one another.
struct LobeDirection {
    /// Derivative of the frequency of the blade with a held tip with respect to each coordinate, in standard
    /// deviations of this frequency.
    gradient: DVector<f64>,
    /// Change of each coordinate. Of all changes that raise the frequency by one standard deviation, it
    /// raises the cost of the segments of normal length least.
    step: DVector<f64>,
    /// Number of half cycles that this step adds to the ringing in a long segment.
    half_cycles: f64,
}

/// Points from which the search descends with whole segments, the best first; empty if no segment is much
/// longer than its stage. `end` is the best end of the search without the long segments.
pub(super) fn find_lobes(end: &SearchEnd<'_>) -> Vec<Vec<f64>> {
    let long = long_segments(end);
    if long.is_empty() {
        return Vec::new();
    }
    let lobes = lobe_direction(end, &long).map(|direction| scan_lobes(end, &direction, &long));
    lobes.filter(|lobes| !lobes.is_empty()).unwrap_or_else(|| vec![end.at.point.clone()])
}

/// Segments that are much longer than their stage, with all their frames and with fitted starting states.
fn long_segments(end: &SearchEnd<'_>) -> Vec<SegmentState> {
    let Some(points) = recording_models(end.model, &end.at.point) else { return Vec::new() };
    let length_s = end.settings.segment_s[end.at.stage];
    let mut long = cut_recordings(&points, length_s, true);
    long.retain(|segment| is_long(points[segment.recording].observation, segment, length_s));
    for segment in &mut long {
        let same = |s: &&SegmentState| (s.recording, s.first) == (segment.recording, segment.first);
        if let Some(fitted) = end.at.segments.iter().find(same) {
            segment.start = fitted.start;
        }
    }
    fit_states(&points, &mut long, MAX_STATE_STEPS, RescuePolicy::Thorough);
    long
}

/// The direction in which the number of half cycles in a long segment is least certain; `None` if it is so
/// certain that there is no room for another lobe.
fn lobe_direction(end: &SearchEnd<'_>, long: &[SegmentState]) -> Option<LobeDirection> {
    /// Change of a coordinate in the finite difference of the frequency.
    const CHANGE: f64 = 1e-4;
    let point = &end.at.point;
    let points = recording_models(end.model, point)?;
    let held_hz = |z: &[f64], film: usize, on_shoulder: bool| -> Option<f64> {
        let points = recording_models(end.model, z)?;
        natural_modes(&points[film].scene.linkage, TipConstraint::Held, on_shoulder).first()?.frequency_hz
    };
    let along = |film: usize, held_s: f64, on_shoulder: bool| -> Option<LobeDirection> {
        let mut gradient = DVector::zeros(point.len());
        for i in end.model.unknowns.parameters() {
            let [below, above] = [-CHANGE, CHANGE].map(|change| {
                let mut moved = point.clone();
                moved[i] += change;
                held_hz(&moved, film, on_shoulder)
            });
            gradient[i] = (above? - below?) / (2.0 * CHANGE);
        }
        let moved = &end.covariance.curvature * end.widening * &gradient;
        let sd_hz = gradient.dot(&moved).sqrt();
        let half_cycles = 2.0 * held_s * sd_hz;
        let direction = LobeDirection { gradient: gradient / sd_hz, step: moved / sd_hz, half_cycles };
        (sd_hz > 0.0 && half_cycles.is_finite()).then_some(direction)
    };
    let each = long.iter().flat_map(|segment| {
        let model = &points[segment.recording];
        let held_s = model
            .held_times_s(segment.frames(), &segment.start_state())
            .unwrap_or_else(|| [(segment.last - segment.first) as f64 / model.observation.rate_hz; 2]);
        [false, true].map(|leans| along(segment.recording, held_s[usize::from(leans)], leans))
    });
    let widest = each.flatten().max_by(|a, b| a.half_cycles.total_cmp(&b.half_cycles))?;
    (SPAN_SD * widest.half_cycles >= LEAST_LOBES).then_some(widest)
}

/// A point of the scan: the long segments at a given frequency, with everything else fitted.
#[derive(Clone)]
struct ScanPoint {
    point: DVector<f64>,
    long: Vec<SegmentState>,
    cost: f64,
}

/// Points of the minima of the cost as a function of the frequency, the lowest first.
fn scan_lobes(end: &SearchEnd<'_>, direction: &LobeDirection, long: &[SegmentState]) -> Vec<Vec<f64>> {
    let wanted = POINTS_PER_LOBE * direction.half_cycles * SPAN_SD;
    let count = (wanted as usize).clamp(POINTS[0], POINTS[1]);
    let spacing_sd = SPAN_SD / count as f64;
    let point = DVector::from_column_slice(&end.at.point);
    let middle = ScanPoint { point, long: long.to_vec(), cost: f64::INFINITY };
    let Some(middle) = refit_scan_point(end, direction, &middle, 0.0) else { return Vec::new() };
    let outwards = |side: f64| -> Vec<ScanPoint> {
        let next = |before: &ScanPoint| refit_scan_point(end, direction, before, side * spacing_sd);
        std::iter::successors(next(&middle), next).take(count).collect()
    };
    let (mut points, above) = rayon::join(|| outwards(-1.0), || outwards(1.0));
    points.reverse();
    points.push(middle.clone());
    points.extend(above);
    let cost = |k: Option<usize>| k.and_then(|k| points.get(k)).map_or(f64::INFINITY, |point| point.cost);
    let is_minimum =
        |k: &usize| cost(Some(*k)) < cost(k.checked_sub(1)) && cost(Some(*k)) <= cost(k.checked_add(1));
    let mut minima: Vec<usize> = (0..points.len()).filter(is_minimum).collect();
    portable_math::sort_by_number(&mut minima, |a| points[*a].cost);
    minima.into_iter().take(MAX_LOBES).map(|k| points[k].point.iter().copied().collect()).collect()
}

/// Moves a point of the scan by `sd` standard deviations of the frequency, and fits everything else again at
/// the new frequency. `None` if a scene refuses the point, or if the range of an unknown stops it less than
/// half of the way.
fn refit_scan_point(
    end: &SearchEnd<'_>,
    direction: &LobeDirection,
    at: &ScanPoint,
    sd: f64,
) -> Option<ScanPoint> {
    /// Number of Gauss-Newton steps.
    const STEPS: usize = 2;
    let wanted = &direction.step * sd;
    let mut moved = move_scan_point(end, direction, at, Some(wanted))?;
    if direction.gradient.dot(&(&moved.point - &at.point)).abs() < 0.5 * sd.abs() {
        return None;
    }
    for _ in 0..STEPS {
        match move_scan_point(end, direction, &moved, None) {
            Some(next) if next.cost < moved.cost => moved = next,
            _ => break,
        }
    }
    Some(moved)
}

/// Moves a point of the scan by `step` or, without one, by the Gauss-Newton step that keeps the frequency.
/// The cost is chi2 of the long segments, plus the rise of the cost of the search, as its information matrix
/// predicts it.
fn move_scan_point(
    end: &SearchEnd<'_>,
    direction: &LobeDirection,
    at: &ScanPoint,
    step: Option<DVector<f64>>,
) -> Option<ScanPoint> {
    let (model, information) = (end.model, &end.covariance.information);
    let away = |point: &DVector<f64>| point - DVector::from_column_slice(&end.at.point);
    let found = normal_equations(model, at.point.as_slice(), &at.long, true)?;
    let step = match step {
        Some(step) => step,
        None => {
            let (mut matrix, mut slope) = (information.clone(), information * away(&at.point));
            for part in found.parts.iter().flatten() {
                matrix += &part.matrix;
                slope += &part.slope;
            }
            let normal = matrix.cholesky()?;
            let (free, held) = (normal.solve(&slope), normal.solve(&direction.gradient));
            let back = direction.gradient.dot(&free) / direction.gradient.dot(&held);
            held * back - free
        }
    };
    let point = DVector::from_vec(model.unknowns.clamp_to_ranges((&at.point + step).as_slice()));
    let mut long = carry_states(model, &at.long, &found, &(&point - &at.point));
    update_states(&recording_models(model, point.as_slice())?, &at.long, &mut long, MAX_STATE_STEPS);
    let rise = away(&point).dot(&(information * away(&point)));
    let cost = rise + long.iter().map(|segment| segment.chi2).sum::<f64>();
    Some(ScanPoint { point, long, cost })
}
