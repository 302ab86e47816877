//! Reasons why a recording or a run does not give a value.

use crate::recording::channel::{InstantNotFound, WindowError};
use crate::recording::cycles::NoCycle;
use crate::simulate::RunStatus;
use serde::{Deserialize, Serialize};
use short_spectra::SpectrumError;

/// Minimum number of cycles of a decaying component in each half of a window. With fewer cycles, the main
/// lobe of the Hann window overlaps its mirror image at negative frequencies.
pub(crate) const LEAST_CYCLES: f64 = 3.0;
/// Minimum number of tracked frames in which the head has the requested speed.
pub(crate) const FEWEST_AT_SPEED: usize = 8;

/// Reason why a recording or a run does not give a value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MissingValue {
    /// The window is not in the recording.
    #[error("{0}")]
    Window(#[from] WindowError),
    /// No spectrum can be computed from the window.
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
    /// The largest component of the band is below the requested amplitude.
    #[error(
        "the largest component has {amplitude_m:.3e} m at {frequency_hz:.3} Hz, expected at least \
         {least_m:e} m"
    )]
    TooSmall {
        /// Amplitude of the component, m.
        amplitude_m: f64,
        /// Frequency of the component, Hz.
        frequency_hz: f64,
        /// Smallest amplitude that the feature accepts, m.
        least_m: f64,
    },
    /// The component does not decay.
    #[error(
        "the component at {frequency_hz:.1} Hz does not decay: its amplitude is {first_m:.2e} m in the \
         first half of the window and {second_m:.2e} m in the second"
    )]
    NoDecay {
        /// Frequency of the component, Hz.
        frequency_hz: f64,
        /// Amplitude of the component in the first half of the window, m.
        first_m: f64,
        /// Amplitude of the component in the second half of the window, m.
        second_m: f64,
    },
    /// The component decays to the level of the noise.
    #[error(
        "the component at {frequency_hz:.1} Hz has decayed to {second_m:.2e} m, into the noise, in the \
         second half of the window; shorten it"
    )]
    Faded {
        /// Frequency of the component, Hz.
        frequency_hz: f64,
        /// Amplitude of the component in the second half of the window, m.
        second_m: f64,
    },
    /// The window contains too few cycles to measure a decay.
    #[error(
        "found {cycles:.1} cycles of {frequency_hz:.1} Hz in each half of the window, expected at \
         least {}; widen it",
        LEAST_CYCLES
    )]
    FewCycles {
        /// Frequency of the component, Hz.
        frequency_hz: f64,
        /// Number of cycles of the component in half of the window.
        cycles: f64,
    },
    /// A segment is longer than the window, or has too few frames.
    #[error(
        "a segment of {segment_s} s has {frames} frames, expected {} to the {window} of the window",
        short_spectra::MIN_SAMPLES
    )]
    Segment {
        /// Length of the segment, s.
        segment_s: f64,
        /// Number of frames in the segment.
        frames: usize,
        /// Number of frames in the window.
        window: usize,
    },
    /// The tip has no stick-slip cycle in the window.
    #[error("no stick-slip cycle: {0}")]
    NoCycle(#[from] NoCycle),
    /// The channel was not tracked in the window.
    #[error("no frame of the window has both points tracked")]
    NoFrames,
    /// The head does not have the requested speed in the window.
    #[error(
        "found {found} tracked frames with the head at {low_m_per_s:.4} to {high_m_per_s:.4} \
         m/s, expected at least {}; the window shows {least_m_per_s:.4} to {most_m_per_s:.4} m/s",
        FEWEST_AT_SPEED
    )]
    Speed {
        /// Number of frames with the requested speed.
        found: usize,
        /// Lower limit of the requested speed, m/s.
        low_m_per_s: f64,
        /// Upper limit of the requested speed, m/s.
        high_m_per_s: f64,
        /// Lowest speed in the window, m/s.
        least_m_per_s: f64,
        /// Highest speed in the window, m/s.
        most_m_per_s: f64,
    },
    /// The head is tracked in too few frames for its speed to be measured.
    #[error("the head is tracked in too few frames of the window to have a speed")]
    NoSpeed,
    /// An instant was not found in the recording.
    #[error(transparent)]
    Instant(InstantNotFound),
    /// The feature belongs to a recording that is not given.
    #[error("there is no recording number {number}")]
    NoRecording {
        /// Number of the recording, counted from 1.
        number: usize,
    },
    /// The value exists only for a simulated run.
    #[error("only a simulated run shows it, not a recording")]
    NoRun,
    /// The run ended early.
    #[error("the run ended as {} at {stopped_at_s} s", .status.name())]
    Ended {
        /// Status with which the run ended.
        status: RunStatus,
        /// Time at which the run ended, s.
        stopped_at_s: f64,
    },
    /// The event does not occur in the run.
    #[error("it does not happen in the run")]
    Never,
}

impl MissingValue {
    /// The reason without its numbers, as named in tables and legends.
    #[must_use]
    pub fn reason(&self) -> MissingReason {
        match self {
            Self::Window(_) | Self::Instant(_) => MissingReason::NoWindow,
            Self::Spectrum(_) => MissingReason::NoSpectrum,
            Self::NoPeak { .. } | Self::TooSmall { .. } => MissingReason::NoComponent,
            Self::NoDecay { .. } => MissingReason::NoDecay,
            Self::Faded { .. } => MissingReason::Faded,
            Self::FewCycles { .. } => MissingReason::FewCycles,
            Self::Segment { .. } => MissingReason::SegmentLength,
            Self::NoCycle(_) => MissingReason::NoCycle,
            Self::NoFrames => MissingReason::NoFrames,
            Self::Speed { .. } | Self::NoSpeed => MissingReason::NoSpeed,
            Self::NoRecording { .. } => MissingReason::NoRecording,
            Self::NoRun => MissingReason::NoRun,
            Self::Ended { status, .. } => MissingReason::from_status(*status).unwrap_or(MissingReason::Never),
            Self::Never => MissingReason::Never,
        }
    }
}

macro_rules! reasons {
    ($($reason:ident $name:literal $meaning:literal;)*) => {
        /// Reason why there is no value: the run failed, or it does not show the feature.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[allow(missing_docs)] // `meaning` explains each
        pub enum MissingReason {
            $(#[serde(rename = $name)] $reason),*
        }

        /// All reasons, each with its name in files and its meaning in a legend.
        const REASONS: &[(MissingReason, &str, &str)] = &[$((MissingReason::$reason, $name, $meaning)),*];
    };
}

reasons! {
    ContactLost "contact-lost" "contact lost";
    Jammed "jammed" "jammed (Painlev\u{e9})";
    Indeterminate "indeterminate" "indeterminate";
    Chattering "chattering" "chattering";
    Diverged "diverged" "diverged";
    WorkLimit "work-limit" "work limit reached";
    Interrupted "interrupted" "interrupted";
    NoStart "no-start" "no steady slide to start from";
    Panicked "panicked" "program failed";
    NoComponent "no-component" "no component in the band";
    NoSpectrum "no-spectrum" "no spectrum of the window";
    NoDecay "no-decay" "the component does not decay";
    Faded "faded" "decayed into the noise";
    FewCycles "few-cycles" "too few cycles in the window";
    SegmentLength "segment-length" "the segment does not fit the window";
    NoCycle "no-cycle" "no stick-slip cycle";
    NoWindow "no-window" "no such window in the run";
    NoFrames "no-frames" "not tracked in the window";
    NoSpeed "no-speed" "the head does not have the speed";
    NoRecording "no-recording" "no such recording";
    NoRun "no-run" "no simulated run";
    Never "never" "does not happen";
    NotFinite "not-finite" "not a finite number";
}

impl MissingReason {
    /// The reason why a run ended before its stop time; `None` for a complete run.
    pub(crate) fn from_status(status: RunStatus) -> Option<Self> {
        match status {
            RunStatus::Completed => None,
            RunStatus::ContactLost => Some(Self::ContactLost),
            RunStatus::Jammed => Some(Self::Jammed),
            RunStatus::Indeterminate => Some(Self::Indeterminate),
            RunStatus::Chattering => Some(Self::Chattering),
            RunStatus::Diverged => Some(Self::Diverged),
            RunStatus::WorkLimit => Some(Self::WorkLimit),
            RunStatus::Interrupted => Some(Self::Interrupted),
        }
    }

    /// Every reason, in the order in which legends list the reasons.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        REASONS.iter().map(|(reason, ..)| *reason)
    }

    /// The name used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        REASONS[self as usize].1
    }

    /// Text of the reason in a legend.
    pub(crate) fn meaning(self) -> &'static str {
        REASONS[self as usize].2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_reasons_and_names_them_as_files_do() {
        for (index, (reason, name, _)) in REASONS.iter().copied().enumerate() {
            assert_eq!((reason as usize, reason.name()), (index, name));
            assert_eq!(serde_json::to_string(&reason).unwrap(), format!("\"{name}\""));
        }
        let ends = [
            RunStatus::ContactLost,
            RunStatus::Jammed,
            RunStatus::Indeterminate,
            RunStatus::Chattering,
            RunStatus::Diverged,
            RunStatus::WorkLimit,
            RunStatus::Interrupted,
        ];
        assert!(
            ends.into_iter()
                .all(|status| MissingReason::from_status(status).map(MissingReason::name)
                    == Some(status.name()))
        );
    }
}
