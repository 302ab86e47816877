//! Features: values read by the same code from a recording and from a model's recording, by jobs and studies
//! alike. Every kind is a row of the table in `feature/reading.rs`; `docs/fits.md` and `docs/sweeps.md` list
//! them.
//!
//! A window's instants are found in each recording by itself, so model and measurement need not share a
//! clock. What only a simulated run knows ([`ContactReading`]) is read with its [`RunRecord`].

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

pub use band::FeatureBand;
pub use conditions::{Feature, read_assigned_features, read_features};
pub use contact::ContactReading;

pub use interval::ReversalInterval;
pub use keys::WIDTH_RELATIVE;
pub(crate) use keys::{Keys, ReadingEntry, define_entry, with_reading_keys};
pub use length::LengthCalibration;
pub use missing::MissingValue;

pub use reader::FeatureReader;
pub use reading::Reading;
pub(crate) use reading::ReadingKind;

pub use reason::MissingReason;
pub use run_record::RunRecord;
pub use spectral::{ASSIGN_DB, ASSIGN_WIDTH, CycleRangeEnd};
pub use unit::{FeatureUnit, ValueComparison};
pub use value::{FeatureValue, RunnerUpComponent};

/// Least relative standard deviation of a measured frequency. Reading a peak of 0.15 s leaves 0.03 Hz at 78
/// Hz (4e-4) without any noise, and the model is read through another window of the same length.
pub const FREQUENCY_SD_FLOOR: f64 = 1e-3;
