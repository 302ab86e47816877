//! What is checked before a record is analysed.

use super::error::SpectrumError;
use super::limits::{LONG_PADDED, MIN_SAMPLES, MOST_PADDED};
use super::settings::SpectrumSettings;
use super::trend::Trend;

/// Padding of longer records: bins half a resolution apart still show every peak of a Hann window, which is
/// four resolutions wide.
const LONG_PADDING: usize = 2;

/// Whether a band holds a frequency of the spectrum.
pub(super) fn check_band(band_hz: Option<(f64, f64)>, frame_rate_hz: f64) -> Result<(), SpectrumError> {
    let nyquist = frame_rate_hz / 2.0;
    match band_hz.filter(|(low, high)| !(*low >= 0.0 && low < high && *low < nyquist)) {
        Some((low, high)) => Err(SpectrumError::Band { low, high, nyquist }),
        None => Ok(()),
    }
}

/// The padded length and the trend, after every check of record and band.
pub(super) fn check_record(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    settings: &SpectrumSettings,
) -> Result<(usize, Trend), SpectrumError> {
    /// Squares of larger values overflow.
    const LARGEST: f64 = 1e100;
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return Err(SpectrumError::FrameRate { found: frame_rate_hz });
    }
    let unusable = |x: &f64| x.is_nan() || x.abs() > LARGEST;
    if let Some((frame, found)) =
        samples.iter().enumerate().find_map(|(i, x)| x.filter(unusable).map(|x| (i, x)))
    {
        return Err(SpectrumError::NotFinite { frame, found });
    }
    let found = samples.iter().flatten().count();
    if found < MIN_SAMPLES {
        return Err(SpectrumError::TooFew { found, least: MIN_SAMPLES });
    }
    check_band(settings.band_hz, frame_rate_hz)?;
    let (frames, padding) = (samples.len(), settings.zero_padding.max(1));
    let padded_by = |padding: usize| frames.checked_mul(padding).and_then(usize::checked_next_power_of_two);
    let shortened = || padded_by(padding.min(LONG_PADDING)).map(|n| n.max(LONG_PADDED));
    let padded =
        padded_by(padding).filter(|n| *n <= LONG_PADDED).or_else(shortened).filter(|n| *n <= MOST_PADDED);
    let padded = padded.ok_or(SpectrumError::TooLong { frames, padding })?;
    let detrend = settings.detrend.unwrap_or_default();
    let trend = detrend
        .to_trend(frames, frame_rate_hz)
        .ok_or(SpectrumError::Trend { detrend, duration_s: frames as f64 / frame_rate_hz })?;
    Ok((padded, trend))
}
