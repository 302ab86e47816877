//! The ridge of the strongest oscillation above the slow ones, and the means along this ridge, which describe
//! the oscillation as one component.

use super::periodogram::upper_median;
use super::time_frequency::{self, Ridge, RidgeEnd, RidgePoint, Spectrogram};
use portable_math as math;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// The largest component is slow if every component above four times its frequency has less than a quarter of
/// its amplitude. The drifting component is searched for above the slow one.
const SLOW_COMPONENT: (f64, f64) = (4.0, 0.25);
/// The lower end of the band is the frequency of the lowest strong component divided by this margin, because
/// the window hides lower frequencies near the ends of a record.
const BAND_MARGIN: f64 = 2.0;
/// If a ridge has points in at least this fraction of the segments, it counts as complete: no shorter
/// segments are tried. Only a complete ridge may become an oscillation of the decomposition.
pub(super) const FULLY_FOLLOWED: f64 = 0.9;
/// Fractions of the best segment length that are tried if the ridge has points in less than `FULLY_FOLLOWED`
/// of the segments. A shorter length is used only if it increases this share by more than `LEAST_GAIN`,
/// because noise hides a component in short segments.
const SHORTER_SEGMENTS: [f64; 3] = [0.8, 0.65, 0.5];
const LEAST_GAIN: f64 = 0.1;
/// Standard deviation, in cycles, of the start of a cycle as measured from the phase of the fundamental. The
/// shape of a cycle changes with its frequency, so this phase moves relative to the start of the cycle.
pub(super) const CYCLE_INSTANT_SD: f64 = 0.05;
/// Distance of two points, in segment lengths, at which their segments share so few frames that the noise of
/// the points is independent.
const INDEPENDENT_SEGMENTS: f64 = 0.5;
/// The ridge for the segment length that shows the component best. If too few segments have a point of this
/// ridge, shorter segments are tried, and the ridge with the largest share of segments is returned. The
/// component may be weak or change fast in a part of the record.
pub(super) fn select_best_ridge(
    record: &[Option<f64>],
    frame_rate_hz: f64,
    band: (f64, f64),
) -> Option<(f64, Ridge)> {
    let cut = |segment_s: Option<f64>| {
        let settings = time_frequency::SpectrogramSettings { segment_s, band_hz: Some(band), overlap: None };
        let spectrogram = Spectrogram::new(record, frame_rate_hz, &settings).ok()?;
        let ridge = spectrogram.find_ridge(record, band).ok()?;
        Some((ridge.points.len() as f64 / spectrogram.time_s.len().max(1) as f64, ridge))
    };
    let best = cut(None).filter(|best| !best.1.points.is_empty())?;
    if best.0 >= FULLY_FOLLOWED {
        return Some(best);
    }
    let shorter = SHORTER_SEGMENTS.iter().filter_map(|times| cut(Some(times * best.1.segment_s)));
    let better = shorter.filter(|(covered, _)| *covered > best.0 + LEAST_GAIN);
    Some(better.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(best))
}

/// Band, Hz, in which the strongest component above the slow ones may lie, limited to `within_hz`.
/// `components` are frequencies, Hz, with amplitudes in any unit. The shortest segment contains a few cycles
/// at the lower end of the band, so the lower end must not lie far below the component. `None` if the band is
/// empty.
pub(super) fn choose_ridge_band(
    frames: usize,
    frame_rate_hz: f64,
    components: &[(f64, f64)],
    within_hz: Option<(f64, f64)>,
) -> Option<(f64, f64)> {
    let slow_hz = dominant_slow_hz(components);
    let (low, top) = time_frequency::default_band_hz(frames, frame_rate_hz, slow_hz);
    let above = || components.iter().filter(|(hz, _)| *hz >= low);
    let largest = above().map(|(_, amplitude)| *amplitude).fold(0.0, f64::max);
    let strong = above().filter(|(_, amplitude)| *amplitude >= SLOW_COMPONENT.1 * largest);
    let lowest_hz = strong.map(|(hz, _)| *hz).fold(f64::INFINITY, f64::min);
    let lowest_hz = if lowest_hz.is_finite() { low.max(lowest_hz / BAND_MARGIN) } else { low };
    let (low, high) = within_hz.map_or((lowest_hz, top), |(low, high)| (low.max(lowest_hz), high.min(top)));
    (low < high).then_some((low, high))
}

/// Frequency, Hz, of the largest component, if that component is slow.
fn dominant_slow_hz(components: &[(f64, f64)]) -> Option<f64> {
    let largest = components.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut above = components.iter().filter(|(hz, _)| *hz > SLOW_COMPONENT.0 * largest.0).peekable();
    (above.peek().is_some() && above.all(|(_, m)| *m < SLOW_COMPONENT.1 * largest.1)).then_some(largest.0)
}

/// Means along a ridge that describe it as one component.
pub(super) struct RidgeMean {
    /// Mean frequency, Hz: the number of cycles along the ridge, divided by the duration of the ridge.
    pub frequency_hz: f64,
    pub frequency_sd_hz: f64,
    /// Root of the mean squared amplitude, m.
    pub amplitude_m: f64,
    pub amplitude_sd_m: f64,
    /// Mean signal-to-noise ratio, dB, of the points, weighted by their squared amplitudes.
    pub snr_db: f64,
}

impl RidgeMean {
    /// The means of a ridge that has points. Points half a segment apart count as independent.
    pub(super) fn from_ridge(ridge: &Ridge) -> Self {
        let points = &ridge.points;
        let power: f64 = points.iter().map(|p| math::powi(p.amplitude_m, 2)).sum();
        let mean = |of: &dyn Fn(usize) -> f64| {
            (0..points.len()).map(|i| math::powi(points[i].amplitude_m, 2) * of(i)).sum::<f64>() / power
        };
        let shared = (0.5 * ridge.segment_s / ridge.hop_s).max(1.0);
        let noise_m =
            |i: usize| points[i].amplitude_m * math::powf(10.0, -points[i].snr_db / 20.0) * FRAC_1_SQRT_2;
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

/// Number of cycles along a ridge, its variance, and the duration of the ridge.
#[derive(Default)]
struct CycleCount {
    cycles: f64,
    variance: f64,
    duration_s: f64,
}

impl CycleCount {
    /// Counts whole and fractional cycles along each unbroken part of the ridge from the phases of its
    /// points. If the ridge reaches an end of the record, the cycles up to that end follow from the
    /// frequencies.
    fn along_ridge(ridge: &Ridge) -> Self {
        let mut all = Self::default();
        ridge.unbroken_parts().for_each(|part| all.add_part(part));
        for (end, point) in [(&ridge.start, ridge.points.first()), (&ridge.end, ridge.points.last())] {
            if let (Some(end), Some(point)) = (end, point) {
                all.add_end(end, point);
            }
        }
        let point = ridge.points.first().filter(|_| all.duration_s == 0.0);
        point.map_or(all, |point| Self {
            cycles: point.frequency_hz * ridge.segment_s,
            variance: math::powi(point.frequency_sd_hz * ridge.segment_s, 2),
            duration_s: ridge.segment_s,
        })
    }

    fn add_part(&mut self, part: &[RidgePoint]) {
        let (Some(first), Some(last)) = (part.first(), part.last()) else { return };
        self.cycles += part.windows(2).map(|pair| count_cycles(&pair[0], &pair[1])).sum::<f64>();
        self.variance += phase_variance(first) + phase_variance(last);
        self.duration_s += last.time_s - first.time_s;
    }

    fn add_end(&mut self, end: &RidgeEnd, point: &RidgePoint) {
        let apart_s = (end.time_s - point.time_s).abs();
        // cycles from a parabola through both frequencies with the rate of the point; a mismatch at the end
        // counts as uncertainty
        let led_hz = point.frequency_hz + point.rate_hz_per_s * (end.time_s - point.time_s);
        let off_hz = (end.frequency_hz - led_hz) / 3.0;
        self.cycles += apart_s * ((point.frequency_hz + led_hz) / 2.0 + off_hz);
        let sd_hz = math::hypot(end.frequency_sd_hz / 3.0, off_hz);
        self.variance += math::powi(apart_s * sd_hz, 2);
        self.duration_s += apart_s;
    }
}

/// Variance of a point's phase, cycles squared, from the noise in a bin or the residual along the course,
/// whichever is larger.
fn phase_variance(point: &RidgePoint) -> f64 {
    let noise = math::powf(10.0, -point.snr_db / 20.0).max(point.residual_ratio);
    math::powi(noise * FRAC_1_SQRT_2 / TAU, 2) + CYCLE_INSTANT_SD * CYCLE_INSTANT_SD
}

/// Cycles from one point of a ridge to the next one of the same part.
pub(super) fn count_cycles(a: &RidgePoint, b: &RidgePoint) -> f64 {
    let apart_s = b.time_s - a.time_s;
    // cycles expected from a cubic through both frequencies with both rates
    let expected = apart_s * (a.frequency_hz + b.frequency_hz) / 2.0
        + apart_s * apart_s * (a.rate_hz_per_s - b.rate_hz_per_s) / 12.0;
    let part_of_one = (b.phase_rad - a.phase_rad) / TAU;
    part_of_one + (expected - part_of_one).round()
}

/// Median distance, in resolutions of the segments, of a frequency from the value extrapolated from the point
/// half a segment before it; 0 if no part of the ridge is that long.
pub(super) fn median_stray(ridge: &Ridge) -> f64 {
    let apart = ((INDEPENDENT_SEGMENTS * ridge.segment_s / ridge.hop_s).round() as usize).max(1);
    let stray = |pair: &[RidgePoint]| {
        let [a, b] = [&pair[0], &pair[pair.len() - 1]];
        let led_hz = (b.time_s - a.time_s) * (a.rate_hz_per_s + b.rate_hz_per_s) / 2.0;
        (b.frequency_hz - a.frequency_hz - led_hz).abs() * ridge.segment_s
    };
    let pairs = ridge.unbroken_parts().flat_map(|part| part.windows(apart + 1));
    upper_median(pairs.map(stray).collect()).unwrap_or(0.0)
}
