//! Settings of the analysis of a record.

use super::trend::Detrend;

/// Settings of the analysis of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumSettings {
    /// Trend to remove. With `None`, `SpectralAnalysis::from_record` chooses it from the record, and
    /// `analyse_spectrum` removes a cubic.
    pub detrend: Option<Detrend>,
    /// Ratio of the padded length to the length of the record, before rounding up to a power of two. If the
    /// padded length exceeds `LONG_PADDED`, the record is padded to `LONG_PADDED`, or to twice its own length
    /// if that is more, and its peaks are located between the bins from the samples.
    pub zero_padding: usize,
    /// Band in which components are searched for, Hz; `None` for the whole spectrum.
    pub band_hz: Option<(f64, f64)>,
    /// Maximum number of components listed.
    pub max_components: usize,
    /// Fastest oscillation that the motion may contain, Hz; possible aliases of a component are listed up to
    /// this frequency.
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

// Requirements on a record and its components, and spacing of the bins of a spectrum.

/// Default ratio of the padded length to that of the record: a parabola through three bins then locates the
/// peak of a Hann window.
pub(crate) const ZERO_PADDING: usize = 8;
/// Default maximum number of components listed.
pub const MAX_COMPONENTS: usize = 8;
/// Minimum number of frames with a value: twice the four that determine a cubic.
pub const MIN_SAMPLES: usize = 8;
/// Minimum number of cycles of a resolvable component: with fewer, the lobe of the window, two resolutions
/// wide on either side, reaches its own mirror image and the trend.
pub(crate) const MIN_CYCLES: f64 = 3.0;
/// Largest allowed length, in samples, of a padded record; memory limits it.
pub(super) const MOST_PADDED: usize = 1 << 26;
/// Maximum length, in samples, of a record padded by `zero_padding`; a record that would become longer is
/// padded less. A transform of this length takes about 50 ms; a transform of a million samples padded
/// eightfold takes half a second.
pub(crate) const LONG_PADDED: usize = 1 << 21;
/// Smallest padded length, in samples, at which record and window are transformed in parallel; a shorter
/// transform takes less than 10 ms.
pub(super) const PADDED_AT_ONCE: usize = 1 << 20;
/// Fraction of the largest sample below which amplitudes are rounding errors.
pub(super) const ROUNDING: f64 = 1e-12;
/// Default frequency of the fastest expected oscillation, Hz.
pub const FASTEST_HZ: f64 = 1300.0;
/// Ratio, dB, of an amplitude to the noise floor from which a component is clear: at 18 dB the frequency is
/// accurate to a few hundredths of a resolution.
pub(crate) const CLEAR_DB: f64 = 18.0;
