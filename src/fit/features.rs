//! Features: numbers read from a recording, by the same code whether a camera or the model made it.
//!
//! A window's instants are found in each recording by itself, so model and measurement need not share a clock.

use super::objective::{Model, Observed, Predict, RunFailure};
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants, Window, WindowError};
use crate::spectrum::{self, Detrend, Settings, SpectrumError};

/// Least relative standard deviation of a measured frequency. Reading a peak of 0.15 s leaves 0.03 Hz at 78 Hz (4e-4)
/// without any noise, and the model is read through another window of the same length.
pub const FREQUENCY_SD_FLOOR: f64 = 1e-3;

/// A band of the spectrum of a window of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Which channel.
    pub channel: Channel,
    /// Which frames.
    pub window: Window,
    /// Lower and upper end, Hz.
    pub band_hz: (f64, f64),
    /// What is removed before the transform.
    pub detrend: Detrend,
}

/// What is read.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading {
    /// Frequency of the largest component in a band, Hz.
    Frequency(Band),
    /// Amplitude of the largest component in a band, m.
    Amplitude(Band),
    /// Root mean square of a band, m.
    Rms(Band),
    /// Mean of the deflection `tip_x - head_x` over a window, m.
    MeanDeflection(Window),
    /// Time from the head's turn to the tip's release, s, at the given reversal (counted from 1).
    ReleaseAfterReversal(usize),
}

impl Reading {
    /// Its kind in a job; a component's is `frequency`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Frequency(_) => "frequency",
            Self::Amplitude(_) => "amplitude",
            Self::Rms(_) => "rms",
            Self::MeanDeflection(_) => "mean-deflection",
            Self::ReleaseAfterReversal(_) => "release-after-reversal",
        }
    }

    /// Unit of its value.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Frequency(_) => "Hz",
            Self::Amplitude(_) | Self::Rms(_) | Self::MeanDeflection(_) => "m",
            Self::ReleaseAfterReversal(_) => "s",
        }
    }
}

/// A reading with its name and the recording that it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// Name in the job.
    pub name: String,
    /// What is read.
    pub reading: Reading,
    /// From which recording of the job, counted from 0.
    pub recording: usize,
}

/// A value read from a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reckoned {
    /// The value, in the reading's unit.
    pub value: f64,
    /// Its standard deviation where the reading itself gives one.
    pub sd: Option<f64>,
}

/// Why a recording does not give a feature.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Missing {
    /// The window is not in the recording.
    #[error("{0}")]
    Window(#[from] WindowError),
    /// The window has no spectrum.
    #[error("{0}")]
    Spectrum(#[from] SpectrumError),
    /// The band has no component above the noise.
    #[error("no component between {low} and {high} Hz stands above the noise")]
    NoPeak {
        /// Lower end of the band, Hz.
        low: f64,
        /// Upper end of the band, Hz.
        high: f64,
    },
    /// The channel was not tracked in the window.
    #[error("no frame of the window has both points tracked")]
    NoFrames,
    /// An instant is not in the recording.
    #[error("{0}")]
    Instant(String),
    /// There is no such recording.
    #[error("there is no recording number {number}")]
    NoRecording {
        /// Counted from 1.
        number: usize,
    },
}

impl Feature {
    /// Reads it from `recording`, in which `instants` were found.
    ///
    /// # Errors
    /// [`Missing`] with the reason.
    pub fn read(&self, recording: &Recording, instants: &Instants) -> Result<Reckoned, Missing> {
        match &self.reading {
            Reading::Frequency(band) => peak(band, recording, instants).map(|c| Reckoned { value: c.frequency_hz, sd: Some(c.frequency_sd_hz) }),
            Reading::Amplitude(band) => peak(band, recording, instants).map(|c| Reckoned { value: c.amplitude_m, sd: Some(c.amplitude_sd_m) }),
            Reading::Rms(band) => Ok(Reckoned { value: analyse(band, recording, instants)?.rms_in_band_m(band.band_hz.0, band.band_hz.1), sd: None }),
            Reading::MeanDeflection(window) => mean(&cut(Channel::Deflection, window, recording, instants)?),
            Reading::ReleaseAfterReversal(reversal) => {
                let time_s = |anchor| instants.time_s(anchor, *reversal).map_err(Missing::Instant);
                Ok(Reckoned { value: time_s(Anchor::Release)? - time_s(Anchor::Reversal)?, sd: None })
            }
        }
    }
}

/// Every feature of a set of recordings, in order.
#[must_use]
pub fn read_all(features: &[Feature], recordings: &[Recording]) -> Vec<Result<Reckoned, Missing>> {
    let instants: Vec<Instants> = recordings.iter().map(Instants::find).collect();
    let read = |feature: &Feature| {
        let seen = recordings.get(feature.recording).zip(instants.get(feature.recording));
        let (recording, instants) = seen.ok_or(Missing::NoRecording { number: feature.recording + 1 })?;
        feature.read(recording, instants)
    };
    features.iter().map(read).collect()
}

/// The features of a model's recordings.
pub struct Seen<'a> {
    /// The model.
    pub model: &'a dyn Model,
    /// What is read from its recordings.
    pub features: &'a [Feature],
}

impl Predict for Seen<'_> {
    fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        let recordings = self.model.observe(values)?;
        let observed = |read: Result<Reckoned, Missing>| read.map_or_else(|missing| Observed::Missing(missing.to_string()), |read| Observed::Value(read.value));
        Ok(read_all(self.features, &recordings).into_iter().map(observed).collect())
    }
}

fn cut(channel: Channel, window: &Window, recording: &Recording, instants: &Instants) -> Result<Vec<Option<f64>>, Missing> {
    let frames = window.resolve(recording, instants)?;
    Ok(channel.samples(recording).get(frames).map_or_else(Vec::new, <[_]>::to_vec))
}

fn analyse(band: &Band, recording: &Recording, instants: &Instants) -> Result<spectrum::Spectrum, Missing> {
    let samples = cut(band.channel, &band.window, recording, instants)?;
    let settings = Settings { detrend: Some(band.detrend), band_hz: Some(band.band_hz), ..Settings::default() };
    Ok(spectrum::analyse(&samples, recording.grid().frame_rate_hz, &settings)?)
}

fn peak(band: &Band, recording: &Recording, instants: &Instants) -> Result<spectrum::Component, Missing> {
    let (low, high) = band.band_hz;
    analyse(band, recording, instants)?.component_in_band(low, high).cloned().ok_or(Missing::NoPeak { low, high })
}

fn mean(samples: &[Option<f64>]) -> Result<Reckoned, Missing> {
    let present: Vec<f64> = samples.iter().flatten().copied().collect();
    if present.is_empty() {
        return Err(Missing::NoFrames);
    }
    Ok(Reckoned { value: present.iter().sum::<f64>() / present.len() as f64, sd: None })
}
