//! Why there is no value, in one word: the reasons that tables, journals and legends name.

use crate::simulate::RunStatus;
use serde::{Deserialize, Serialize};

/// Why there is no value: the run failed, or it does not show the feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // `meaning` says what each is
pub enum MissingReason {
    ContactLost,
    Jammed,
    Indeterminate,
    Chattering,
    Diverged,
    WorkLimit,
    Interrupted,
    NoStart,
    Panicked,
    NoComponent,
    NoSpectrum,
    NoDecay,
    Faded,
    FewCycles,
    SegmentLength,
    NoWindow,
    NoFrames,
    NoSpeed,
    NoRecording,
    NoRun,
    Never,
    NotFinite,
}

/// Every reason with its name in files and its meaning in a legend.
const REASONS: [(MissingReason, &str, &str); 22] = [
    (MissingReason::ContactLost, "contact-lost", "contact lost"),
    (MissingReason::Jammed, "jammed", "jammed (Painlev\u{e9})"),
    (MissingReason::Indeterminate, "indeterminate", "indeterminate"),
    (MissingReason::Chattering, "chattering", "chattering"),
    (MissingReason::Diverged, "diverged", "diverged"),
    (MissingReason::WorkLimit, "work-limit", "work limit reached"),
    (MissingReason::Interrupted, "interrupted", "interrupted"),
    (MissingReason::NoStart, "no-start", "no steady slide to start from"),
    (MissingReason::Panicked, "panicked", "program failed"),
    (MissingReason::NoComponent, "no-component", "no component in the band"),
    (MissingReason::NoSpectrum, "no-spectrum", "no spectrum of the window"),
    (MissingReason::NoDecay, "no-decay", "the component does not decay"),
    (MissingReason::Faded, "faded", "decayed into the noise"),
    (MissingReason::FewCycles, "few-cycles", "too few cycles in the window"),
    (MissingReason::SegmentLength, "segment-length", "the segment does not fit the window"),
    (MissingReason::NoWindow, "no-window", "no such window in the run"),
    (MissingReason::NoFrames, "no-frames", "not tracked in the window"),
    (MissingReason::NoSpeed, "no-speed", "the head does not have the speed"),
    (MissingReason::NoRecording, "no-recording", "no such recording"),
    (MissingReason::NoRun, "no-run", "no simulated run"),
    (MissingReason::Never, "never", "does not happen"),
    (MissingReason::NotFinite, "not-finite", "not a finite number"),
];

impl MissingReason {
    /// Why a run has ended before its stop time; `None` if it has not.
    #[must_use]
    pub fn from_status(status: RunStatus) -> Option<Self> {
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

    /// Every reason, in the order of legends.
    pub fn all() -> impl Iterator<Item = Self> {
        REASONS.into_iter().map(|(reason, ..)| reason)
    }

    /// The name used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        REASONS[self as usize].1
    }

    /// The same in words.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        REASONS[self as usize].2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_reasons_and_names_them_as_files_do() {
        for (index, (reason, name, _)) in REASONS.into_iter().enumerate() {
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
