//! Hann window and transform for one pattern of missing frames, reused for the amplitude spectra of all
//! records with that pattern.

use super::transform::RealTransform;
use portable_math as math;
use std::cell::RefCell;
use std::sync::{Arc, OnceLock};

/// Number of windows without gaps that a thread keeps: a fit uses records of a few lengths, which are the
/// same in every run of its model.
const CACHED_WINDOWS: usize = 16;
/// Largest padded length, in samples, of a window that is kept; all kept windows together take a few
/// megabytes.
const LONGEST_CACHED: usize = 1 << 16;

thread_local! {
    /// The windows without gaps that were made last, the newest at the end.
    static WINDOWS: RefCell<Vec<HannWindow>> = const { RefCell::new(Vec::new()) };
}

/// A Hann window over the frames present: its weights, and the sidelobes of the transform of the weights.
#[derive(Clone)]
struct HannWindow {
    weights: Arc<Vec<f64>>,
    envelope: Arc<OnceLock<Vec<f64>>>,
    sums: WindowSums,
    padded: usize,
}

impl HannWindow {
    fn new(pattern: &[Option<f64>], padded: usize) -> Self {
        let weights = hann_weights(pattern);
        let sums = WindowSums::from_weights(&weights);
        Self { weights: Arc::new(weights), envelope: Arc::default(), sums, padded }
    }

    /// A window from the cache if the pattern has no gaps, else a new one.
    fn from_cache(pattern: &[Option<f64>], padded: usize) -> Self {
        if padded > LONGEST_CACHED || pattern.iter().any(Option::is_none) {
            return Self::new(pattern, padded);
        }
        WINDOWS.with_borrow_mut(|kept| {
            let same = |known: &&HannWindow| known.padded == padded && known.weights.len() == pattern.len();
            if let Some(known) = kept.iter().find(same) {
                return known.clone();
            }
            if kept.len() == CACHED_WINDOWS {
                kept.remove(0);
            }
            let new = Self::new(pattern, padded);
            kept.push(new.clone());
            new
        })
    }
}

/// A Hann window over the frames present, with the Fourier transform that it is used with.
pub(super) struct Periodogram {
    transform: RealTransform,
    /// Weight of each frame.
    pub weights: Arc<Vec<f64>>,
    envelope: Arc<OnceLock<Vec<f64>>>,
    pub sums: WindowSums,
    padded: usize,
}

impl Periodogram {
    /// A window for records with values in the same frames as `pattern`, padded to `padded` values.
    pub(super) fn new(pattern: &[Option<f64>], padded: usize) -> Self {
        let HannWindow { weights, envelope, sums, padded } = HannWindow::from_cache(pattern, padded);
        Self { transform: RealTransform::new(padded), weights, envelope, sums, padded }
    }

    /// Envelope of the sidelobes of the window, as [`sidelobe_maxima`] gives it; computed on first use.
    pub(super) fn sidelobe_envelope(&self) -> &[f64] {
        let lobe = || self.transform.magnitudes(self.weights.iter().map(|w| w / self.sums.first));
        self.envelope.get_or_init(|| sidelobe_maxima(lobe(), self.weights.len(), self.padded))
    }

    /// Factor that converts a weighted sum over the frames to an amplitude.
    pub(super) fn amplitude_scale(&self) -> f64 {
        2.0 / self.sums.first
    }

    /// Amplitude, m, in each bin of the weighted spectrum. For a sine at the frequency of a bin, it equals
    /// the amplitude of the sine.
    pub(super) fn amplitudes(&self, residual: &[f64]) -> Vec<f64> {
        let scaled = self.amplitude_scale();
        self.transform.magnitudes(residual.iter().zip(self.weights.iter()).map(|(x, w)| x * w * scaled))
    }

    /// The spectrum in the form in which its peaks are searched for; `least_m` is the amplitude of rounding
    /// errors, m.
    pub(super) fn windowed_spectrum<'a>(
        &'a self,
        amplitude_m: &'a [f64],
        frame_rate_hz: f64,
        least_m: f64,
    ) -> WindowedSpectrum<'a> {
        let frames = self.weights.len();
        WindowedSpectrum {
            amplitude_m,
            envelope: self.sidelobe_envelope(),
            bin_hz: self.bin_hz(frame_rate_hz),
            resolution_hz: frame_rate_hz / frames as f64,
            frames,
            present: self.sums.present,
            sums: self.sums,
            least_m,
        }
    }

    /// Distance of the bins, Hz.
    pub(super) fn bin_hz(&self, frame_rate_hz: f64) -> f64 {
        frame_rate_hz / self.padded as f64
    }

    /// Amplitude, m, in the spectrum with the given weights at the frequency of `cycles` cycles in the
    /// record: `2 * |sum(w * x * exp(-2 pi i n t))| / sum(w)`.
    pub(super) fn amplitude_with_weights(weights: &[f64], values: &[f64], cycles: f64) -> f64 {
        let turn = std::f64::consts::TAU * cycles / values.len() as f64;
        let add = |(re, im): (f64, f64), (i, (x, w)): (usize, (&f64, &f64))| {
            let (sine, cosine) = math::sin_cos(turn * i as f64);
            (re + x * w * cosine, im + x * w * sine)
        };
        let (re, im) = values.iter().zip(weights).enumerate().fold((0.0, 0.0), add);
        2.0 * math::hypot(re, im) / WindowSums::from_weights(weights).first
    }

    /// Equivalent noise bandwidth of the window, Hz.
    pub(super) fn noise_bandwidth_hz(&self, frame_rate_hz: f64) -> f64 {
        frame_rate_hz * self.sums.second / (self.sums.first * self.sums.first)
    }

    /// Standard deviation per frame, m, of the white noise whose root mean square in a bin is `rms_m`.
    pub(super) fn noise_sd_m(&self, rms_m: f64) -> f64 {
        rms_m * self.sums.first / (2.0 * self.sums.second.sqrt())
    }
}

/// Sums over the weights of a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindowSums {
    pub first: f64,
    pub second: f64,
    /// Number of frames that have a value.
    pub present: usize,
}

impl WindowSums {
    pub(super) fn from_weights(weights: &[f64]) -> Self {
        let add = |s: Self, w: &f64| Self {
            first: s.first + w,
            second: s.second + w * w,
            present: s.present + usize::from(*w > 0.0),
        };
        weights.iter().fold(Self { first: 0.0, second: 0.0, present: 0 }, add)
    }
}

/// Weights `sin^2(pi (i + 1/2) / n)`, symmetric and positive; zero for a frame without a value.
pub(super) fn hann_weights(samples: &[Option<f64>]) -> Vec<f64> {
    let n = samples.len() as f64;
    let weight = |i: usize| math::powi(math::sin(std::f64::consts::PI * (i as f64 + 0.5) / n), 2);
    samples.iter().enumerate().map(|(i, x)| if x.is_some() { weight(i) } else { 0.0 }).collect()
}

/// The median, or the larger of the two middle values of an even number of values; `None` for an empty list.
pub(super) fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Width of a bin, in resolutions, above which the bins miss the top of a sidelobe; a sidelobe is one
/// resolution wide.
const COARSE_BINS: f64 = 0.25;
/// Number of bins by which the distance of two peaks is reduced if bins are wider than `COARSE_BINS`: half a
/// bin for each peak, and one bin because the top of a sidelobe may lie between two bins.
const ROUNDED_BINS: usize = 2;

/// An amplitude spectrum with the envelope of the sidelobes of its window.
pub(super) struct WindowedSpectrum<'a> {
    pub amplitude_m: &'a [f64],
    pub envelope: &'a [f64],
    pub bin_hz: f64,
    pub resolution_hz: f64,
    pub frames: usize,
    pub present: usize,
    pub sums: WindowSums,
    /// Amplitude of rounding errors, m.
    pub least_m: f64,
}

/// For each distance in bins, the largest value of a window's transform at that distance or farther, divided
/// by its value at zero. Gaps in the record raise these values.
pub(super) fn sidelobe_maxima(lobe: Vec<f64>, frames: usize, padded: usize) -> Vec<f64> {
    let mut envelope = lobe;
    for k in (0..envelope.len().saturating_sub(1)).rev() {
        envelope[k] = envelope[k].max(envelope[k + 1]);
    }
    if frames as f64 > COARSE_BINS * padded as f64 {
        // both peaks are up to half a bin off, which is too much of a sidelobe's width
        let rounded = ROUNDED_BINS.min(envelope.len());
        envelope.rotate_right(rounded);
        envelope.iter_mut().take(rounded).for_each(|value| *value = 1.0);
    }
    envelope
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sums_are_those_of_the_hann_window() {
        let sums = WindowSums::from_weights(&hann_weights(&[Some(1.0); 64]));
        assert!((sums.first - 32.0).abs() < 1e-12 && (sums.second - 24.0).abs() < 1e-12);
        assert_eq!(sums.present, 64);
    }

    #[test]
    fn a_missing_frame_has_no_weight() {
        let weights = hann_weights(&[Some(1.0), None, Some(1.0), Some(1.0)]);
        assert_eq!(weights[1], 0.0);
        assert!((weights[2] - 0.853_553_390_593_273_8).abs() < 1e-15);
    }
}
