//! Why a point of a study has no value.

use crate::simulate::Status;
use serde::{Deserialize, Serialize};

/// Why there is no value: the run ended early, or it does not show the quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // `meaning` says what each is
pub enum Reason {
    ContactLost,
    Jammed,
    Indeterminate,
    Chattering,
    Diverged,
    NoStart,
    Panicked,
    NoComponent,
    NoWindow,
    Never,
    NotFinite,
}

/// Every reason with its name in files and its meaning in a legend.
const REASONS: [(Reason, &str, &str); 11] = [
    (Reason::ContactLost, "contact-lost", "contact lost"),
    (Reason::Jammed, "jammed", "jammed (Painlev\u{e9})"),
    (Reason::Indeterminate, "indeterminate", "indeterminate"),
    (Reason::Chattering, "chattering", "chattering"),
    (Reason::Diverged, "diverged", "diverged"),
    (Reason::NoStart, "no-start", "no steady slide to start from"),
    (Reason::Panicked, "panicked", "program failed"),
    (Reason::NoComponent, "no-component", "no component in the band"),
    (Reason::NoWindow, "no-window", "no such window in the run"),
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
        }
    }

    /// Every reason, in the order of legends.
    pub fn all() -> impl Iterator<Item = Self> {
        REASONS.into_iter().map(|(reason, ..)| reason)
    }

    /// The name used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// The same in words.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        self.row().2
    }

    fn row(self) -> (Self, &'static str, &'static str) {
        REASONS[self as usize]
    }
}

/// A value that is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// Why, in a word.
    pub reason: Reason,
    /// The same with what was found; empty where the reason says all.
    pub why: String,
}

impl Missing {
    /// A reason that says all.
    #[must_use]
    pub fn plain(reason: Reason) -> Self {
        Self { reason, why: String::new() }
    }

    /// A reason with what was found.
    #[must_use]
    pub fn because(reason: Reason, why: impl ToString) -> Self {
        Self { reason, why: why.to_string() }
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
        ];
        assert!(ends.into_iter().all(|status| Reason::of(status).map(Reason::name) == Some(status.name())));
    }
}
