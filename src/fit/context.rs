//! What a fit needs to know besides its job, its recordings and its model.

use super::error::FitError;
use super::journal::{Entry, Header, Journal};
use crate::journal::header_line;

/// Which run of which problem it is.
#[derive(Debug, Clone, Default)]
pub struct Context<'a> {
    /// Fingerprint of the problem, from [`crate::journal::fingerprint`].
    pub fingerprint: &'a str,
    /// Version of the program.
    pub version: &'a str,
    /// Most evaluations of this run, replayed ones included; `None` for what the job allows.
    pub max_evaluations: Option<usize>,
    /// The journal to be continued, with its file's name for refusals.
    pub resume: Option<(&'a str, &'a Journal)>,
}

impl<'a> Context<'a> {
    /// Evaluations that are known before the first.
    pub(super) fn journaled(&self) -> &'a [Entry] {
        self.resume.map_or(&[][..], |(_, journal)| &journal.records)
    }

    /// What is written before the first new line: the header of a new journal.
    pub(super) fn opening(&self, header: &Header) -> String {
        self.resume.map_or_else(|| header_line(header), |_| String::new())
    }

    /// Refuses a journal from which a fit with this header cannot go on.
    pub(super) fn check_resumable(&self, expected: &Header) -> Result<(), FitError> {
        let Some((file, journal)) = self.resume else { return Ok(()) };
        journal.header.check::<Entry>(file, expected)?;
        let (found, expected) = (journal.header.body.seed, expected.body.seed);
        if found == expected {
            return Ok(());
        }
        Err(FitError::OtherSeed { file: file.to_owned(), found, expected })
    }
}
