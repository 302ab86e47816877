//! Components of short records with missing frames.
//!
//! [`Analysis::of`] takes a record apart: trend, steady and decaying oscillations by least squares on the
//! frames present, one that drifts by its ridge, each with deviations and a verdict (`docs/spectra.md` has
//! the criteria). It is what `wiperlab spectrum` shows.
//!
//! [`analyse`] reads the tops of one Hann-windowed spectrum, fast and without choices that depend on the
//! data, so that a fit can compare thousands of records by it. Gaps of up to four frames are bridged for the
//! transform alone (`spectrum/gaps.rs`); where more than a tenth of the frames is missing, the components
//! found are then refined on the frames present (`spectrum/refine.rs`). The record is detrended, weighted (a
//! frame that is still missing has weight zero on the true frame grid; no frame is closed up), padded with
//! zeros and transformed. Amplitudes are scaled by the weights present, `2 |sum w x exp(-i w t)| / sum w`: a
//! sine of amplitude A reads A at its peak.

mod analysis;
mod cramer_rao;
mod drifting;
mod flip;
mod gaps;
mod least_squares;
mod matrix_pencil;
mod multitaper;
mod oscillations;
mod peaks;
mod periodogram;
mod refine;
mod sharp;
pub mod time_frequency;
mod transform;
mod transformed;
mod trend;
mod verdict;
mod window;

pub use analysis::{Analysis, LONGEST_FITTED, Oscillation, Record, Removed};
pub use multitaper::{FLOOR_LINES, Multitaper, MultitaperError, TAPER_RANGE, TAPERS};
pub use transformed::Transformed;
pub use trend::{Detrend, HIGHEST_DEGREE, UnknownDetrend};
pub use verdict::{FASTEST_HZ, Fold, Harmonic, Reason, Verdict};

use serde::Serialize;

/// Frames of padding for each frame of the record: bins fine enough that a parabola through three of them
/// finds the peak of a Hann window.
pub const ZERO_PADDING: usize = 8;
/// Components listed unless asked for otherwise.
pub const MAX_COMPONENTS: usize = 8;
/// Fewest frames with a value: a cubic takes four and as many are left.
pub const MIN_SAMPLES: usize = 8;
/// Fewest cycles in the record for a frequency of its own: below, the window's lobe (half width two bins)
/// reaches its own mirror image and the trend.
pub const MIN_CYCLES: f64 = 3.0;
/// Longest padded record, samples; beyond it memory, not the record, would be the limit.
const MOST_PADDED: usize = 1 << 26;
/// Padded length, samples, up to which the padding is as asked for; a transform of this length takes some 50
/// ms, and one eight times the length of a million samples half a second.
pub const LONG_PADDED: usize = 1 << 21;
/// Padding of longer records: bins half a resolution apart still show every peak of a Hann window, which is
/// four resolutions wide.
const LONG_PADDING: usize = 2;
/// Padded length from which record and window are transformed at once: below, a transform takes less than a
/// hundredth of a second.
const PADDED_AT_ONCE: usize = 1 << 20;
/// Amplitudes below this share of the largest sample are rounding.
const ROUNDING: f64 = 1e-12;

/// How a record is analysed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// What is removed; `None` to let the record choose ([`Analysis::of`]), which is a cubic to begin with
    /// ([`analyse`]).
    pub detrend: Option<Detrend>,
    /// Padded length over the record's, before rounding up to a power of two. Where that would exceed
    /// [`LONG_PADDED`], the record is padded to this length, or to twice its own if that is more, and its
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

impl Default for Settings {
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

pub use peaks::CLEAR_DB;
pub use refine::REFINED_MISSING;

/// One component of a spectrum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the frequency, Hz. Of least squares: what the rest around the component gives
    /// it, and what it moves by with a richer trend. Of a periodogram: 1.6 times the Cramér-Rao bound, and
    /// what a removed trend leaves.
    pub frequency_sd_hz: f64,
    /// Least and greatest frequency of a component that drifts; its frequency is the mean, weighted with its
    /// power.
    pub range_hz: Option<time_frequency::Range>,
    /// Amplitude of a steady oscillation; of a decaying one, where the record starts, m.
    pub amplitude_m: f64,
    /// Standard deviation of the amplitude, m.
    pub amplitude_sd_m: f64,
    /// Damping ratio, negative for a growing one; `None` where the estimator has none.
    pub damping_ratio: Option<f64>,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_sd: Option<f64>,
    /// Amplitude in the spectrum over its noise floor, `20 log10`, dB.
    pub snr_db: f64,
    /// Cramér-Rao bound of the frequency of this component alone, in white noise of the size found around it,
    /// in a record without gaps, Hz.
    pub cramer_rao_hz: f64,
    /// The chance that noise gives so steady a line (Thomson's F over the tapers): small for a steady
    /// oscillation, near one for a ring-down.
    pub line_probability: Option<f64>,
    /// How it was read.
    pub estimator: Estimator,
    /// What the frequency moves by when the trend takes two columns more, Hz.
    pub trend_shift_hz: Option<f64>,
    /// Amplitude that the removed trend would have shown at this frequency, m.
    pub leakage_m: Option<f64>,
    /// Part of the amplitude that the exposure has passed; `None` where the exposure is not known.
    pub exposure_passes: Option<f64>,
    /// What else the frequency may be.
    pub folded_from: Vec<Fold>,
    /// The component of which this is a harmonic.
    pub harmonic_of: Option<Harmonic>,
    /// What the frequency is worth: the gravest of the reasons, or clear.
    pub verdict: Verdict,
    /// All that was found against it, gravest first.
    pub reasons: Vec<Reason>,
}

/// How a component was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The top of a Hann-windowed periodogram.
    Periodogram,
    /// Least squares of the trend and all components on the frames present.
    LeastSquares,
    /// Means over the course of its frequency.
    Ridge,
}

impl Component {
    /// Whether the record holds enough of its cycles for a frequency of its own.
    #[must_use]
    pub fn is_resolvable(&self) -> bool {
        self.verdict != Verdict::NotResolvable
    }

    /// With nothing known but how it is read.
    fn of(estimator: Estimator) -> Self {
        Self {
            frequency_hz: 0.0,
            frequency_sd_hz: 0.0,
            range_hz: None,
            amplitude_m: 0.0,
            amplitude_sd_m: 0.0,
            damping_ratio: None,
            damping_ratio_sd: None,
            snr_db: 0.0,
            cramer_rao_hz: 0.0,
            line_probability: None,
            estimator,
            trend_shift_hz: None,
            leakage_m: None,
            exposure_passes: None,
            folded_from: Vec::new(),
            harmonic_of: None,
            verdict: Verdict::Clear,
            reasons: Vec::new(),
        }
    }
}

/// An amplitude spectrum and its components.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Frequencies of the bins, Hz, from 0 to half the frame rate.
    pub frequency_hz: Vec<f64>,
    /// Amplitude of a sine that peaks in each bin, m; with many gaps it reads low (9 % at 900 Hz and 5,000
    /// frames/s with 40 % missing at random), where the components do not.
    pub amplitude_m: Vec<f64>,
    /// Root mean square of the noise in a bin, m, from the median over the band.
    pub noise_floor_m: f64,
    /// One over the record's length, Hz: finer structure is not in the data.
    pub resolution_hz: f64,
    /// Equivalent noise bandwidth of the window as weighted by the frames present, Hz (1.5 resolutions
    /// without gaps).
    pub noise_bandwidth_hz: f64,
    /// Share of the frames that hold a value.
    pub present: f64,
    /// The components, largest amplitude first.
    pub components: Vec<Component>,
}

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

/// Spectrum of a record of displacement, m, one sample a frame (`None` where there is none).
///
/// # Errors
/// [`SpectrumError`] when the record, the rate or the band cannot give one.
pub fn analyse(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    settings: &Settings,
) -> Result<Spectrum, SpectrumError> {
    Ok(Transformed::of(samples, frame_rate_hz, settings)?.spectrum(settings))
}

impl Spectrum {
    /// The largest resolvable component between two frequencies, Hz.
    #[must_use]
    pub fn component_in_band(&self, low_hz: f64, high_hz: f64) -> Option<&Component> {
        let mut resolvable = self.components.iter().filter(|c| c.is_resolvable());
        resolvable.find(|c| c.frequency_hz >= low_hz && c.frequency_hz <= high_hz)
    }

    /// Root mean square of what lies between two frequencies, m (Parseval's sum over the bins, each counted
    /// once for its noise bandwidth).
    #[must_use]
    pub fn rms_in_band_m(&self, low_hz: f64, high_hz: f64) -> f64 {
        transformed::rms_in_band_m(
            &self.amplitude_m,
            self.frequency_hz.get(1).copied().unwrap_or(0.0),
            self.noise_bandwidth_hz,
            (low_hz, high_hz),
        )
    }
}

/// Whether a band holds a frequency of the spectrum.
fn check_band(band_hz: Option<(f64, f64)>, frame_rate_hz: f64) -> Result<(), SpectrumError> {
    let nyquist = frame_rate_hz / 2.0;
    match band_hz.filter(|(low, high)| !(*low >= 0.0 && low < high && *low < nyquist)) {
        Some((low, high)) => Err(SpectrumError::Band { low, high, nyquist }),
        None => Ok(()),
    }
}

/// The padded length and the trend, after every check of record and band.
fn check(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    settings: &Settings,
) -> Result<(usize, trend::Trend), SpectrumError> {
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
        .trend(frames, frame_rate_hz)
        .ok_or(SpectrumError::Trend { detrend, duration_s: frames as f64 / frame_rate_hz })?;
    Ok((padded, trend))
}
