//! How a record is analysed.

use super::trend::Detrend;

/// How a record is analysed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumSettings {
    /// What is removed; `None` to let the record choose (`SpectralAnalysis::from_record`), which is a cubic
    /// to begin
    /// with (`SpectralAnalysis::from_record`).
    pub detrend: Option<Detrend>,
    /// Padded length over the record's, before rounding up to a power of two. Where that would exceed
    /// `LONG_PADDED`, the record is padded to this length, or to twice its own if that is more, and its
    /// peaks are found between the bins from the samples.
    pub zero_padding: usize,
    /// Band in which components are sought, Hz; `None` for all of the spectrum.
    pub band_hz: Option<(f64, f64)>,
    /// Most components listed.
    pub max_components: usize,
    /// Fastest oscillation that the motion may hold, Hz: what could fold onto a component is looked for up to
    /// it.
    pub fastest_hz: f64,
}

impl Default for SpectrumSettings {
    fn default() -> Self {
        Self {
            detrend: None,
            zero_padding: ZERO_PADDING,
            band_hz: None,
            max_components: MAX_COMPONENTS,
            fastest_hz: FASTEST_HZ,
        }
    }
}

// What a record and its components must have, and how finely a spectrum is made.

/// Frames of padding for each frame of the record: bins fine enough that a parabola through three of them
/// finds the peak of a Hann window.
pub(crate) const ZERO_PADDING: usize = 8;
/// Components listed unless asked for otherwise.
pub(crate) const MAX_COMPONENTS: usize = 8;
/// Fewest frames with a value: a cubic takes four and as many are left.
pub(crate) const MIN_SAMPLES: usize = 8;
/// Fewest cycles in the record for a frequency of its own: below, the window's lobe (half width two bins)
/// reaches its own mirror image and the trend.
pub(crate) const MIN_CYCLES: f64 = 3.0;
/// Longest padded record, samples; beyond it memory, not the record, would be the limit.
pub(super) const MOST_PADDED: usize = 1 << 26;
/// Padded length, samples, up to which the padding is as asked for; a transform of this length takes some 50
/// ms, and one eight times the length of a million samples half a second.
pub(crate) const LONG_PADDED: usize = 1 << 21;
/// Padded length from which record and window are transformed at once: below, a transform takes less than a
/// hundredth of a second.
pub(super) const PADDED_AT_ONCE: usize = 1 << 20;
/// Amplitudes below this share of the largest sample are rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// Fastest oscillation that a blade is expected to show, Hz: blades of the model that meet both published
/// frequencies have stick-slip cycles of 700 to 1,300 Hz, the published experiment shows about 900 Hz.
pub(crate) const FASTEST_HZ: f64 = 1300.0;
/// Amplitude over the noise floor from which a component is clear, dB: at 18 dB the frequency is known to a
/// few hundredths of a resolution.
pub(crate) const CLEAR_DB: f64 = 18.0;
