//! How a record is analysed.

use super::limits::{FASTEST_HZ, MAX_COMPONENTS, ZERO_PADDING};
use super::trend::Detrend;

/// How a record is analysed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumSettings {
    /// What is removed; `None` to let the record choose ([`super::Analysis::of`]), which is a cubic to begin
    /// with ([`super::analyse`]).
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
