//! Why a record has no spectrum.

use super::limits::MOST_PADDED;
use super::trend::Detrend;

/// Why a record has no spectrum.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// Too few frames hold a value.
    #[error(
        "found {found} frames with a value, expected at least {least}; widen the window, remove less or choose another channel"
    )]
    TooFew {
        /// Frames with a value.
        found: usize,
        /// Fewest that this trend and a spectrum take.
        least: usize,
    },
    /// A sample, or what follows from it, is no finite number.
    #[error(
        "frame {frame} of the record: found {found}, expected a finite number below 1e100; remove the frame"
    )]
    NotFinite {
        /// 0-based frame.
        frame: usize,
        /// The value.
        found: f64,
    },
    /// The frame rate is no rate.
    #[error("frame rate: found {found} Hz, expected a finite number above 0")]
    FrameRate {
        /// The value, Hz.
        found: f64,
    },
    /// The band holds no frequency of the spectrum.
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
        /// What was to be removed.
        detrend: Detrend,
        /// Length of the record, s.
        duration_s: f64,
    },
    /// A segment of short-time spectra is too short, or longer than the record.
    #[error(
        "segment of {found_s} s: expected {least_s} s to {most_s} s; choose another length or leave it out"
    )]
    Segment {
        /// The value, s.
        found_s: f64,
        /// Shortest, s.
        least_s: f64,
        /// The record, s.
        most_s: f64,
    },
    /// The padded record would not fit.
    #[error(
        "a record of {frames} frames padded {padding} times: expected at most {MOST_PADDED} samples in all; shorten the window or the padding"
    )]
    TooLong {
        /// Frames.
        frames: usize,
        /// Padding.
        padding: usize,
    },
}
