//! Why a fit did not run.

use crate::journal::CheckpointError;

/// Why a fit did not run, or could not go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The job wants another number of recordings.
    #[error("found {found} recordings, expected the {expected} of the job")]
    Recordings {
        /// Recordings given.
        found: usize,
        /// Recordings in the job.
        expected: usize,
    },
    /// A recording does not show what the job wants to fit.
    #[error(
        "{recording}: `{name}` cannot be measured: {problem}; choose another window or band, give its target in the job, or remove it from the job"
    )]
    NotMeasurable {
        /// Name of the recording.
        recording: String,
        /// Name of the component or feature.
        name: String,
        /// Why.
        problem: String,
    },
    /// The journal does not belong to this fit.
    #[error(transparent)]
    Journal(#[from] CheckpointError),
    /// The journal belongs to a search with another seed.
    #[error(
        "{file}: written by a search with seed {found}, the job has `seed = {expected}`; write `seed = {found}` into the job to go on from it, or move it away to start over"
    )]
    OtherSeed {
        /// File as named by the user.
        file: String,
        /// Seed in its header.
        found: u64,
        /// Seed of the job.
        expected: u64,
    },
    /// The journal cannot be written.
    #[error("the journal cannot be written: {problem}")]
    JournalWrite {
        /// Why.
        problem: String,
    },
    /// Nothing could be learned, so nothing was searched.
    #[error("this job cannot be fitted: {why}")]
    CannotBeFitted {
        /// Why, and what to do.
        why: String,
    },
    /// No evaluation was allowed.
    #[error("found an allowance of {allowed} evaluations, expected at least 1; raise --max-evaluations")]
    NoEvaluation {
        /// Evaluations allowed.
        allowed: usize,
    },
}
