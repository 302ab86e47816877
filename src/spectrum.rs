//! Components of short records with missing frames.
//!
//! [`SpectralAnalysis::of`] takes a record apart: trend, steady and decaying oscillations by least squares on the
//! frames present, one that drifts by its ridge, each with deviations and a verdict (`docs/spectra.md` has
//! the criteria). It is what `wiperlab spectrum` shows.
//!
//! [`analyse_spectrum`] reads the tops of one Hann-windowed spectrum, fast and without choices that depend on the
//! data, so that a fit can compare thousands of records by it. Gaps of up to four frames are bridged for the
//! transform alone (`spectrum/gaps.rs`); where more than a tenth of the frames is missing, the components
//! found are then refined on the frames present (`spectrum/refine.rs`). The record is detrended, weighted (a
//! frame that is still missing has weight zero on the true frame grid; no frame is closed up), padded with
//! zeros and transformed. Amplitudes are scaled by the weights present, `2 |sum w x exp(-i w t)| / sum w`: a
//! sine of amplitude A reads A at its peak.

mod amplitudes;
mod analysis;
mod check;
mod closely;
mod component;
mod cramer_rao;
mod drifting;
mod error;
mod flip;
mod gaps;
mod judge;
mod least_squares;
mod left_over;
mod limits;
mod matrix_pencil;
mod multitaper;
mod oscillations;
mod pair;
mod parabola;
mod peaks;
mod periodogram;
mod refine;
mod regular;
mod relations;
mod settings;
mod shapes;
mod sharp;
mod target;
pub mod time_frequency;
mod transform;
mod transformed;
mod transient;
mod trend;
mod verdict;
mod window;
mod windowed;

pub use amplitudes::Spectrum;
pub use analysis::{LONGEST_DECOMPOSED, Oscillation, RemovedTrend, SampledRecord, SpectralAnalysis};
pub use component::{Component, Estimator};
pub use error::SpectrumError;

pub use limits::{FASTEST_HZ, MAX_COMPONENTS, MIN_SAMPLES};

pub use multitaper::{Multitaper, MultitaperError, TAPERS};

pub use settings::SpectrumSettings;
pub use target::Target;
pub use transformed::WindowedTransform;

pub use trend::{Detrend, UnknownDetrend};
pub use verdict::{
    AliasSource, ComponentReason, ComponentVerdict, Harmonic, MainsMultiple, Sideband, Subharmonic,
};

/// Spectrum of a record of displacement, m, one sample a frame (`None` where there is none).
///
/// # Errors
/// [`SpectrumError`] when the record, the rate or the band cannot give one.
pub fn analyse_spectrum(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    settings: &SpectrumSettings,
) -> Result<Spectrum, SpectrumError> {
    Ok(WindowedTransform::new(samples, frame_rate_hz, settings)?.into_spectrum(settings))
}
