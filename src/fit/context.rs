//! What a fit of features is computed from.

use crate::checkpoint::format_header_line;
use crate::fit::FitError;
use crate::fit::feature_checkpoint::{EvaluationRecord, FeatureCheckpoint, FeatureHeader};

/// The run of a fit: its problem, its allowance and the journal that it continues.
#[derive(Debug, Clone, Default)]
pub struct FitContext<'a> {
    /// Fingerprint of the problem, from `checkpoint::fingerprint`.
    pub fingerprint: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Most evaluations of this run, replayed ones included; `None` for what the job allows.
    pub max_evaluations: Option<usize>,
    /// The journal to continue, with the name of its file for error messages.
    pub resume: Option<(&'a str, &'a FeatureCheckpoint)>,
}

impl<'a> FitContext<'a> {
    /// Evaluations of the journal that is resumed.
    pub(super) fn stored_records(&self) -> &'a [EvaluationRecord] {
        self.resume.map_or(&[][..], |(_, journal)| &journal.records)
    }

    /// Text before the first new line: the header, unless a journal is resumed.
    pub(super) fn opening_lines(&self, header: &FeatureHeader) -> String {
        self.resume.map_or_else(|| format_header_line(header), |_| String::new())
    }

    /// Refuses a journal that a fit with this header cannot resume.
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
