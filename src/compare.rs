//! A recording against a model, as data: clocks and origins, what is left between the two, ridges, windows,
//! transitions and runs. Every scene is simulated once; nothing here is prose or a drawing.

pub mod alignment;
pub mod case;
pub mod course;
pub mod fitted_law;
pub mod measured_friction;
pub mod model_run;
pub mod motion;
pub mod ridge;
pub mod runs;
pub mod summary;
pub mod tables;
pub mod traces;
pub mod windows;

pub use alignment::{Alignment, Point};
pub use case::{Case, Measured, Side};
pub use measured_friction::{FrictionPoint, MeasuredFriction};
pub use model_run::{ModelRun, model_runs};
pub use motion::Motion;
pub use ridge::{FollowedRidge, Ridges, SpeedPoint};
pub use runs::RunLine;
pub use summary::Summary;
pub use tables::{COMPARISON, Table, comparison};
pub use traces::MotionTraces;
pub use windows::{FitWindow, Sought, Target};
