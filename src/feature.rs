//! Features: values read by the same code from a recording and from a model's recording, by jobs and studies
//! alike. Every kind is a row of the table in `feature/reading.rs`; `docs/fits.md` and `docs/sweeps.md` list
//! them.
//!
//! A window's instants are found in each recording by itself, so model and measurement need not share a
//! clock. What only a simulated run knows ([`ContactReading`]) is read with its [`RunRecord`].

mod contact;
mod deflection;
mod interval;
mod keys;
mod missing;
mod reader;
mod reading;
mod spectral;
mod value;

use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
pub use interval::ReversalInterval;
pub use keys::ReadingEntry;
pub use keys::WIDTH_RELATIVE;
pub(crate) use keys::{Keys, define_entry, with_reading_keys};
pub use missing::{MissingReason, MissingValue};
pub use reader::{FeatureReader, RunRecord};
pub use reading::Reading;
pub(crate) use reading::ReadingKind;
use serde::Serialize;
pub use spectral::{ASSIGN_DB, ASSIGN_WIDTH, CycleRangeEnd, FeatureBand};
pub use value::{FeatureUnit, FeatureValue, LengthCalibration, RunnerUpComponent, ValueComparison};

/// Least relative standard deviation of a measured frequency. Reading a peak of 0.15 s leaves 0.03 Hz at 78
/// Hz (4e-4) without any noise, and the model is read through another window of the same length.
pub(crate) const FREQUENCY_SD_FLOOR: f64 = 1e-3;

// Features of several conditions, each read from the recording of its own.

/// A reading with its name and the condition that it belongs to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Feature {
    /// Name in the job.
    pub name: String,
    /// What is read.
    pub reading: Reading,
    /// From which condition of the job, counted from 0.
    pub condition: usize,
}

impl Feature {
    /// Reads it from `recording`, in which `instants` were found.
    ///
    /// # Errors
    /// [`MissingValue`] with the reason.
    pub fn read(
        &self,
        recording: &Recording,
        instants: &ReversalInstants,
    ) -> Result<FeatureValue, MissingValue> {
        self.reading.read(None, &FeatureReader::new(recording, instants))
    }

    /// Reads it from a recording that other features are read from too; a frequency is that of the component
    /// assigned to the `target`, Hz ([`Reading::read`]).
    ///
    /// # Errors
    /// [`MissingValue`] with the reason.
    pub fn read_assigned(
        &self,
        target: Option<f64>,
        reader: &FeatureReader,
    ) -> Result<FeatureValue, MissingValue> {
        self.reading.read(target, reader)
    }
}

/// Every feature of a set of recordings, one a condition, in order.
#[must_use]
pub fn read_features(
    features: &[Feature],
    recordings: &[Recording],
) -> Vec<Result<FeatureValue, MissingValue>> {
    read_assigned_features(features, &[], &recordings.iter().collect::<Vec<_>>())
}

/// The same of a model, whose components are assigned to targets: one a feature, in its unit; none for what
/// is beyond the end.
#[must_use]
pub fn read_assigned_features(
    features: &[Feature],
    targets: &[f64],
    recordings: &[&Recording],
) -> Vec<Result<FeatureValue, MissingValue>> {
    let instants: Vec<ReversalInstants> =
        recordings.iter().map(|recording| ReversalInstants::find_instants(recording)).collect();
    let readers: Vec<FeatureReader> = recordings
        .iter()
        .zip(&instants)
        .map(|(recording, instants)| FeatureReader::new(recording, instants))
        .collect();
    let read = |(at, feature): (usize, &Feature)| {
        let reader = readers
            .get(feature.condition)
            .ok_or(MissingValue::NoRecording { number: feature.condition + 1 })?;
        feature.read_assigned(targets.get(at).copied(), reader)
    };
    features.iter().enumerate().map(read).collect()
}
