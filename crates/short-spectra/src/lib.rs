//! Finds the oscillations, called components, in short records with missing frames.
//!
//! [`SpectralAnalysis::from_record`] describes a whole record at once: trend, oscillations with decay, onset,
//! drift and harmonics, smooth steps, frames left out, and coloured noise. The posterior probability chooses
//! among all of them. Every component has standard deviations and a verdict.
//!
//! [`analyse_spectrum`] finds the peaks of one Hann-windowed spectrum. It is fast and makes no choices that
//! depend on the data, so that a fit can compare thousands of records. Gaps of up to four frames are filled
//! for the transform only (`gap_filling.rs`). If more than a tenth of the frames are missing, the components
//! are then refined on the frames present (`gap_refinement.rs`). The record is detrended, weighted, padded
//! with zeros and transformed. A frame that is still missing keeps its place in time and has weight zero.
//! Amplitudes are scaled by the sum of the weights present, `2 |sum w x exp(-i w t)| / sum w`: the peak of a
//! sine of amplitude A has the height A.
//!
//! # Three tones among gaps
//!
//! ```
//! use short_spectra::{SampledRecord, SpectralAnalysis, SpectrumSettings};
//! use std::f64::consts::TAU;
//!
//! // 0.3 s at 2,000 frames/s in micrometres; every seventh frame is missing
//! let tones = [(40.0, 20.0), (130.0, 8.0), (410.0, 3.0)];
//! let value = |t: f64| tones.map(|(hz, um)| um * 1e-6 * (TAU * hz * t).sin()).iter().sum::<f64>();
//! let samples: Vec<Option<f64>> =
//!     (0..600).map(|i| (i % 7 != 3).then(|| value(f64::from(i) / 2000.0))).collect();
//!
//! let record = SampledRecord { samples: &samples, frame_rate_hz: 2000.0, exposure_s: None };
//! let analysis = SpectralAnalysis::from_record(&record, &SpectrumSettings::default())?;
//! let found = &analysis.spectrum.components;
//! assert_eq!(found.len(), 3);
//! for (component, (hz, um)) in found.iter().zip(tones) {
//!     assert!((component.frequency_hz - hz).abs() < 1e-3);
//!     assert!((component.amplitude_m - um * 1e-6).abs() < 1e-9);
//! }
//! # Ok::<(), short_spectra::SpectrumError>(())
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may call them

mod amplitude_spectrum;
mod analysis;
mod classification;
mod component;
mod decimation;
mod decomposition;
mod error;
mod frequency_drift;
mod gap_filling;
mod gap_refinement;
mod least_squares;
mod multitaper;
pub mod noise;
mod peak_zoom;
mod peaks;
mod periodogram;
mod record;
mod relations;
pub mod sampling;
mod settings;
mod target;
pub mod time_frequency;
mod transform;
mod trend;

pub use amplitude_spectrum::{Spectrum, WindowedTransform};
pub use analysis::{LONGEST_DECOMPOSED, Oscillation, RemovedTrend, SpectralAnalysis};
pub use component::{
    AliasSource, Component, ComponentReason, ComponentVerdict, Estimator, Harmonic, MainsMultiple, Sideband,
    Subharmonic,
};
pub use decomposition::exceeds_noise;
pub use error::SpectrumError;
pub use record::SampledRecord;

pub use settings::{FASTEST_HZ, MAX_COMPONENTS, MIN_SAMPLES};

pub use multitaper::{Multitaper, MultitaperError, TAPERS};

pub use settings::SpectrumSettings;
pub use target::Target;

pub use trend::{Detrend, UnknownDetrend};

/// Spectrum of a record of displacement, m, one sample per frame (`None` for a missing frame).
///
/// # Errors
/// [`SpectrumError`] if the record, the frame rate or the band allows no spectrum.
pub fn analyse_spectrum(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    settings: &SpectrumSettings,
) -> Result<Spectrum, SpectrumError> {
    Ok(WindowedTransform::new(samples, frame_rate_hz, settings)?.into_spectrum(settings))
}
