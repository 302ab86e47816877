//! Inputs of a fit in addition to the problem itself.

use crate::fit::checkpoint::FitCheckpoint;

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
    pub resume: Option<(&'a str, &'a FitCheckpoint)>,
}
