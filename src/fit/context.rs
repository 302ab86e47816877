//! What a fit needs to know besides its job, its recordings and its model.

use super::error::FitError;
use super::journal::{EvaluationRecord, FeatureCheckpoint, FeatureHeader};
use crate::journal::format_header_line;

/// Which run of which problem it is.
#[derive(Debug, Clone, Default)]
pub struct FitContext<'a> {
    /// Fingerprint of the problem, from [`crate::journal::fingerprint`].
    pub fingerprint: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Most evaluations of this run, replayed ones included; `None` for what the job allows.
    pub max_evaluations: Option<usize>,
    /// The journal to be continued, with its file's name for refusals.
    pub resume: Option<(&'a str, &'a FeatureCheckpoint)>,
}

impl<'a> FitContext<'a> {
    /// Evaluations that are known before the first.
    pub(super) fn stored_records(&self) -> &'a [EvaluationRecord] {
        self.resume.map_or(&[][..], |(_, journal)| &journal.records)
    }

    /// What is written before the first new line: the header of a new journal.
    pub(super) fn opening_lines(&self, header: &FeatureHeader) -> String {
        self.resume.map_or_else(|| format_header_line(header), |_| String::new())
    }

    /// Refuses a journal from which a fit with this header cannot go on.
    pub(super) fn check_resumable(&self, expected: &FeatureHeader) -> Result<(), FitError> {
        let Some((file, journal)) = self.resume else { return Ok(()) };
        journal.header.check_matches::<EvaluationRecord>(file, expected)?;
        let (found, expected) = (journal.header.body.seed, expected.body.seed);
        if found == expected {
            return Ok(());
        }
        Err(FitError::OtherSeed { file: file.to_owned(), found, expected })
    }
}
