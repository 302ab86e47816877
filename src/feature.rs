//! Features: values read by the same code from a recording and from a model's recording, by jobs and studies
//! alike. Every kind is a row of the table in `feature/reading.rs`; `docs/fits.md` and `docs/sweeps.md` list
//! them.
//!
//! A window's instants are found in each recording by itself, so model and measurement need not share a
//! clock. What only a simulated run knows ([`Contact`]) is read with its [`RunRecord`].

mod band;
mod conditions;
mod contact;
mod cycle;
mod damping;
mod deflection;
mod head_speed;
mod interval;
mod keys;
mod length;
mod missing;
mod reader;
mod reading;
mod reason;
mod run_record;
mod spectral;
mod unit;
mod value;

pub use band::Band;
pub use conditions::{Feature, read_all, read_all_assigned};
pub use contact::Contact;

pub use interval::Interval;
pub use keys::WIDTH_RELATIVE;
pub(crate) use keys::{Entry, Keys, define_entry, with_reading_keys};
pub use length::Length;
pub use missing::Missing;

pub use reader::Reader;
pub(crate) use reading::Kind;
pub use reading::Reading;

pub use reason::Reason;
pub use run_record::RunRecord;
pub use spectral::{ASSIGN_DB, ASSIGN_WIDTH, End};
pub use unit::{Measure, Unit};
pub use value::{RunnerUp, Value};

/// Least relative standard deviation of a measured frequency. Reading a peak of 0.15 s leaves 0.03 Hz at 78
/// Hz (4e-4) without any noise, and the model is read through another window of the same length.
pub const FREQUENCY_SD_FLOOR: f64 = 1e-3;
