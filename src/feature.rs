//! Features: numbers read from a recording, by the same code whether a camera or the model made it. Every
//! kind: `docs/fits.md`.
//!
//! A window's instants are found in each recording by itself, so model and measurement need not share a
//! clock.

mod cycle;
mod damping;
mod deflection;
mod missing;
mod reader;
mod reason;
mod spectral;

pub use cycle::HOLDS;
pub use damping::{LEAST_CYCLES, LEAST_LEFT};
pub use deflection::{FEWEST_AT_SPEED, SPEED_BLOCK_S};
pub use missing::Missing;
pub use reader::Reader;
pub use reason::Reason;
pub use spectral::{ASSIGN_DB, ASSIGN_WIDTH};

use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants, Window};
use crate::spectrum::Detrend;
use serde::Serialize;

/// Least relative standard deviation of a measured frequency. Reading a peak of 0.15 s leaves 0.03 Hz at 78
/// Hz (4e-4) without any noise, and the model is read through another window of the same length.
pub const FREQUENCY_SD_FLOOR: f64 = 1e-3;
/// Relative half width of the speeds that count as one, unless a job says otherwise: several cycles of
/// chatter pass within it, and the friction hardly changes.
pub const WIDTH_RELATIVE: f64 = 0.15;
/// Scale of a time that may be zero or negative, s: a tenth of the stick after a reversal of half a second, a
/// few hundred frames.
pub const TIME_SCALE_S: f64 = 0.05;

/// A band of the spectrum of a window of a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Reading {
    /// Frequency of a component in a band, Hz: the largest, or the one that is assigned to a target.
    Frequency(Band),
    /// Amplitude of the largest component in a band, m.
    Amplitude(Band),
    /// Root mean square of a band, m.
    Rms(Band),
    /// Level of one band of a log-spectrum: root mean square of a band and of a floor, m.
    BandLevel {
        /// The band.
        band: Band,
        /// Root mean square that is added in quadrature, m, so that noise is not fitted.
        floor_m: f64,
    },
    /// Damping ratio of the ring-down of the largest component in a band.
    DampingRatio(Band),
    /// Lowest or highest frequency over which a drifting component runs, Hz.
    CycleFrequency {
        /// Where it runs.
        band: Band,
        /// Length of the segments in which it is looked at, s.
        segment_s: f64,
        /// Which end of its range.
        end: End,
    },
    /// Mean of the deflection `tip_x - head_x` over a window, m.
    MeanDeflection(Window),
    /// Mean of the deflection over the frames of a window in which the head has a speed, m.
    DeflectionAtSpeed {
        /// Which frames.
        window: Window,
        /// The speed, m/s, above 0, in whatever direction.
        speed_m_per_s: f64,
        /// Speeds within this share of it count.
        width_relative: f64,
    },
    /// Time between two instants of a reversal, s.
    Interval {
        /// Between which.
        interval: Interval,
        /// Of which reversal, counted from 1.
        reversal: usize,
    },
}

/// An end of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum End {
    /// The lowest value.
    Low,
    /// The highest value.
    High,
}

/// Two instants of a reversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Interval {
    /// From the head's turn to the tip's release.
    ReleaseAfterReversal,
    /// From the tip's stop to its release.
    StickDuration,
    /// From the head's turn to the start of the flip; may be negative.
    FlipAfterReversal,
    /// From the start of the flip to its end.
    FlipDuration,
}

/// How a value is held against another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measure {
    /// By the logarithm of their ratio.
    Log,
    /// By their difference, because zero and a change of sign are nothing special.
    Linear {
        /// Size of a large difference, in the reading's unit.
        scale: f64,
    },
}

impl Reading {
    /// Its kind in a job; a component's is `frequency`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Frequency(_) => "frequency",
            Self::Amplitude(_) => "amplitude",
            Self::Rms(_) => "rms",
            Self::BandLevel { .. } => "log-spectrum",
            Self::DampingRatio(_) => "damping-ratio",
            Self::CycleFrequency { end: End::Low, .. } => "cycle-frequency-low",
            Self::CycleFrequency { end: End::High, .. } => "cycle-frequency-high",
            Self::MeanDeflection(_) => "mean-deflection",
            Self::DeflectionAtSpeed { .. } => "deflection-at-speed",
            Self::Interval { interval, .. } => interval.kind(),
        }
    }

    /// Unit of its value; `1` for a ratio.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Frequency(_) | Self::CycleFrequency { .. } => "Hz",
            Self::Amplitude(_)
            | Self::Rms(_)
            | Self::BandLevel { .. }
            | Self::MeanDeflection(_)
            | Self::DeflectionAtSpeed { .. } => "m",
            Self::DampingRatio(_) => "1",
            Self::Interval { .. } => "s",
        }
    }

    /// How two of its values are held against each other.
    #[must_use]
    pub fn measure(&self) -> Measure {
        match self {
            Self::Interval { interval: Interval::FlipAfterReversal, .. } => {
                Measure::Linear { scale: TIME_SCALE_S }
            }
            _ => Measure::Log,
        }
    }
}

impl Interval {
    /// Its kind in a job.
    #[must_use]
    pub fn kind(self) -> &'static str {
        match self {
            Self::ReleaseAfterReversal => "release-after-reversal",
            Self::StickDuration => "stick-duration",
            Self::FlipAfterReversal => "flip-after-reversal",
            Self::FlipDuration => "flip-duration",
        }
    }

    /// Its length at the `reversal`-th turn of the head, s; or what was found instead.
    fn length_s(self, reversal: usize, instants: &Instants) -> Result<f64, String> {
        let at = |anchor| instants.time_s(anchor, reversal);
        match self {
            Self::ReleaseAfterReversal => Ok(at(Anchor::Release)? - at(Anchor::Reversal)?),
            Self::StickDuration => Ok(at(Anchor::Release)? - at(Anchor::Hold)?),
            Self::FlipAfterReversal => Ok(at(Anchor::Flip)? - at(Anchor::Reversal)?),
            Self::FlipDuration => {
                let start_s = at(Anchor::Flip)?;
                let found = reversal.checked_sub(1).and_then(|index| instants.reversals.get(index));
                Ok(found.and_then(|r| r.flip).map_or(start_s, |flip| flip.end_s) - start_s)
            }
        }
    }
}

/// A reading with its name and the condition that it belongs to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Feature {
    /// Name in the job.
    pub name: String,
    /// What is read.
    pub reading: Reading,
    /// From which condition of the job, counted from 0.
    pub condition: usize,
}

/// A value read from a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The value, in the reading's unit.
    pub value: f64,
    /// Its standard deviation where the reading itself gives one.
    pub sd: Option<f64>,
    /// How far the component is below the strongest of its band, dB; 0 for the strongest, and where there is
    /// nothing to choose from.
    pub below_db: f64,
    /// The component that would have been next, where there is a choice.
    pub runner_up: Option<RunnerUp>,
}

/// A component that was not chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunnerUp {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// How far it is below the strongest of the band, dB.
    pub below_db: f64,
}

impl Value {
    /// A value among which there is no choice.
    fn of(value: f64, sd: Option<f64>) -> Self {
        Self { value, sd, below_db: 0.0, runner_up: None }
    }
}

impl Feature {
    /// Reads it from `recording`, in which `instants` were found.
    ///
    /// # Errors
    /// [`Missing`] with the reason.
    pub fn read(&self, recording: &Recording, instants: &Instants) -> Result<Value, Missing> {
        self.read_assigned(None, &Reader::new(recording, instants))
    }

    /// Reads it from a recording that other features are read from too. Of a frequency with a `target`, Hz,
    /// it is the component of the band that [`ASSIGN_WIDTH`] and [`ASSIGN_DB`] assign to it; without one, the
    /// strongest.
    ///
    /// # Errors
    /// [`Missing`] with the reason.
    pub fn read_assigned(&self, target: Option<f64>, reader: &Reader) -> Result<Value, Missing> {
        match &self.reading {
            Reading::Frequency(band) => spectral::frequency(band, target, reader),
            Reading::Amplitude(band) => spectral::amplitude(band, reader),
            Reading::Rms(band) => spectral::rms(band, reader),
            Reading::BandLevel { band, floor_m } => spectral::band_level(band, *floor_m, reader),
            Reading::DampingRatio(band) => damping::ratio(band, reader),
            Reading::CycleFrequency { band, segment_s, end } => {
                cycle::frequency(band, *segment_s, *end, reader)
            }
            Reading::MeanDeflection(window) => deflection::mean(window, reader),
            Reading::DeflectionAtSpeed { window, speed_m_per_s, width_relative } => {
                deflection::at_speed(window, *speed_m_per_s, *width_relative, reader)
            }
            Reading::Interval { interval, reversal } => {
                let length_s = interval.length_s(*reversal, reader.instants()).map_err(Missing::Instant)?;
                Ok(Value::of(length_s, None))
            }
        }
    }
}

/// Every feature of a set of recordings, one a condition, in order.
#[must_use]
pub fn read_all(features: &[Feature], recordings: &[Recording]) -> Vec<Result<Value, Missing>> {
    read_all_assigned(features, &[], &recordings.iter().collect::<Vec<_>>())
}

/// The same of a model, whose components are assigned to targets: one a feature, in its unit; none for what
/// is beyond the end.
#[must_use]
pub fn read_all_assigned(
    features: &[Feature],
    targets: &[f64],
    recordings: &[&Recording],
) -> Vec<Result<Value, Missing>> {
    let instants: Vec<Instants> = recordings.iter().map(|recording| Instants::find(recording)).collect();
    let readers: Vec<Reader> = recordings
        .iter()
        .zip(&instants)
        .map(|(recording, instants)| Reader::new(recording, instants))
        .collect();
    let read = |(at, feature): (usize, &Feature)| {
        let reader =
            readers.get(feature.condition).ok_or(Missing::NoRecording { number: feature.condition + 1 })?;
        feature.read_assigned(targets.get(at).copied(), reader)
    };
    features.iter().enumerate().map(read).collect()
}
