//! A cycle whose frequency changes over the record: found in addition to what steady and decaying
//! oscillations explain, and read as one component.
//!
//! Sinusoids can only take such a cycle to pieces. Where they leave as much as they explain, or need three
//! and more of them between the least and the greatest frequency of a ridge that drifts, the ridge is the
//! component, and the pieces are not.

use super::model_selection::{Decomposition, DriftRegion, LOBE, ModelSelector};
use super::time_frequency::{
    FrequencyRange, Ridge, RidgeEnd, RidgePoint, Spectrogram, SpectrogramSettings, default_band_hz,
};
use crate::math;
use std::f64::consts::TAU;

/// A component is slow, and the drifting one sought above it, if nothing above four times its frequency has a
/// quarter of its amplitude.
const SLOW_COMPONENT: (f64, f64) = (4.0, 0.25);
/// What the lowest strong part of a component may be over the least frequency that it passes: where a record
/// starts or ends, its window hides it.
const BAND_MARGIN: f64 = 2.0;
/// Share of the segments in which the component is followed that is as good as all.
pub(super) const FULLY_FOLLOWED: f64 = 0.9;
/// Shorter segments tried where it is not, and the share more that they must follow: noise drowns a component
/// in short ones.
const SHORTER_SEGMENTS: [f64; 3] = [0.8, 0.65, 0.5];
const LEAST_GAIN: f64 = 0.1;
/// Deviation of the instant of a cycle, cycles: its form changes with its frequency, and the fundamental
/// moves against the instant at which the tip sticks.
const CYCLE_INSTANT_SD: f64 = 0.05;
/// Distance of points that share too few frames to follow each other's noise, segments.
const INDEPENDENT_SEGMENTS: f64 = 0.5;
/// Share of the segments in which a drift must be followed to be one.
const LEAST_FOLLOWED: f64 = 0.08;
/// Resolutions that a drift covers; less is a line that is a little broad.
const LEAST_RANGE: f64 = 2.0;
/// Sinusoids within the range that are pieces of one cycle.
const FRAGMENTS: usize = 3;
/// Share of the largest of them that is left where sinusoids do not explain it.
const LARGE_RESIDUAL: f64 = 0.25;

/// The course of the strongest component above the slow ones.
pub(super) struct DriftCourse {
    pub ridge: Ridge,
    /// Share of the segments in which it was followed.
    pub followed_share: f64,
    /// Its range, where it is a component that drifts.
    pub range: Option<FrequencyRange>,
}

impl DriftCourse {
    /// How far its frequencies are from where the rates of points half a segment apart lead, resolutions: the
    /// median.
    pub(super) fn median_stray(&self) -> f64 {
        let ridge = &self.ridge;
        let apart = ((INDEPENDENT_SEGMENTS * ridge.segment_s / ridge.hop_s).round() as usize).max(1);
        let stray = |pair: &[RidgePoint]| {
            let [a, b] = [&pair[0], &pair[pair.len() - 1]];
            let led_hz = (b.time_s - a.time_s) * (a.rate_hz_per_s + b.rate_hz_per_s) / 2.0;
            (b.frequency_hz - a.frequency_hz - led_hz).abs() * ridge.segment_s
        };
        let mut strays: Vec<f64> =
            ridge.unbroken_parts().flat_map(|part| part.windows(apart + 1)).map(stray).collect();
        let middle = strays.len() / 2;
        if strays.is_empty() { 0.0 } else { *strays.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// Where it shows itself in a spectrum, if it is a component that drifts.
    pub(super) fn drift_region(&self) -> Option<DriftRegion> {
        let range = self.range?;
        Some(DriftRegion {
            low_hz: range.low_hz,
            high_hz: range.high_hz,
            lobe_hz: LOBE / self.ridge.segment_s,
        })
    }
}

/// Follows the strongest component of a record without its trend and without what is slow.
pub(super) fn find_drift_course(
    search: &ModelSelector,
    explained: &Decomposition,
    band_hz: Option<(f64, f64)>,
) -> Option<DriftCourse> {
    let (lowest, top) = natural_band_hz(search, explained);
    let band = band_hz.map_or((lowest, top), |(low, high)| (low.max(lowest), high.min(top)));
    if band.0 >= band.1 {
        return None;
    }
    let record = remove_slow_parts(search, explained, band.0);
    let (followed, ridge) = select_best_ridge(&record, search.frame_rate_hz, band)?;
    let range = ridge.range_hz().filter(|range| {
        followed > LEAST_FOLLOWED && ridge.is_drifting() && is_fragmented(search, explained, range)
    });
    Some(DriftCourse { ridge, followed_share: followed, range })
}

/// The ridge of segments of the length that shows the component best; where that misses much of the record,
/// as the component is weak or fast in a part of it, of the shorter length that misses least.
fn select_best_ridge(record: &[Option<f64>], frame_rate_hz: f64, band: (f64, f64)) -> Option<(f64, Ridge)> {
    let cut = |segment_s: Option<f64>| {
        let spectrogram =
            Spectrogram::new(record, frame_rate_hz, &SpectrogramSettings { segment_s, band_hz: Some(band) })
                .ok()?;
        let ridge = spectrogram.find_ridge(record, band).ok()?;
        let covered = ridge.points.len() as f64 / spectrogram.time_s.len().max(1) as f64;
        Some((covered, ridge))
    };
    let best = cut(None)?;
    if best.1.points.is_empty() || best.0 >= FULLY_FOLLOWED {
        return Some(best).filter(|best| !best.1.points.is_empty());
    }
    let shorter: Vec<(f64, Ridge)> =
        SHORTER_SEGMENTS.iter().filter_map(|times| cut(Some(times * best.1.segment_s))).collect();
    let better = shorter
        .into_iter()
        .filter(|(covered, _)| *covered > best.0 + LEAST_GAIN)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    Some(better.unwrap_or(best))
}

/// Where the strongest component above the slow ones may run, Hz. The shortest segment is of some cycles of
/// its lower end, so that this must not lie far below the component.
fn natural_band_hz(search: &ModelSelector, explained: &Decomposition) -> (f64, f64) {
    let standing = prominent_peaks(search, explained);
    let slow_hz = dominant_slow_hz(&standing);
    let (low, top) = default_band_hz(search.samples.len(), search.frame_rate_hz, slow_hz);
    let above: Vec<&ProminentPeak> = standing.iter().filter(|s| s.hz >= low).collect();
    let largest_m = above.iter().map(|s| s.amplitude_m).fold(0.0, f64::max);
    let lowest_hz = above
        .iter()
        .filter(|s| s.amplitude_m >= SLOW_COMPONENT.1 * largest_m)
        .map(|s| s.hz)
        .fold(f64::INFINITY, f64::min);
    (if lowest_hz.is_finite() { low.max(lowest_hz / BAND_MARGIN) } else { low }, top)
}

/// What stands out of the noise: a sinusoid, or a peak that is left.
struct ProminentPeak {
    hz: f64,
    amplitude_m: f64,
}

fn prominent_peaks(search: &ModelSelector, explained: &Decomposition) -> Vec<ProminentPeak> {
    let (terms, problem) = (&explained.model.solution.terms, &explained.model.problem);
    let sinusoid = |k: usize| {
        let [cosine, sine] = problem.quadrature_amplitudes(&explained.model.solution, k);
        ProminentPeak { hz: terms[k].cycles * search.resolution_hz(), amplitude_m: math::hypot(cosine, sine) }
    };
    let sinusoids = (0..terms.len()).filter(|k| terms[*k].cycles > 0.0).map(sinusoid);
    let left = explained
        .peaks
        .accepted
        .iter()
        .map(|peak| ProminentPeak { hz: peak.frequency_hz, amplitude_m: peak.amplitude_m });
    sinusoids.chain(left).collect()
}

/// Frequency of the largest, if it is slow, Hz.
fn dominant_slow_hz(standing: &[ProminentPeak]) -> Option<f64> {
    let largest = standing.iter().max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m))?;
    let mut above = standing.iter().filter(|s| s.hz > SLOW_COMPONENT.0 * largest.hz).peekable();
    (above.peek().is_some() && above.all(|s| s.amplitude_m < SLOW_COMPONENT.1 * largest.amplitude_m))
        .then_some(largest.hz)
}

/// The record without trend, relaxations and the sinusoids below a frequency, m.
fn remove_slow_parts(search: &ModelSelector, explained: &Decomposition, low_hz: f64) -> Vec<Option<f64>> {
    let (parts, low) = (&explained.model, low_hz / search.resolution_hz());
    let problem = &parts.problem;
    let mut record = explained.residual_m.clone();
    for k in (0..parts.solution.terms.len()).filter(|k| parts.solution.terms[*k].cycles >= low) {
        let of_term = problem.term_values(&parts.solution, k);
        record.iter_mut().zip(of_term).for_each(|(x, value)| *x = x.map(|x| x + value));
    }
    record
}

/// Whether sinusoids only take the cycle to pieces.
fn is_fragmented(search: &ModelSelector, explained: &Decomposition, range: &FrequencyRange) -> bool {
    let resolution_hz = search.resolution_hz();
    if range.high_hz - range.low_hz < LEAST_RANGE * resolution_hz {
        return false;
    }
    let inside = |hz: f64| hz > range.low_hz - resolution_hz && hz < range.high_hz + resolution_hz;
    let terms = &explained.model.solution.terms;
    let pieces: Vec<usize> = (0..terms.len()).filter(|k| inside(terms[*k].cycles * resolution_hz)).collect();
    let largest_m =
        pieces.iter().map(|k| search.windowed_amplitude_m(&explained.model, *k)).fold(0.0, f64::max);
    let left_m = explained
        .peaks
        .accepted
        .iter()
        .filter(|p| inside(p.frequency_hz))
        .map(|p| p.amplitude_m)
        .fold(0.0, f64::max);
    pieces.len() >= FRAGMENTS || left_m > LARGE_RESIDUAL * largest_m
}

/// One component from a course.
pub(super) struct RidgeMean {
    /// Cycles counted along the course, over its duration, Hz.
    pub frequency_hz: f64,
    pub frequency_sd_hz: f64,
    /// Root of the mean power, m.
    pub amplitude_m: f64,
    pub amplitude_sd_m: f64,
    /// Mean over the points, weighted with their power.
    pub snr_db: f64,
}

impl RidgeMean {
    /// Of a ridge with points. Points half a segment apart count as independent.
    pub(super) fn from_ridge(ridge: &Ridge) -> Self {
        let points = &ridge.points;
        let power: f64 = points.iter().map(|p| math::powi(p.amplitude_m, 2)).sum();
        let mean = |of: &dyn Fn(usize) -> f64| {
            (0..points.len()).map(|i| math::powi(points[i].amplitude_m, 2) * of(i)).sum::<f64>() / power
        };
        let shared = (0.5 * ridge.segment_s / ridge.hop_s).max(1.0);
        let noise_m = |i: usize| {
            points[i].amplitude_m
                * math::powf(10.0, -points[i].snr_db / 20.0)
                * std::f64::consts::FRAC_1_SQRT_2
        };
        let counted = CycleCount::along_ridge(ridge);
        Self {
            frequency_hz: counted.cycles / counted.duration_s,
            frequency_sd_hz: counted.variance.sqrt() / counted.duration_s,
            amplitude_m: (power / points.len() as f64).sqrt(),
            amplitude_sd_m: mean(&|i| noise_m(i)) * (shared / points.len() as f64).sqrt(),
            snr_db: mean(&|i| points[i].snr_db),
        }
    }
}

/// Cycles along a course.
#[derive(Default)]
struct CycleCount {
    cycles: f64,
    variance: f64,
    duration_s: f64,
}

impl CycleCount {
    /// Whole cycles and the parts of one at both ends of each part of the ridge, from the phases of its
    /// points; to the ends of the record, where it reaches them, from the frequencies.
    fn along_ridge(ridge: &Ridge) -> Self {
        let mut all = Self::default();
        ridge.unbroken_parts().for_each(|part| all.add_part(part));
        for (end, point) in [(&ridge.start, ridge.points.first()), (&ridge.end, ridge.points.last())] {
            if let (Some(end), Some(point)) = (end, point) {
                all.add_end(end, point);
            }
        }
        if let (true, Some(point)) = (all.duration_s == 0.0, ridge.points.first()) {
            // a single point
            all = Self {
                cycles: point.frequency_hz * ridge.segment_s,
                variance: math::powi(point.frequency_sd_hz * ridge.segment_s, 2),
                duration_s: ridge.segment_s,
            };
        }
        all
    }

    fn add_part(&mut self, part: &[RidgePoint]) {
        let (Some(first), Some(last)) = (part.first(), part.last()) else { return };
        for pair in part.windows(2) {
            let [a, b] = [&pair[0], &pair[1]];
            let apart_s = b.time_s - a.time_s;
            // a cubic through both frequencies and their rates
            let expected = apart_s * (a.frequency_hz + b.frequency_hz) / 2.0
                + apart_s * apart_s * (a.rate_hz_per_s - b.rate_hz_per_s) / 12.0;
            let part_of_one = (b.phase_rad - a.phase_rad) / TAU;
            self.cycles += part_of_one + (expected - part_of_one).round();
        }
        self.variance += phase_variance(first) + phase_variance(last);
        self.duration_s += last.time_s - first.time_s;
    }

    fn add_end(&mut self, end: &RidgeEnd, point: &RidgePoint) {
        let apart_s = (end.time_s - point.time_s).abs();
        // a parabola through both frequencies with the rate of the point; where it leads to elsewhere than to
        // the end, one of them is wrong
        let led_hz = point.frequency_hz + point.rate_hz_per_s * (end.time_s - point.time_s);
        let off_hz = (end.frequency_hz - led_hz) / 3.0;
        self.cycles += apart_s * ((point.frequency_hz + led_hz) / 2.0 + off_hz);
        let sd_hz = math::hypot(end.frequency_sd_hz / 3.0, off_hz);
        self.variance += math::powi(apart_s * sd_hz, 2);
        self.duration_s += apart_s;
    }
}

/// Variance of a point's phase, cycles squared: from the noise in a bin, or from what is left along the
/// course if that is more.
fn phase_variance(point: &RidgePoint) -> f64 {
    let noise = math::powf(10.0, -point.snr_db / 20.0).max(point.residual_ratio);
    math::powi(noise * std::f64::consts::FRAC_1_SQRT_2 / TAU, 2) + CYCLE_INSTANT_SD * CYCLE_INSTANT_SD
}
