//! Reasons for which a record has no spectrum.

use super::settings::{LONG_PADDED, MIN_SAMPLES, MOST_PADDED, SpectrumSettings};
use super::trend::{Detrend, Trend};

/// Reason for which a record has no spectrum.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// Too few frames have a value.
    #[error(
        "found {found} frames with a value, expected at least {least}; widen the window, remove less or choose another channel"
    )]
    TooFew {
        /// Number of frames with a value.
        found: usize,
        /// Minimum number of frames with a value for this trend and a spectrum.
        least: usize,
    },
    /// A sample is not a finite number, or its square overflows.
    #[error(
        "frame {frame} of the record: found {found}, expected a finite number below 1e100; remove the frame"
    )]
    NotFinite {
        /// Number of the frame, counted from 0.
        frame: usize,
        /// The value.
        found: f64,
    },
    /// The frame rate is not a positive finite number.
    #[error("frame rate: found {found} Hz, expected a finite number above 0")]
    FrameRate {
        /// The value, Hz.
        found: f64,
    },
    /// The band contains no frequency of the spectrum.
    #[error(
        "band {low}..{high} Hz: expected 0 <= low < high and low below half the frame rate, {nyquist} Hz; choose another band"
    )]
    Band {
        /// Lower end, Hz.
        low: f64,
        /// Upper end, Hz.
        high: f64,
        /// Half the frame rate, Hz.
        nyquist: f64,
    },
    /// The trend has too many columns for the record.
    #[error(
        "`{detrend}` on a record of {duration_s:.3} s: expected at most 46 half-waves; choose a lower frequency, a polynomial or a shorter window"
    )]
    Trend {
        /// The trend that was to be removed.
        detrend: Detrend,
        /// Length of the record, s.
        duration_s: f64,
    },
    /// A segment of short-time spectra is too short, or longer than the record.
    #[error(
        "segment of {found_s} s: expected {least_s} s to {most_s} s; choose another length or leave it out"
    )]
    Segment {
        /// The length of the segment, s.
        found_s: f64,
        /// Shortest permitted length, s.
        least_s: f64,
        /// Length of the record, s.
        most_s: f64,
    },
    /// The padded record would be too long.
    #[error(
        "a record of {frames} frames padded {padding} times: expected at most {MOST_PADDED} samples in all; shorten the window or the padding"
    )]
    TooLong {
        /// Number of frames.
        frames: usize,
        /// Padding factor.
        padding: usize,
    },
}

// Checks before a record is analysed.

/// Largest allowed padding factor of records whose requested padded length is too long: bins half a
/// resolution apart still show every peak of a Hann window, which is four resolutions wide.
const LONG_PADDING: usize = 2;

/// Checks that a band contains a frequency of the spectrum.
pub(super) fn check_band(band_hz: Option<(f64, f64)>, frame_rate_hz: f64) -> Result<(), SpectrumError> {
    let nyquist = frame_rate_hz / 2.0;
    match band_hz.filter(|(low, high)| !(*low >= 0.0 && low < high && *low < nyquist)) {
        Some((low, high)) => Err(SpectrumError::Band { low, high, nyquist }),
        None => Ok(()),
    }
}

/// Frame and value of the first sample that is not a number or whose square would overflow.
pub(super) fn find_unusable(samples: &[Option<f64>]) -> Option<(usize, f64)> {
    const LARGEST: f64 = 1e100;
    let unusable = |x: &f64| x.is_nan() || x.abs() > LARGEST;
    samples.iter().enumerate().find_map(|(i, x)| Some((i, x.filter(unusable)?)))
}

/// Checks record and band; returns the padded length and the trend.
pub(super) fn check_record(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    settings: &SpectrumSettings,
) -> Result<(usize, Trend), SpectrumError> {
    if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
        return Err(SpectrumError::FrameRate { found: frame_rate_hz });
    }
    if let Some((frame, found)) = find_unusable(samples) {
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
