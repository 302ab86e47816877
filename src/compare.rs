//! Comparison of a recording with the fitted model, as data: alignment, residuals, ridges, windows,
//! transitions and runs. Each distinct scene is simulated only once.

pub mod condition;
mod drift;
pub mod friction;
pub mod inverse_dynamics;
pub mod model_run;
mod model_states;
mod overlay;
pub mod ridge;
pub mod rows;
pub mod summary;
pub mod tables;

pub use condition::{ConditionComparison, FittedRecording, TimedRecording};
pub(crate) use friction::FrictionPoint;
pub(crate) use model_run::RunSummary;
pub use model_run::{ModelRun, run_conditions};
pub(crate) use ridge::release_window;
pub use ridge::{RidgePair, TrackedRidge};
pub(crate) use rows::{NextPeak, ParameterLine, TargetComparison, TrueValue};
pub(crate) use summary::ComparisonSummary;
pub(crate) use tables::{COMPARISON_FILE, ComparisonTable, comparison_table};
