//! What a map shows: the quantities that are read from a run, their units, and what each takes.

use crate::recording::channel::{Channel, Window};
use crate::spectrum::Detrend;
use serde::{Deserialize, Serialize};

/// A kind of quantity, in the word of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Frequency of the largest component in a band.
    Frequency,
    /// Its amplitude.
    Amplitude,
    /// Root mean square of a band.
    Rms,
    /// Mean of `tip_x - head_x` over a window.
    MeanDeflection,
    /// Time from the head's turn to the tip's release.
    ReleaseAfterReversal,
    /// Share of a window in which the tip sticks.
    StickFraction,
    /// Longest uninterrupted stick in a window.
    StickDuration,
    /// Changes of mode in a window.
    Transitions,
    /// When the normal force first reaches zero.
    ContactLoss,
    /// Least normal force in contact.
    LeastNormalForce,
    /// When the Painlevé condition first fails.
    Jam,
    /// Least Painlevé indicator in slip.
    LeastPainleveIndicator,
}

/// A unit in files and in figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// In files; `1` for a plain number.
    pub name: &'static str,
    /// What it adds to the name of a column.
    pub suffix: &'static str,
    /// In figures; empty for a plain number.
    pub shown: &'static str,
    /// What a value is multiplied by in figures.
    pub factor: f64,
}

const HERTZ: Unit = Unit { name: "Hz", suffix: "_hz", shown: "Hz", factor: 1.0 };
const MICROMETRES: Unit = Unit { name: "m", suffix: "_m", shown: "\u{b5}m", factor: 1e6 };
const MILLIMETRES: Unit = Unit { name: "m", suffix: "_m", shown: "mm", factor: 1e3 };
const MILLISECONDS: Unit = Unit { name: "s", suffix: "_s", shown: "ms", factor: 1e3 };
const SECONDS: Unit = Unit { name: "s", suffix: "_s", shown: "s", factor: 1.0 };
const NEWTONS: Unit = Unit { name: "N", suffix: "_n", shown: "N", factor: 1.0 };
const PLAIN: Unit = Unit { name: "1", suffix: "", shown: "", factor: 1.0 };

impl Kind {
    /// Unit of its values.
    #[must_use]
    pub fn unit(self) -> Unit {
        match self {
            Self::Frequency => HERTZ,
            Self::Amplitude | Self::Rms => MICROMETRES,
            Self::MeanDeflection => MILLIMETRES,
            Self::ReleaseAfterReversal | Self::StickDuration => MILLISECONDS,
            Self::ContactLoss | Self::Jam => SECONDS,
            Self::LeastNormalForce => NEWTONS,
            Self::StickFraction | Self::Transitions | Self::LeastPainleveIndicator => PLAIN,
        }
    }
}

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
    /// Least amplitude of a component, m: a trace without noise shows traces of the trend and of a long dead
    /// ring-down, which no camera sees.
    pub least_amplitude_m: f64,
}

/// A quantity with all that it takes to read it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)] // `Kind` says what each is
pub enum Quantity {
    Frequency(Band),
    Amplitude(Band),
    Rms(Band),
    MeanDeflection(Window),
    /// At the given reversal, counted from 1.
    ReleaseAfterReversal(usize),
    StickFraction(Window),
    StickDuration(Window),
    Transitions(Window),
    ContactLoss,
    LeastNormalForce,
    Jam,
    LeastPainleveIndicator,
}

impl Quantity {
    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Self::Frequency(_) => Kind::Frequency,
            Self::Amplitude(_) => Kind::Amplitude,
            Self::Rms(_) => Kind::Rms,
            Self::MeanDeflection(_) => Kind::MeanDeflection,
            Self::ReleaseAfterReversal(_) => Kind::ReleaseAfterReversal,
            Self::StickFraction(_) => Kind::StickFraction,
            Self::StickDuration(_) => Kind::StickDuration,
            Self::Transitions(_) => Kind::Transitions,
            Self::ContactLoss => Kind::ContactLoss,
            Self::LeastNormalForce => Kind::LeastNormalForce,
            Self::Jam => Kind::Jam,
            Self::LeastPainleveIndicator => Kind::LeastPainleveIndicator,
        }
    }

    /// The window that it is read from; `None` where it has none of its own.
    #[must_use]
    pub fn window(&self) -> Option<&Window> {
        match self {
            Self::Frequency(band) | Self::Amplitude(band) | Self::Rms(band) => Some(&band.window),
            Self::MeanDeflection(window)
            | Self::StickFraction(window)
            | Self::StickDuration(window)
            | Self::Transitions(window) => Some(window),
            Self::ReleaseAfterReversal(_)
            | Self::ContactLoss
            | Self::LeastNormalForce
            | Self::Jam
            | Self::LeastPainleveIndicator => None,
        }
    }
}
