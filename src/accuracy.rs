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

pub use components::{Components, HIGH, LOW};
pub use lists::Lists;
pub use reference::{Reference, Row};

pub use setting::{REFERENCE_TOLERANCE, Setting, TOLERANCES, settings};
pub use tables::{accuracy_csv, work_precision_csv};
