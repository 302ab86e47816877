//! The Hann-windowed amplitude spectrum of one pattern of frames, for record after record of it.

use super::transform::RealTransform;
use super::window::{self, WindowSums};
use super::windowed::{WindowedSpectrum, sidelobe_maxima};
use crate::math;
use std::cell::RefCell;
use std::sync::{Arc, OnceLock};

/// Windows without gaps that a thread keeps: a fit reads a few, of the same lengths in every run of its
/// model.
const CACHED_WINDOWS: usize = 16;
/// Longest padded length of a window that is kept: together they take a few megabytes.
const LONGEST_CACHED: usize = 1 << 16;

thread_local! {
    /// The last windows without gaps, newest last.
    static WINDOWS: RefCell<Vec<HannWindow>> = const { RefCell::new(Vec::new()) };
}

/// Weights of a record's frames, and the sidelobes of their transform.
#[derive(Clone)]
struct HannWindow {
    weights: Arc<Vec<f64>>,
    envelope: Arc<OnceLock<Vec<f64>>>,
    sums: WindowSums,
    padded: usize,
}

impl HannWindow {
    fn new(pattern: &[Option<f64>], padded: usize) -> Self {
        let weights = window::hann_weights(pattern);
        Self {
            sums: WindowSums::from_weights(&weights),
            weights: Arc::new(weights),
            envelope: Arc::default(),
            padded,
        }
    }

    /// The same, from those that are kept where it has no gaps.
    fn from_cache(pattern: &[Option<f64>], padded: usize) -> Self {
        if padded > LONGEST_CACHED || pattern.iter().any(Option::is_none) {
            return Self::new(pattern, padded);
        }
        WINDOWS.with_borrow_mut(|kept| {
            if let Some(known) =
                kept.iter().find(|known| known.padded == padded && known.weights.len() == pattern.len())
            {
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

/// A window over the frames present, with its transform.
pub(super) struct Periodogram {
    transform: RealTransform,
    /// Weight of each frame.
    pub weights: Arc<Vec<f64>>,
    envelope: Arc<OnceLock<Vec<f64>>>,
    pub sums: WindowSums,
    padded: usize,
}

impl Periodogram {
    /// For records with values where `pattern` has them, padded to `padded` values.
    pub(super) fn new(pattern: &[Option<f64>], padded: usize) -> Self {
        let HannWindow { weights, envelope, sums, padded } = HannWindow::from_cache(pattern, padded);
        Self { transform: RealTransform::new(padded), weights, envelope, sums, padded }
    }

    /// The sidelobes of the weights' transform; made when they are first asked for.
    pub(super) fn sidelobe_envelope(&self) -> &[f64] {
        let lobe = || self.transform.magnitudes(self.weights.iter().map(|w| w / self.sums.first));
        self.envelope.get_or_init(|| sidelobe_maxima(lobe(), self.weights.len(), self.padded))
    }

    /// Factor that makes a weighted sum an amplitude.
    pub(super) fn amplitude_scale(&self) -> f64 {
        2.0 / self.sums.first
    }

    /// Amplitude that a sine at each bin would have, m.
    pub(super) fn amplitudes(&self, residual: &[f64]) -> Vec<f64> {
        let scaled = self.amplitude_scale();
        self.transform.magnitudes(residual.iter().zip(self.weights.iter()).map(|(x, w)| x * w * scaled))
    }

    /// Amplitudes as the search for peaks takes them; `least_m` is the amplitude of rounding.
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

    /// Amplitude that an oscillation of `cycles` cycles shows in the spectrum, m: `2 |sum w x exp(-2 pi i n
    /// t)| / sum w`.
    pub(super) fn amplitude_at(&self, values: &[f64], cycles: f64) -> f64 {
        Self::amplitude_with_weights(&self.weights, values, cycles)
    }

    /// The same by other weights.
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

    /// Standard deviation of white noise that shows this root mean square in a bin, m.
    pub(super) fn noise_sd_m(&self, rms_m: f64) -> f64 {
        rms_m * self.sums.first / (2.0 * self.sums.second.sqrt())
    }
}
