//! Why there is no value, in one word: the reasons that tables, journals and legends name.

use crate::simulate::Status;
use serde::{Deserialize, Serialize};

/// Why there is no value: the run failed, or it does not show the feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // `meaning` says what each is
pub enum Reason {
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
const REASONS: [(Reason, &str, &str); 22] = [
    (Reason::ContactLost, "contact-lost", "contact lost"),
    (Reason::Jammed, "jammed", "jammed (Painlev\u{e9})"),
    (Reason::Indeterminate, "indeterminate", "indeterminate"),
    (Reason::Chattering, "chattering", "chattering"),
    (Reason::Diverged, "diverged", "diverged"),
    (Reason::WorkLimit, "work-limit", "work limit reached"),
    (Reason::Interrupted, "interrupted", "interrupted"),
    (Reason::NoStart, "no-start", "no steady slide to start from"),
    (Reason::Panicked, "panicked", "program failed"),
    (Reason::NoComponent, "no-component", "no component in the band"),
    (Reason::NoSpectrum, "no-spectrum", "no spectrum of the window"),
    (Reason::NoDecay, "no-decay", "the component does not decay"),
    (Reason::Faded, "faded", "decayed into the noise"),
    (Reason::FewCycles, "few-cycles", "too few cycles in the window"),
    (Reason::SegmentLength, "segment-length", "the segment does not fit the window"),
    (Reason::NoWindow, "no-window", "no such window in the run"),
    (Reason::NoFrames, "no-frames", "not tracked in the window"),
    (Reason::NoSpeed, "no-speed", "the head does not have the speed"),
    (Reason::NoRecording, "no-recording", "no such recording"),
    (Reason::NoRun, "no-run", "no simulated run"),
    (Reason::Never, "never", "does not happen"),
    (Reason::NotFinite, "not-finite", "not a finite number"),
];

impl Reason {
    /// Why a run has ended before its stop time; `None` if it has not.
    #[must_use]
    pub fn of(status: Status) -> Option<Self> {
        match status {
            Status::Completed => None,
            Status::ContactLost => Some(Self::ContactLost),
            Status::Jammed => Some(Self::Jammed),
            Status::Indeterminate => Some(Self::Indeterminate),
            Status::Chattering => Some(Self::Chattering),
            Status::Diverged => Some(Self::Diverged),
            Status::WorkLimit => Some(Self::WorkLimit),
            Status::Interrupted => Some(Self::Interrupted),
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
            Status::ContactLost,
            Status::Jammed,
            Status::Indeterminate,
            Status::Chattering,
            Status::Diverged,
            Status::WorkLimit,
            Status::Interrupted,
        ];
        assert!(ends.into_iter().all(|status| Reason::of(status).map(Reason::name) == Some(status.name())));
    }
}
