//! The journal: one line of JSON an evaluation, append-only, enough to resume, extend, merge and audit a fit.
//!
//! The first line is a header with the fingerprint of the fit. Numbers are the shortest decimals that give
//! the same bits back, written as strings, because JSON readers round numbers in the last place and a replay
//! must not.

mod lines;
mod merge;

pub use lines::{entry_line, header_line, read};
pub use merge::{Merged, merge};

use super::objective::Evaluation;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Version of the journal's layout.
pub const JOURNAL_FORMAT: u32 = 1;

/// Where journal lines go; the program writes each to a file and flushes it.
pub trait Sink: Send {
    /// Appends one line, which ends with its newline.
    ///
    /// # Errors
    /// The reason in words; the fit stops.
    fn append(&mut self, line: &str) -> Result<(), String>;
}

/// What decides the outcome of a fit: if all of it is the same, so is the result.
#[derive(Debug, Clone, Copy)]
pub struct Ingredients<'a> {
    /// Text of what the job asks for, its budgets and its seed left out.
    pub job: &'a str,
    /// Text of the scene, with everything that it refers to.
    pub scene: &'a str,
    /// Bytes of every recording, in job order.
    pub data: &'a [&'a [u8]],
    /// Version of the program.
    pub version: &'a str,
}

/// SHA-256 over the ingredients, each preceded by its length, in hexadecimal.
#[must_use]
pub fn fingerprint(of: &Ingredients) -> String {
    let mut hash = Sha256::new();
    let parts = [of.job.as_bytes(), of.scene.as_bytes(), of.version.as_bytes()];
    for part in parts.into_iter().chain(of.data.iter().copied()) {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// First line of a journal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Layout, [`JOURNAL_FORMAT`].
    pub journal: u32,
    /// Fingerprint of problem, data and program.
    pub fingerprint: String,
    /// Version of the program.
    pub version: String,
    /// Seed of the search.
    pub seed: u64,
    /// Names of the free parameters, in the order of the coordinates.
    pub parameters: Vec<String>,
    /// Names of the targets, in the order of the features.
    pub features: Vec<String>,
}

/// What an evaluation was made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Probes of what the features can determine, before the search.
    Gate,
    /// Clouds of points over the whole box.
    Global,
    /// From one of the best points downhill.
    Local,
    /// Differences around the best point.
    Sensitivity,
    /// Along one parameter, the others following.
    Profile,
    /// A twin of the best model fitted again.
    Bootstrap,
}

impl Stage {
    /// The word in files and on a terminal.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Gate => "gate",
            Self::Global => "global",
            Self::Local => "local",
            Self::Sensitivity => "sensitivity",
            Self::Profile => "profile",
            Self::Bootstrap => "bootstrap",
        }
    }
}

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it was made for.
    pub stage: Stage,
    /// Seed of the search that made it, where that is another one than the header's: such an evaluation came
    /// from another journal.
    pub from: Option<u64>,
    /// The evaluation.
    pub evaluation: Evaluation,
}

/// A journal as read.
#[derive(Debug, Clone, PartialEq)]
pub struct Journal {
    /// Its header.
    pub header: Header,
    /// Its evaluations, in file order.
    pub entries: Vec<Entry>,
    /// Length of the part that ends with a complete line, bytes: the file is cut to it before anything is
    /// appended.
    pub intact_bytes: usize,
    /// Whether an incomplete last line was dropped.
    pub torn: bool,
}

/// Why a journal was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// Another version of the program wrote it.
    #[error(
        "{file}: written by version {found} of the program, this is version {expected}, and two versions need not agree in the last digit; resume with version {found}, or move the journal away to start anew"
    )]
    OtherVersion {
        /// File as named by the user.
        file: String,
        /// Version in its header.
        found: String,
        /// Version of this program.
        expected: String,
    },
    /// It belongs to another fit.
    #[error(
        "{file}: fingerprint {found}, expected {expected}: the job, a scene or the data has changed since it was written; move it away to start anew, or undo the change to resume"
    )]
    OtherFit {
        /// File as named by the user.
        file: String,
        /// Fingerprint in its header.
        found: String,
        /// Fingerprint of this fit.
        expected: String,
    },
    /// It belongs to a search with another seed.
    #[error(
        "{file}: written by a search with seed {found}, the job has `seed = {expected}`; write `seed = {found}` into the job to go on from it, or move it away to start anew (`wiperlab journal merge` puts journals of several seeds together)"
    )]
    OtherSeed {
        /// File as named by the user.
        file: String,
        /// Seed in its header.
        found: u64,
        /// Seed of the job.
        expected: u64,
    },
    /// A line is not what the program writes.
    #[error(
        "{file}:{line}: {problem}; the file was damaged or edited, or is not a journal: restore it, delete this line and all after it to go on from those before, or move it away to start anew"
    )]
    Line {
        /// File as named by the user.
        file: String,
        /// 1-based line.
        line: usize,
        /// What was found and what was expected.
        problem: String,
    },
    /// Two journals disagree about one point.
    #[error(
        "{file}:{line}: {found}, but {other_file}:{other_line} has {expected} at the same point; either was edited, or the machines that wrote them do not calculate alike to the last digit (another processor, system or build), and then their journals cannot be merged: resume each where it was written"
    )]
    Conflict {
        /// File as named by the user.
        file: String,
        /// 1-based line in that file.
        line: usize,
        /// What is found there.
        found: String,
        /// The file that was read before.
        other_file: String,
        /// 1-based line in that file.
        other_line: usize,
        /// What is found there.
        expected: String,
    },
}

/// Exact coordinates of a point of the unit box, for look-up.
#[must_use]
pub fn key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

/// Refuses a journal of another problem, data or program; its seed and budgets are not looked at.
///
/// # Errors
/// [`JournalError::OtherVersion`], [`JournalError::OtherFit`], or [`JournalError::Line`] when the header was
/// edited.
pub fn check_problem(file: &str, found: &Header, expected: &Header) -> Result<(), JournalError> {
    let file = file.to_owned();
    if found.version != expected.version {
        return Err(JournalError::OtherVersion {
            file,
            found: found.version.clone(),
            expected: expected.version.clone(),
        });
    }
    if found.fingerprint != expected.fingerprint {
        return Err(JournalError::OtherFit {
            file,
            found: found.fingerprint.clone(),
            expected: expected.fingerprint.clone(),
        });
    }
    if (&found.parameters, &found.features) != (&expected.parameters, &expected.features) {
        return Err(JournalError::Line {
            file,
            line: 1,
            problem: "the header names other parameters or features than the fit has".to_owned(),
        });
    }
    Ok(())
}

/// Refuses a journal from which a fit with the header `expected` cannot go on.
///
/// # Errors
/// As [`check_problem`], and [`JournalError::OtherSeed`].
pub fn check_resumable(file: &str, found: &Header, expected: &Header) -> Result<(), JournalError> {
    check_problem(file, found, expected)?;
    if found.seed == expected.seed {
        return Ok(());
    }
    Err(JournalError::OtherSeed { file: file.to_owned(), found: found.seed, expected: expected.seed })
}

#[cfg(test)]
mod tests;
