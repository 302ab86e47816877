//! Work against precision: what every method errs by on a scene, and what it costs, held against a reference
//! an order tighter than the tightest tolerance.
//!
//! Errors are those of the transition times, of the deflection at common instants, and of two spectral
//! components. Times are the caller's: it keeps the clock.

mod components;
mod lists;
mod motion;
mod reference;
mod setting;
mod tables;

pub use components::{ComponentPair, HIGH_COMPONENT, LOW_COMPONENT};
pub use lists::TransitionDifference;
pub use reference::{AccuracyRow, ReferenceRun};

pub use setting::{REFERENCE_TOLERANCE, SolverSetting, TOLERANCES, list_settings};
pub use tables::{write_accuracy_csv, write_work_precision_csv};
