//! Inputs of a fit of features in addition to the problem itself.

use crate::checkpoint::format_header_line;
use crate::fit::FitError;
use crate::fit::feature_checkpoint::{EvaluationRecord, FeatureCheckpoint, FeatureHeader};

/// Fingerprint, evaluation limit and journal of one run of a fit.
#[derive(Debug, Clone, Default)]
pub struct FitContext<'a> {
    /// Fingerprint of the problem, from `checkpoint::fingerprint`.
    pub fingerprint: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Maximum number of evaluations of this run, including replayed ones; `None` if only the budgets of the
    /// job limit it.
    pub max_evaluations: Option<usize>,
    /// The journal to continue, with the name of its file for error messages.
    pub resume: Option<(&'a str, &'a FeatureCheckpoint)>,
}

impl<'a> FitContext<'a> {
    /// Evaluations stored in the journal that is resumed.
    pub(super) fn stored_records(&self) -> &'a [EvaluationRecord] {
        self.resume.map_or(&[][..], |(_, journal)| &journal.records)
    }

    /// Text that precedes the first new line of the journal: the header, or nothing if a journal is resumed.
    pub(super) fn opening_lines(&self, header: &FeatureHeader) -> String {
        self.resume.map_or_else(|| format_header_line(header), |_| String::new())
    }

    /// Refuses the journal if a fit with the header `expected` cannot resume it.
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
