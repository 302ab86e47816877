//! Why a journal is refused.

use super::header::{CheckpointKind, LAYOUT};

/// Why a journal was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// The file has another layout.
    #[error(
        "{file}: a journal of layout {found}, expected layout {LAYOUT}; move it away and run the {kind} again"
    )]
    Layout {
        /// File as named by the user.
        file: String,
        /// Kind of its computation.
        kind: CheckpointKind,
        /// Layout of the file.
        found: u32,
    },
    /// The journal is of another kind of computation.
    #[error(
        "{file}: the journal of a {found}, expected that of a {expected}; choose the right file or folder"
    )]
    OtherKind {
        /// File as named by the user.
        file: String,
        /// Kind of its computation.
        found: CheckpointKind,
        /// Expected kind.
        expected: CheckpointKind,
    },
    /// Another version of the program wrote the journal.
    #[error(
        "{file}: written by version {found} of the program, this is version {expected}, and two versions need not agree in the last digit; resume with version {found}, or move the journal away to start over"
    )]
    OtherVersion {
        /// File as named by the user.
        file: String,
        /// Version in its header.
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
        /// Kind of its computation.
        kind: CheckpointKind,
        /// Fingerprint in its header.
        found: String,
        /// Fingerprint of this problem.
        expected: String,
    },
    /// The file cannot be read.
    #[error("{file}: cannot be read: {problem}")]
    Unreadable {
        /// File as named by the user.
        file: String,
        /// Reason.
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
        "{file}:{line}: {problem}; the line was damaged or edited: restore the file, or remove this line and all behind it (each {} in them is then made again)",
        kind.record()
    )]
    Line {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// Kind of its computation.
        kind: CheckpointKind,
        /// What was found and what was expected.
        problem: String,
    },
    /// A record differs from its recomputation.
    #[error(
        "{file}:{line}: found {found}, but computed again the {} gives {computed}; the line was edited, or made on a machine that does not calculate alike to the last digit (another processor, system or build): resume where it was written, or move the journal away to start over",
        kind.record()
    )]
    Recomputed {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// Kind of its computation.
        kind: CheckpointKind,
        /// Value in the line.
        found: String,
        /// Recomputed value.
        computed: String,
    },
    /// Two journals disagree about one record.
    #[error(
        "{file}:{line}: {found}, but {other_file}:{other_line} has {expected} at the same point; either was edited, or the machines that wrote them do not calculate alike to the last digit (another processor, system or build): move one of them away"
    )]
    Conflict {
        /// File as named by the user.
        file: String,
        /// 1-based line in that file.
        line: usize,
        /// Its value there.
        found: String,
        /// The file that was read before.
        other_file: String,
        /// 1-based line in that file.
        other_line: usize,
        /// Its value there.
        expected: String,
    },
}
