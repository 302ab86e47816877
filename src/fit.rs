//! Fitting a scene's parameters to recordings or to published components.
//!
//! A [`job::Job`] names free parameters, their bounds and what has to be met: components (frequencies) and
//! other features, under one or several conditions. Targets are measured on the recordings, or given. A
//! [`gate`](gate::gate) looks first at what these features can determine; clouds of points and then local
//! searches from several points seek the lowest cost in the unit box; at the best point profiles and twins
//! say what is known of each parameter. Every evaluation goes into a journal from which the same fit can be
//! replayed and continued.

pub mod advice;
pub mod axis;
pub mod bootstrap;
pub mod calibration;
pub mod cameras;
pub mod constants;
mod context;
mod error;
pub mod evaluation;
pub mod failure;
pub mod gate;
pub mod information;
pub mod iterates;
pub mod job;
pub mod journal;
pub mod ledger;
pub mod linear;
pub mod misfit;
pub mod model;
pub mod model_features;
pub mod objective;
pub mod posterior;
mod problem;
pub mod profile;
mod recheck;
mod recomputed;
pub mod result;
mod run;
pub mod scale;
pub mod scene_model;
pub mod search;
pub mod settings;
mod settled;
pub mod stage;
pub mod target;
mod targets;
pub mod trace;
pub mod trace_ledger;
mod trace_result;
mod trace_run;
pub mod traced;
pub mod uncertainty;
mod whole_run;

pub use context::FitContext;
pub use error::FitError;
pub use problem::{MeasuredRecording, Problem, ProblemError};
pub use run::{fit_features, job_warnings};
pub use targets::measure_targets;
