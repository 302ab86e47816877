//! A spectrum and what its window does to a sine.

use super::window::WindowSums;

/// Bins wider than this share of a resolution miss the top of a sidelobe, which is one resolution wide.
const COARSE_BINS: f64 = 0.25;
/// Bins by which the distance of two peaks then counts as nearer: half a bin for each, and one to have the
/// sidelobe's top between two bins.
const ROUNDED_BINS: usize = 2;

/// A spectrum and what its window does to a sine.
pub(super) struct WindowedSpectrum<'a> {
    pub amplitude_m: &'a [f64],
    /// From [`sidelobe_maxima`].
    pub envelope: &'a [f64],
    pub bin_hz: f64,
    pub resolution_hz: f64,
    pub frames: usize,
    pub present: usize,
    pub sums: WindowSums,
    /// Amplitude of rounding, m.
    pub least_m: f64,
}

/// Largest value of the transform of a window, which is 1 at zero, at or beyond each distance, in bins; gaps
/// in the record raise it.
pub(super) fn sidelobe_maxima(lobe: Vec<f64>, frames: usize, padded: usize) -> Vec<f64> {
    let mut envelope = lobe;
    for k in (0..envelope.len().saturating_sub(1)).rev() {
        envelope[k] = envelope[k].max(envelope[k + 1]);
    }
    if frames as f64 > COARSE_BINS * padded as f64 {
        // both peaks are half a bin off their own: of a sidelobe's width that is too much
        let rounded = ROUNDED_BINS.min(envelope.len());
        envelope.rotate_right(rounded);
        envelope.iter_mut().take(rounded).for_each(|value| *value = 1.0);
    }
    envelope
}
