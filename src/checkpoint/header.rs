//! The first line of a journal.

use super::error::CheckpointError;
use super::read::{split_lines, strip_byte_order_mark};
use super::record::CheckpointRecord;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Version of the layout of journals.
pub(super) const LAYOUT: u32 = 3;

/// What a journal is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckpointKind {
    /// Evaluations of a fit.
    Fit,
    /// Iterates of a fit to traces.
    Trace,
    /// Points of a study.
    Sweep,
}

impl CheckpointKind {
    /// What one of its records is called.
    pub(crate) fn record(self) -> &'static str {
        match self {
            Self::Fit => "evaluation",
            Self::Trace => "iterate",
            Self::Sweep => "point",
        }
    }

    /// The file that says what is computed.
    pub(crate) fn input(self) -> &'static str {
        match self {
            Self::Fit | Self::Trace => "job",
            Self::Sweep => "study",
        }
    }
}

impl fmt::Display for CheckpointKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fit => "fit",
            Self::Trace => "trace fit",
            Self::Sweep => "sweep",
        })
    }
}

/// First line of a journal; `B` is what a journal of its kind says besides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckpointHeader<B> {
    /// What it is of.
    pub journal: CheckpointKind,
    /// Layout.
    pub layout: u32,
    /// Fingerprint of problem, data and program, from [`super::checksum`].
    pub fingerprint: String,
    /// Version of the program.
    pub version: String,
    /// What the lines need to be understood.
    pub body: B,
}

impl<B> CheckpointHeader<B> {
    /// Refuses the header of another problem, data or program than `expected` is of.
    ///
    /// # Errors
    /// [`CheckpointError::OtherVersion`], [`CheckpointError::OtherProblem`], or [`CheckpointError::Header`] when it
    /// was edited.
    pub(crate) fn check_matches<R: CheckpointRecord<Body = B>>(
        &self,
        file: &str,
        expected: &Self,
    ) -> Result<(), CheckpointError> {
        let name = file.to_owned();
        if self.version != expected.version {
            let (found, expected) = (self.version.clone(), expected.version.clone());
            return Err(CheckpointError::OtherVersion { file: name, found, expected });
        }
        if self.fingerprint != expected.fingerprint {
            let (found, expected) = (self.fingerprint.clone(), expected.fingerprint.clone());
            return Err(CheckpointError::OtherProblem { file: name, kind: R::KIND, found, expected });
        }
        match R::problem_difference(&self.body, &expected.body) {
            Some(problem) => Err(CheckpointError::Header { file: name, problem }),
            None => Ok(()),
        }
    }
}

/// What every layout of a header has.
#[derive(Debug, Deserialize)]
pub(super) struct HeaderPrefix {
    pub journal: CheckpointKind,
    pub layout: u32,
}

/// What a file is a journal of, by its first line; `None` where it has no whole line or is no journal.
#[must_use]
pub fn detect_kind(bytes: &[u8]) -> Option<CheckpointKind> {
    let first = split_lines(bytes).next().filter(|line| line.ended)?;
    let start: HeaderPrefix = serde_json::from_slice(strip_byte_order_mark(first.bytes)).ok()?;
    Some(start.journal)
}

/// Whether a file holds a whole line.
#[must_use]
pub fn has_whole_line(bytes: &[u8]) -> bool {
    split_lines(bytes).next().is_some_and(|line| line.ended)
}
