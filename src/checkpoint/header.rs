//! The first line of a journal.

use super::error::CheckpointError;
use super::read::{split_lines, strip_byte_order_mark};
use super::record::CheckpointRecord;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Version of the layout of journals.
pub(super) const LAYOUT: u32 = 4;

/// Kind of computation that a journal records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CheckpointKind {
    /// Evaluations of a fit.
    Fit,
    /// Points of a study.
    Sweep,
    /// Evaluations of a study of stability.
    Stability,
}

impl CheckpointKind {
    /// Words for messages: the name of the computation, of one of its records, and of its input file.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Fit => ["fit", "evaluation", "job"],
            Self::Sweep => ["sweep", "point", "study"],
            Self::Stability => ["stability study", "evaluation", "range"],
        }
    }

    /// Word for a record of a journal of this kind, such as `point`.
    pub(crate) fn record(self) -> &'static str {
        self.words()[1]
    }

    /// Word for the input file of a computation of this kind, such as `study`.
    pub(crate) fn input(self) -> &'static str {
        self.words()[2]
    }
}

impl fmt::Display for CheckpointKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words()[0])
    }
}

/// First line of a journal; `B` is the type of the part that differs between the kinds of journals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckpointHeader<B> {
    /// Kind of the computation.
    pub journal: CheckpointKind,
    /// Version of the layout of the journal.
    pub layout: u32,
    /// Fingerprint of the problem, its data and the program: SHA-256 in hexadecimal.
    pub fingerprint: String,
    /// Version of the program.
    pub version: String,
    /// Data that a reader needs to interpret the records.
    pub body: B,
}

impl<B> CheckpointHeader<B> {
    /// Checks that the header belongs to the same problem, data and program as `expected`.
    ///
    /// # Errors
    /// [`CheckpointError::OtherVersion`], [`CheckpointError::OtherProblem`], or [`CheckpointError::Header`]
    /// for a header that was edited.
    pub(crate) fn check_matches<R: CheckpointRecord<Body = B>>(
        &self,
        file: &str,
        expected: &Self,
    ) -> Result<(), CheckpointError> {
        let file = file.to_owned();
        if self.version != expected.version {
            let (found, expected) = (self.version.clone(), expected.version.clone());
            return Err(CheckpointError::OtherVersion { file, found, expected });
        }
        if self.fingerprint != expected.fingerprint {
            let (found, expected) = (self.fingerprint.clone(), expected.fingerprint.clone());
            return Err(CheckpointError::OtherProblem { file, kind: R::KIND, found, expected });
        }
        let difference = R::problem_difference(&self.body, &expected.body);
        difference.map_or(Ok(()), |problem| Err(CheckpointError::Header { file, problem }))
    }
}

/// Fields that a header has in every version of the layout.
#[derive(Debug, Deserialize)]
pub(super) struct HeaderPrefix {
    pub journal: CheckpointKind,
    pub layout: u32,
}

/// Kind of a journal, from its first line; `None` if the file has no complete line or is not a journal.
#[must_use]
pub fn detect_kind(bytes: &[u8]) -> Option<CheckpointKind> {
    let first = split_lines(bytes).next().filter(|line| line.ended)?;
    let start: HeaderPrefix = serde_json::from_slice(strip_byte_order_mark(first.bytes)).ok()?;
    Some(start.journal)
}

/// Whether a file contains a complete line.
#[must_use]
pub fn has_whole_line(bytes: &[u8]) -> bool {
    split_lines(bytes).next().is_some_and(|line| line.ended)
}
