//! The ridge: the course of a component through the columns of a spectrogram.

use crate::periodogram::upper_median;
use portable_math as math;
use serde::Serialize;

/// A point of a ridge: the middle of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgePoint {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz. It combines two parts: the effect of the noise next to the
    /// component or of the residual of the fit, whichever is larger, and a five-hundredth of the resolution
    /// for leakage of other components.
    pub frequency_sd_hz: f64,
    /// Change of the frequency, Hz/s.
    pub rate_hz_per_s: f64,
    /// Amplitude at that time, m.
    pub amplitude_m: f64,
    /// Phase, rad, at that time, if the component is written as a cosine.
    pub phase_rad: f64,
    /// Ratio, dB, of the amplitude to the amplitude of noise in a bin of the column (`20 log10`).
    pub snr_db: f64,
    /// Ratio of the residual at the component's frequency to the component's amplitude, both in a bin of the
    /// column.
    pub residual_ratio: f64,
}

/// A frequency extrapolated to an end of the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgeEnd {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz.
    pub frequency_sd_hz: f64,
}

/// Course of a component over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Ridge {
    /// The points, in order of time. A point needs a ratio of amplitude to noise that noise alone reaches in
    /// only one of a hundred records, and an amplitude that does not fall to zero within the segment. At
    /// least three consecutive segments must have points; elsewhere the ridge is interrupted.
    pub points: Vec<RidgePoint>,
    /// The frequency at the first frame, if the ridge reaches the first segment and the fit extends that far.
    pub start: Option<RidgeEnd>,
    /// The frequency at the last frame, if the ridge reaches the last segment and the fit extends that far.
    pub end: Option<RidgeEnd>,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Distance between neighbouring points of an unbroken part, s.
    pub hop_s: f64,
}

/// Two neighbouring frequencies agree if their difference, in resolutions, is at most this value.
const AGREEMENT_RESOLUTIONS: f64 = 0.25;
/// Two neighbouring frequencies also agree if their difference, in standard deviations of the difference, is
/// at most this value.
const AGREEMENT_DEVIATIONS: f64 = 4.0;
/// Distance of two points, in segment lengths, at which their noise is nearly independent.
const INDEPENDENT_SEGMENTS: f64 = 0.5;
/// Number of standard deviations that a normal number exceeds once in a thousand draws.
const ONCE_IN_A_THOUSAND: f64 = 3.09;

/// Lowest and highest frequency of a course.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrequencyRange {
    /// Lowest frequency, Hz.
    pub low_hz: f64,
    /// Standard deviation of the lowest frequency, Hz.
    pub low_sd_hz: f64,
    /// Highest frequency, Hz.
    pub high_hz: f64,
    /// Standard deviation of the highest frequency, Hz.
    pub high_sd_hz: f64,
}

impl FrequencyRange {
    /// The range with every frequency times `factor`.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self {
            low_hz: factor * self.low_hz,
            low_sd_hz: factor * self.low_sd_hz,
            high_hz: factor * self.high_hz,
            high_sd_hz: factor * self.high_sd_hz,
        }
    }
}

impl Ridge {
    /// The parts of the ridge between its interruptions.
    pub fn unbroken_parts(&self) -> impl Iterator<Item = &[RidgePoint]> {
        self.points.chunk_by(|a, b| b.time_s - a.time_s < 1.5 * self.hop_s)
    }

    /// Lowest and highest frequency. The frequency at an end of the record counts if its standard deviation
    /// is below a quarter of a resolution. A point counts only if the frequency extrapolated from a neighbour
    /// agrees with it within a quarter of a resolution or four standard deviations, so that a single bad
    /// point sets neither limit. `None` if no point is confirmed.
    #[must_use]
    pub fn range_hz(&self) -> Option<FrequencyRange> {
        frequency_range(self)
    }

    /// Whether the frequency changes: points half a segment apart scatter about their mean by more than
    /// errors of their standard deviations would cause in one of a thousand records.
    #[must_use]
    pub fn is_drifting(&self) -> bool {
        has_significant_drift(self)
    }
}

fn frequency_range(ridge: &Ridge) -> Option<FrequencyRange> {
    // an end with a large standard deviation does not count for the range
    let known = |end: &&RidgeEnd| end.frequency_sd_hz < AGREEMENT_RESOLUTIONS / ridge.segment_s;
    let start = ridge.start.as_ref().filter(known).zip(ridge.points.first());
    let end = ridge.end.as_ref().filter(known).zip(ridge.points.last());
    let total_sd_hz = |sd_hz: f64, beyond_hz: f64, point: &RidgePoint| {
        [sd_hz, beyond_hz, change_within_cycle_hz(point)].into_iter().fold(0.0, math::hypot)
    };
    let ends = start.iter().chain(&end).map(|(end, point)| {
        (end.frequency_hz, total_sd_hz(end.frequency_sd_hz, end_mismatch_hz(end, point), point))
    });
    let confirmed = ridge.unbroken_parts().flat_map(|part| {
        let outer = |i: usize| {
            let carried = |end: Option<(&RidgeEnd, &RidgePoint)>| end.is_some_and(|(_, p)| p == &part[i]);
            (i == 0 || i + 1 == part.len()) && !carried(start) && !carried(end)
        };
        let beyond_hz = move |i: usize| if outer(i) { change_beyond_hz(ridge, &part[i]) } else { 0.0 };
        let confirmed = (0..part.len()).filter(|i| is_confirmed(ridge, part, *i));
        confirmed.map(move |i| (&part[i], beyond_hz(i))).collect::<Vec<_>>()
    });
    let confirmed = confirmed.map(|(p, beyond)| (p.frequency_hz, total_sd_hz(p.frequency_sd_hz, beyond, p)));
    let bent = curvature_bias_hz(ridge);
    let all: Vec<(f64, f64)> =
        confirmed.chain(ends).map(|(hz, sd_hz)| (hz, math::hypot(sd_hz, bent))).collect();
    let (low_hz, low_sd_hz) = all.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (high_hz, high_sd_hz) = all.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    // two standard deviations of a less certain frequency may reach beyond the limit
    let beyond =
        |of: &dyn Fn(f64, f64) -> f64| all.iter().map(|(hz, sd_hz)| of(*hz, *sd_hz)).fold(0.0, f64::max);
    Some(FrequencyRange {
        low_hz,
        low_sd_hz: low_sd_hz.max(beyond(&|hz, sd_hz| (low_hz - hz) / 2.0 + sd_hz)),
        high_hz,
        high_sd_hz: high_sd_hz.max(beyond(&|hz, sd_hz| (hz - high_hz) / 2.0 + sd_hz)),
    })
}

/// Change, Hz, of the frequency in the outer half of a segment next to an interruption. The component may
/// continue there without a point.
fn change_beyond_hz(ridge: &Ridge, point: &RidgePoint) -> f64 {
    (point.rate_hz_per_s * ridge.segment_s / 2.0).abs()
}

/// Uncertainty, Hz, of the frequency at an end of the record due to a change of the rate there: a third of
/// the difference from the frequency extrapolated to that end from the nearest point.
fn end_mismatch_hz(end: &RidgeEnd, point: &RidgePoint) -> f64 {
    let led_hz = point.frequency_hz + point.rate_hz_per_s * (end.time_s - point.time_s);
    (end.frequency_hz - led_hz).abs() / 3.0
}

/// Half of the change, Hz, of the frequency within a cycle: a frequency describes a whole cycle, not an
/// instant within it.
fn change_within_cycle_hz(point: &RidgePoint) -> f64 {
    (point.rate_hz_per_s / point.frequency_hz / 2.0).abs()
}

/// Bias, Hz, of a frequency at the turning points of a curved course: a fit of a constant rate to a segment
/// of length `T` cuts a corner of curvature `c` by up to `c T^2 / 24`. The curvature is the median change of
/// the rate over half a segment, divided by the duration of half a segment.
fn curvature_bias_hz(ridge: &Ridge) -> f64 {
    let apart = (INDEPENDENT_SEGMENTS * ridge.segment_s / ridge.hop_s).round().max(1.0) as usize;
    let bend = |w: &[RidgePoint]| {
        (w[apart].rate_hz_per_s - w[0].rate_hz_per_s).abs() / (w[apart].time_s - w[0].time_s)
    };
    let bends = ridge.unbroken_parts().flat_map(|part| part.windows(apart + 1)).map(bend);
    let curvature = upper_median(bends.collect()).unwrap_or(0.0);
    curvature * ridge.segment_s * ridge.segment_s / 24.0
}

/// Whether a point agrees with the frequency extrapolated from a neighbour, or is the only point of its part.
fn is_confirmed(ridge: &Ridge, part: &[RidgePoint], index: usize) -> bool {
    let point = &part[index];
    let agrees = |other: &RidgePoint| {
        let carried_hz = other.frequency_hz + other.rate_hz_per_s * (point.time_s - other.time_s);
        let allowed_hz = (AGREEMENT_RESOLUTIONS / ridge.segment_s)
            .max(AGREEMENT_DEVIATIONS * math::hypot(point.frequency_sd_hz, other.frequency_sd_hz));
        (carried_hz - point.frequency_hz).abs() <= allowed_hz
    };
    let neighbours = [index.checked_sub(1), Some(index + 1)];
    part.len() == 1 || neighbours.into_iter().flatten().filter_map(|i| part.get(i)).any(agrees)
}

fn has_significant_drift(ridge: &Ridge) -> bool {
    let mut apart: Vec<&RidgePoint> = Vec::new();
    let least_s = (1.0 - 1e-9) * INDEPENDENT_SEGMENTS * ridge.segment_s;
    for point in &ridge.points {
        if apart.last().is_none_or(|last| point.time_s - last.time_s >= least_s) {
            apart.push(point);
        }
    }
    let weight = |p: &RidgePoint| math::powi(p.frequency_sd_hz, -2);
    let weights: f64 = apart.iter().map(|p| weight(p)).sum();
    let mean = apart.iter().map(|p| weight(p) * p.frequency_hz).sum::<f64>() / weights;
    let scatter: f64 = apart.iter().map(|p| weight(p) * math::powi(p.frequency_hz - mean, 2)).sum();
    apart.len() > 1 && scatter > chi_square_limit((apart.len() - 1) as f64)
}

/// The limit that the sum of `freedom` squares exceeds once in a thousand draws (Wilson and Hilferty's
/// approximation).
fn chi_square_limit(freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    freedom * math::powi(1.0 - spread + ONCE_IN_A_THOUSAND * spread.sqrt(), 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ridge(course: &[f64]) -> Ridge {
        let point = |(i, f): (usize, &f64)| RidgePoint {
            time_s: 0.01 * i as f64,
            frequency_hz: *f,
            frequency_sd_hz: 1.0,
            rate_hz_per_s: 0.0,
            amplitude_m: 1e-6,
            phase_rad: 0.0,
            snr_db: 30.0,
            residual_ratio: 0.0,
        };
        Ridge {
            points: course.iter().enumerate().map(point).collect(),
            start: None,
            end: None,
            segment_s: 0.02,
            hop_s: 0.01,
        }
    }

    #[test]
    fn one_bad_point_sets_no_end_of_the_range() {
        for bad in 0..5 {
            let mut course = [500.0, 501.0, 502.0, 503.0, 504.0];
            course[bad] = 900.0;
            let range = ridge(&course).range_hz().unwrap();
            assert!(range.low_hz >= 500.0 && range.high_hz <= 504.0, "{bad}: {range:?}");
        }
        assert_eq!(ridge(&[]).range_hz(), None);
    }

    #[test]
    fn an_end_that_is_hardly_known_sets_no_end_of_the_range() {
        let mut ridge = ridge(&[500.0, 501.0, 502.0]);
        ridge.start = Some(RidgeEnd { time_s: 0.0, frequency_hz: 150.0, frequency_sd_hz: 40.0 });
        assert_eq!(ridge.range_hz().map(|range| range.low_hz), Some(500.0));
        ridge.start = Some(RidgeEnd { time_s: 0.0, frequency_hz: 498.0, frequency_sd_hz: 2.0 });
        assert_eq!(ridge.range_hz().map(|range| range.low_hz), Some(498.0));
    }

    #[test]
    fn the_limit_is_that_of_tables() {
        for (freedom, table) in [(1.0, 10.83), (4.0, 18.47), (10.0, 29.59), (30.0, 59.70)] {
            assert!(
                (chi_square_limit(freedom) / table - 1.0).abs() < 0.04,
                "{freedom}: {}",
                chi_square_limit(freedom)
            );
        }
    }

    #[test]
    fn a_course_drifts_when_its_deviations_do_not_explain_it() {
        assert!(!ridge(&[500.0, 501.0, 499.0, 500.5, 501.5]).is_drifting());
        assert!(ridge(&[500.0, 502.0, 504.0, 506.0, 508.0]).is_drifting());
        assert!(!ridge(&[500.0]).is_drifting());
    }
}
