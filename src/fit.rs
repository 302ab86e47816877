//! Fitting a scene's parameters to recordings or to published components.
//!
//! A [`job::Job`] names free parameters, their bounds and what has to be met: components (frequencies) and
//! other features, under one or several conditions. Targets are measured on the recordings, or given. A
//! [`gate`](gate::gate) looks first at what these features can determine; clouds of points and then local
//! searches from several points seek the lowest cost in the unit box; at the best point profiles and twins
//! say what is known of each parameter. Every evaluation goes into a journal from which the same fit can be
//! replayed and continued.

pub mod advice;
pub mod bootstrap;
pub mod bounds;
pub mod camera_calibration;
pub mod evaluation;
pub mod feature_checkpoint;
pub mod identifiability;
pub mod job;
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
pub mod targets;
pub mod trace;
pub mod trace_checkpoint;
pub mod trace_data;
pub mod trace_ledger;
mod trace_run;
pub mod uncertainty;

use crate::checkpoint::CheckpointError;
pub use problem::{MeasuredRecording, Problem, ProblemError};
pub use run::{FitContext, fit_features, job_warnings};
pub use targets::measure_targets;

// Why a fit did not run.

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
