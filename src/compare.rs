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

pub use case::{Case, Measured, Side};
pub use measured_friction::{FrictionPoint, MeasuredFriction};
pub use model_run::{ModelRun, model_runs};
pub use ridge::{FollowedRidge, Ridges};
pub use rows::{Comparison, NextPeak, ParameterLine, Truth};
pub use runs::RunLine;
pub use summary::Summary;
pub use tables::{COMPARISON, Table, comparison};
pub use windows::{FitWindow, Sought};
