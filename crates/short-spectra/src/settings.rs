//! How a record is analysed.

use super::trend::Detrend;

/// How a record is analysed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumSettings {
    /// Trend to remove. With `None`, `SpectralAnalysis::from_record` chooses it from the record, and
    /// `analyse_spectrum` takes a cubic.
    pub detrend: Option<Detrend>,
    /// Padded length over the record's, before rounding up to a power of two. If that exceeds `LONG_PADDED`,
    /// the record is padded to `LONG_PADDED`, or to twice its own length if that is more, and its peaks are
    /// located between the bins from the samples.
    pub zero_padding: usize,
    /// Band in which components are sought, Hz; `None` for all of the spectrum.
    pub band_hz: Option<(f64, f64)>,
    /// Most components listed.
    pub max_components: usize,
    /// Fastest oscillation that the motion may hold, Hz; aliases of a component are sought up to it.
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

/// Padded length over the record's: a parabola through three such bins locates the peak of a Hann window.
pub(crate) const ZERO_PADDING: usize = 8;
/// Components listed unless asked for otherwise.
pub const MAX_COMPONENTS: usize = 8;
/// Fewest frames with a value: a cubic takes four and as many are left.
pub const MIN_SAMPLES: usize = 8;
/// Fewest cycles of a resolvable component: with fewer, the window's lobe (half width two bins) reaches its
/// own mirror image and the trend.
pub(crate) const MIN_CYCLES: f64 = 3.0;
/// Longest padded record, samples, limited by memory.
pub(super) const MOST_PADDED: usize = 1 << 26;
/// Longest padded length at the padding of the settings, samples. A transform of this length takes some 50
/// ms; one of a million samples padded eight times takes half a second.
pub(crate) const LONG_PADDED: usize = 1 << 21;
/// Padded length from which record and window are transformed in parallel, samples; a shorter transform takes
/// less than 10 ms.
pub(super) const PADDED_AT_ONCE: usize = 1 << 20;
/// Amplitudes below this share of the largest sample are rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// Fastest oscillation that is expected, Hz, without a setting.
pub const FASTEST_HZ: f64 = 1300.0;
/// Amplitude over the noise floor from which a component is clear, dB: at 18 dB the frequency is accurate to
/// a few hundredths of a resolution.
pub(crate) const CLEAR_DB: f64 = 18.0;
