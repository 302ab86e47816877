//! Courses: the parts of a ridge in which the frequencies of neighbouring segments agree, so that the part
//! follows one component.
//!
//! A ridge has points wherever the ratio of amplitude to noise exceeds what noise alone reaches in one of a
//! hundred records. Two kinds of points do not belong to a course. First, a simulated record has no noise, so
//! residues count as points even while nothing moves: they exceed rounding errors, although they lie far
//! below every colour of the map. Second, if the frequency of an oscillation swings several times within a
//! segment, its sidebands are as high as the carrier, and the strongest line changes from segment to segment.

use super::{Ridge, RidgePoint, Spectrogram};
use portable_math as math;

/// A course includes amplitudes down to this number of dB below the largest amplitude of the spectrogram. The
/// colours of a spectrogram cover the same range.
pub const DYNAMIC_RANGE_DB: f64 = 60.0;
/// Largest allowed difference, in resolutions (1 / segment duration), between the frequencies of two segments
/// that share three quarters of their frames. The change that follows from the fitted rates is subtracted
/// first. Neighbouring points that determine a frequency range must agree within the same limit. Noise in the
/// weakest component of a ridge causes less than a tenth of this difference, and a single component has no
/// other reason to jump.
const MAX_FREQUENCY_STEP: f64 = 0.25;
/// Distance between segments that share three quarters of their frames, in segment lengths.
const USUAL_HOP: f64 = 0.25;
/// Minimum number of segments in a part of a ridge if neighbouring segments share few frames.
const MIN_PART_SEGMENTS: usize = 3;

/// A frequency and the speed at which it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedPoint {
    /// Mean speed over the segment, m/s.
    pub speed_m_per_s: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz, if known.
    pub frequency_sd_hz: Option<f64>,
}

/// The parts of a ridge whose frequencies agree from segment to segment, in order of time, with gaps between
/// them.
pub fn coherent_parts(ridge: &Ridge, of: &Spectrogram) -> Vec<Vec<RidgePoint>> {
    let largest_m = of.amplitude_m.iter().flatten().flatten().fold(0.0, |most: f64, a| most.max(*a));
    let least_m = math::powf(10.0, -DYNAMIC_RANGE_DB / 20.0) * largest_m;
    let strong: Vec<RidgePoint> = ridge.points.iter().filter(|p| p.amplitude_m >= least_m).copied().collect();
    // the last segment shares no frame with the first: fewer points cover hardly more than one segment and
    // may agree by chance
    let fewest = MIN_PART_SEGMENTS.max((ridge.segment_s / ridge.hop_s).round() as usize + 1);
    let parts = strong.chunk_by(|a, b| is_continuous(ridge, a, b)).filter(|part| part.len() >= fewest);
    parts.map(<[RidgePoint]>::to_vec).collect()
}

/// Whether point `b` continues the course of point `a`.
fn is_continuous(ridge: &Ridge, a: &RidgePoint, b: &RidgePoint) -> bool {
    let apart_s = b.time_s - a.time_s;
    let step_hz = b.frequency_hz - a.frequency_hz - apart_s * (a.rate_hz_per_s + b.rate_hz_per_s) / 2.0;
    // segments that share fewer frames may differ by proportionally more
    let allowed_hz =
        MAX_FREQUENCY_STEP / ridge.segment_s * (ridge.hop_s / (USUAL_HOP * ridge.segment_s)).max(1.0);
    apart_s < 1.5 * ridge.hop_s && step_hz.abs() <= allowed_hz
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time_frequency::SpectrogramSettings;
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 5000.0;
    const BAND_HZ: (f64, f64) = (400.0, 1500.0);

    /// Times, s, of all points of a ridge and of those points that belong to a course, for a record of 0.6 s
    /// in segments of 28.8 ms.
    fn times(at_m: impl Fn(f64) -> f64) -> [Vec<f64>; 2] {
        let record: Vec<Option<f64>> = (0..3000).map(|i| Some(at_m(f64::from(i) / RATE_HZ))).collect();
        let settings = SpectrogramSettings { segment_s: Some(0.0288), band_hz: Some(BAND_HZ), overlap: None };
        let spectrogram = Spectrogram::new(&record, RATE_HZ, &settings).unwrap();
        let ridge = spectrogram.find_ridge(&record, BAND_HZ).unwrap();
        let drawn = coherent_parts(&ridge, &spectrogram);
        let time = |p: &RidgePoint| p.time_s;
        [ridge.points.iter().map(time).collect(), drawn.iter().flatten().map(time).collect()]
    }

    #[test]
    fn a_course_that_drifts_is_drawn_whole() {
        for rate_hz_per_s in [0.0, 800.0, -400.0] {
            let [followed, drawn] = times(|t| 1e-5 * (TAU * (700.0 + rate_hz_per_s * t / 2.0) * t).sin());
            assert!(
                followed.len() > 70 && drawn == followed,
                "{rate_hz_per_s}: {} of {}",
                drawn.len(),
                followed.len()
            );
        }
    }

    #[test]
    fn what_lies_under_every_colour_is_not_drawn() {
        // after 0.3 s only a remainder of a millionth of the cycle is left
        let [followed, drawn] =
            times(|t| if t < 0.3 { 1e-5 * (TAU * 900.0 * t).sin() } else { 1e-11 * (TAU * 600.0 * t).sin() });
        assert!(followed.iter().filter(|t| **t > 0.35).count() > 20, "{followed:?}");
        assert!(drawn.len() > 30 && drawn.iter().all(|t| *t < 0.33), "{drawn:?}");
    }

    #[test]
    fn sidebands_of_a_frequency_that_swings_within_a_segment_are_no_course() {
        // from 0.3 s on, the phase swings by 1.43 at 75 Hz: carrier and first sidebands are equally high
        // there, and their heights change
        let swing = |t: f64| if t < 0.3 { 0.0 } else { 1.43 + 0.3 * (40.0 * t).sin() };
        let [followed, drawn] = times(|t| 1e-5 * (TAU * 800.0 * t + swing(t) * (TAU * 75.0 * t).sin()).sin());
        let [before, after] = [|t: &&f64| **t < 0.28, |t: &&f64| **t > 0.32];
        assert!(drawn.iter().filter(before).count() > 30);
        assert!(
            drawn.iter().filter(after).count() < followed.iter().filter(after).count() / 2,
            "{followed:?} {drawn:?}"
        );
    }
}
