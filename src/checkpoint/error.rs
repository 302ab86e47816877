//! Errors in journals.

use super::header::{CheckpointKind, LAYOUT};

/// Reason for refusing a journal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// The journal has another version of the layout.
    #[error(
        "{file}: a journal of layout {found}, expected layout {LAYOUT}; move it away and run the {kind} again"
    )]
    Layout {
        /// File as named by the user.
        file: String,
        /// Kind of computation that the journal records.
        kind: CheckpointKind,
        /// Version of the layout in the file.
        found: u32,
    },
    /// The journal records another kind of computation.
    #[error(
        "{file}: the journal of a {found}, expected that of a {expected}; choose the right file or folder"
    )]
    OtherKind {
        /// File as named by the user.
        file: String,
        /// Kind of computation that the journal records.
        found: CheckpointKind,
        /// Expected kind of computation.
        expected: CheckpointKind,
    },
    /// Another version of the program wrote the journal.
    #[error(
        "{file}: written by version {found} of the program, this is version {expected}, and two versions need not agree in the last digit; resume with version {found}, or move the journal away to start over"
    )]
    OtherVersion {
        /// File as named by the user.
        file: String,
        /// Program version in the header of the journal.
        found: String,
        /// Version of this program.
        expected: String,
    },
    /// The journal belongs to another problem.
    #[error(
        "{file}: fingerprint {found}, expected {expected}: the {}, a scene or a recording has changed since it was written; move it away to start over, or undo the change to resume",
        kind.input()
    )]
    OtherProblem {
        /// File as named by the user.
        file: String,
        /// Kind of computation that the journal records.
        kind: CheckpointKind,
        /// Fingerprint in the header of the journal.
        found: String,
        /// Fingerprint of this problem.
        expected: String,
    },
    /// The file cannot be read.
    #[error("{file}: cannot be read: {problem}")]
    Unreadable {
        /// File as named by the user.
        file: String,
        /// Reason why it cannot be read.
        problem: String,
    },
    /// The first line is not a valid header.
    #[error(
        "{file}:1: {problem}; the file was damaged or edited, or is not a journal: restore it, or move it away to start over"
    )]
    Header {
        /// File as named by the user.
        file: String,
        /// What was found and what was expected.
        problem: String,
    },
    /// A line is not a valid record.
    #[error(
        "{file}:{line}: {problem}; the line was damaged or edited: restore the file, or remove this line and all lines after it (each {} in them is then computed again)",
        kind.record()
    )]
    Line {
        /// File as named by the user.
        file: String,
        /// Line number, counted from 1.
        line: usize,
        /// Kind of computation that the journal records.
        kind: CheckpointKind,
        /// What was found and what was expected.
        problem: String,
    },
    /// The outcome in a record differs from the outcome of the same computation made again.
    #[error(
        "{file}:{line}: found {found}, but computed again the {} gives {computed}; the line was edited, or made on a machine that does not calculate alike to the last digit (another processor, system or build): resume where it was written, or move the journal away to start over",
        kind.record()
    )]
    Recomputed {
        /// File as named by the user.
        file: String,
        /// Line number, counted from 1.
        line: usize,
        /// Kind of computation that the journal records.
        kind: CheckpointKind,
        /// Outcome that the line states.
        found: String,
        /// Outcome of the same computation made again.
        computed: String,
    },
    /// Two journals contain different outcomes of the same point.
    #[error(
        "{file}:{line}: {found}, but {other_file}:{other_line} has {expected} at the same point; either was edited, or the machines that wrote them do not calculate alike to the last digit (another processor, system or build): move one of them away"
    )]
    Conflict {
        /// File as named by the user.
        file: String,
        /// Line number of the record in `file`, counted from 1.
        line: usize,
        /// Outcome of the point according to `file`.
        found: String,
        /// The other journal, which was read earlier, as named by the user.
        other_file: String,
        /// Line number of the record in `other_file`, counted from 1.
        other_line: usize,
        /// Outcome of the point according to `other_file`.
        expected: String,
    },
}
