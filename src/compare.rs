//! A recording against a model, as data: clocks and origins, what is left between the two, ridges, windows,
//! transitions and runs. Every scene is simulated once; nothing here is prose or a drawing.

pub mod case;
pub mod fitted_law;
pub mod measured_friction;
pub mod model_run;
pub mod ridge;
pub mod rows;
pub mod runs;
pub mod summary;
pub mod tables;
pub mod windows;

pub use case::{ConditionComparison, FittedRecording, TimedRecording};
pub use measured_friction::{FrictionPoint, MeasuredFriction};
pub use model_run::{ModelRun, run_conditions};
pub use ridge::{RidgePair, TrackedRidge};
pub use rows::{Comparison, NextPeak, ParameterLine, Truth};
pub use runs::RunSummary;
pub use summary::ComparisonSummary;
pub use tables::{COMPARISON_FILE, ComparisonTable, comparison_table};
pub use windows::{FitWindow, FrequencyComparison};
