//! Phase of a run of the model relative to the recording.

use crate::recording::channel::central_moments;
use portable_math as math;
use std::f64::consts::TAU;

/// Length of a window in which the phase is measured, in cycles.
const CYCLES: f64 = 4.0;
/// Minimum number of frames in a window.
const MIN_FRAMES: usize = 12;
/// Minimum fraction of the frames of a window in which both motions are known.
const MIN_PRESENT: f64 = 0.8;
/// A window counts if the amplitude in both motions is at least this fraction of the largest amplitude of the
/// recording.
const MIN_AMPLITUDE: f64 = 0.2;

/// Cycles by which the oscillation of `model` at the frequency `frequency_hz` gets ahead of that of
/// `measured`, from the first window in which both oscillate to the last. The phase difference is measured in
/// windows of four cycles and followed from window to window. `None` with fewer than two such windows.
pub(super) fn drift_cycles(
    [measured, model]: [&[Option<f64>]; 2],
    rate_hz: f64,
    frequency_hz: f64,
) -> Option<f64> {
    let frames = ((CYCLES * rate_hz / frequency_hz).round() as usize).max(MIN_FRAMES);
    let per_frame = TAU * frequency_hz / rate_hz;
    let windows = measured.chunks_exact(frames).zip(model.chunks_exact(frames));
    let phasors = windows.map(|(measured, model)| {
        let pairs = measured.iter().zip(model).enumerate();
        let both: Vec<(f64, [f64; 2])> =
            pairs.filter_map(|(i, (a, b))| Some((i as f64, [(*a)?, (*b)?]))).collect();
        let enough = both.len() as f64 >= MIN_PRESENT * frames as f64;
        enough.then(|| [0, 1].map(|k| phasor(both.iter().map(|(i, pair)| (*i, pair[k])), per_frame)))
    });
    let phasors: Vec<[[f64; 2]; 2]> = phasors.flatten().collect();
    let size = |[re, im]: [f64; 2]| math::hypot(re, im);
    let least = MIN_AMPLITUDE * phasors.iter().map(|[measured, _]| size(*measured)).fold(0.0, f64::max);
    let is_clear =
        |pair: &&[[f64; 2]; 2]| pair.iter().all(|phasor| size(*phasor) >= least.max(f64::MIN_POSITIVE));
    let ahead = |[[a, b], [c, d]]: &[[f64; 2]; 2]| math::atan2(b * c - a * d, a * c + b * d) / TAU;
    let phases: Vec<f64> = phasors.iter().filter(is_clear).map(ahead).collect();
    let steps = phases.windows(2).map(|pair| {
        let step = pair[1] - pair[0];
        step - step.round()
    });
    (phases.len() >= 2).then(|| steps.sum())
}

/// Fourier sum of samples at an angular frequency, rad per frame: real and imaginary part. A straight line is
/// removed first. Each sample is its frame and its value.
fn phasor(samples: impl Iterator<Item = (f64, f64)>, per_frame: f64) -> [f64; 2] {
    let points: Vec<(f64, f64)> = samples.collect();
    let ([mean_i, mean], [spread, both]) = central_moments(&points);
    let slope = if spread > 0.0 { both / spread } else { 0.0 };
    let left = points.iter().map(|(i, x)| (per_frame * i, x - mean - slope * (i - mean_i)));
    left.fold([0.0; 2], |[re, im], (angle, x)| [re + x * math::cos(angle), im + x * math::sin(angle)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(frequency_hz: f64, amplitude: f64) -> Vec<Option<f64>> {
        let at = |i: u32| {
            3.0 + 1e-3 * f64::from(i) + amplitude * (TAU * frequency_hz * f64::from(i) / 5000.0).sin()
        };
        (0..2000).map(|i| Some(at(i)).filter(|_| i % 17 != 3)).collect()
    }

    /// From the middle of the first window of 29 frames to that of the last, an oscillation at 702.5 Hz gains
    /// nearly one cycle on one at 700 Hz.
    #[test]
    fn the_cycles_between_two_frequencies_are_counted() {
        let drift =
            |model_hz| drift_cycles([&wave(700.0, 1.0), &wave(model_hz, 0.6)], 5000.0, 700.0).unwrap();
        let lasts_s = 67.0 * 29.0 / 5000.0;
        assert!((drift(702.5) - 2.5 * lasts_s).abs() < 0.01, "{}", drift(702.5));
        assert!((drift(695.0) + 5.0 * lasts_s).abs() < 0.02, "{}", drift(695.0));
        assert!(drift(700.0).abs() < 1e-3, "{}", drift(700.0));
    }

    #[test]
    fn a_motion_that_does_not_oscillate_has_no_drift() {
        assert_eq!(drift_cycles([&wave(700.0, 1.0), &vec![None; 2000]], 5000.0, 700.0), None);
        assert_eq!(drift_cycles([&wave(700.0, 1.0), &wave(700.0, 0.0)], 5000.0, 700.0), None);
    }
}
