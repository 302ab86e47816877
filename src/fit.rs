//! Fits the parameters of a scene to recordings or to published numbers.
//!
//! A [`job::Job`] lists free parameters with their bounds, and targets under one or several conditions:
//! components (frequencies) and other features. Targets are measured on the recordings or given in the job.
//!
//! A fit of features has three steps. It assesses which parameters the features can determine
//! ([`identifiability`]), searches for the lowest cost with clouds of points and local searches ([`search`]),
//! and computes intervals at the best point by profiles and twins ([`uncertainty`]). The search works in the
//! unit box, in which each parameter runs from 0 at its lower bound to 1 at its upper bound. All evaluations
//! are written to a journal from which the fit can be resumed.

pub mod advice;
pub mod bootstrap;
pub mod bounds;
pub mod camera_calibration;
pub mod checkpoint;
pub(crate) mod context;
mod diagnosis;
pub mod evaluation;
pub mod findings;
mod fitted_model;
pub mod identifiability;
pub mod job;
pub mod journal;
pub mod law;
mod law_search;
pub mod ledger;
pub mod linear_model;
pub mod misfit;
pub mod model;
pub mod nuisance_parameters;
pub mod objective;
pub mod posterior;
mod problem;
pub mod profile;
pub mod result;
mod result_verification;
mod run;
pub mod scene_model;
pub mod search;
mod start_transient;
pub mod target_value;
pub mod targets;
pub mod trace;
pub mod trace_data;
mod trace_run;
pub mod uncertainty;

use crate::checkpoint::CheckpointError;
pub use context::FitContext;
pub use problem::{MeasuredRecording, Problem, ProblemError};
pub use run::{fit_features, job_warnings};
pub use targets::measure_targets;

/// Reason why a fit cannot start or continue.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The number of recordings differs from the number that the job names.
    #[error("found {found} recordings, expected the {expected} of the job")]
    Recordings {
        /// Number of recordings given.
        found: usize,
        /// Number of recordings in the job.
        expected: usize,
    },
    /// A feature cannot be measured on a recording.
    #[error(
        "{recording}: `{name}` cannot be measured: {problem}; choose another window or band, give its target in the job, or remove it from the job"
    )]
    NotMeasurable {
        /// Name of the recording.
        recording: String,
        /// Name of the component or feature.
        name: String,
        /// Reason why the feature cannot be measured.
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
        /// Path of the journal as the user gave it.
        file: String,
        /// Seed in the header of the journal.
        found: u64,
        /// Seed of the job.
        expected: u64,
    },
    /// The journal cannot be written.
    #[error("the journal cannot be written: {problem}")]
    JournalWrite {
        /// Reason why the journal cannot be written.
        problem: String,
    },
    /// The job cannot be fitted. For example, the features determine no parameter, or a scene refuses a
    /// value.
    #[error("this job cannot be fitted: {why}")]
    CannotBeFitted {
        /// Reason and advice.
        why: String,
    },
    /// The maximum number of evaluations is 0.
    #[error("found an allowance of {allowed} evaluations, expected at least 1; raise --max-evaluations")]
    NoEvaluation {
        /// Maximum number of evaluations that was given.
        allowed: usize,
    },
}
