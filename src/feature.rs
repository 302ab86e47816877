//! Features: values that the same code reads from a recording and from the recording of a model, for jobs and
//! studies. Every kind is a row of the table in `feature/reading.rs`; `docs/fits.md` and `docs/sweeps.md`
//! list them.
//!
//! The instants of a window are found in each recording separately, so model and measurement need not share a
//! clock. Readings that only a simulated run has are read from its [`RunRecord`].

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

/// Least relative standard deviation of a measured frequency. Without noise, a window of 0.15 s gives a peak
/// at 78 Hz to 0.03 Hz (4e-4), and the model is read through another window of the same length.
pub(crate) const FREQUENCY_SD_FLOOR: f64 = 1e-3;

/// A reading with its name and its condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Feature {
    /// Name in the job.
    pub name: String,
    /// What is read.
    pub reading: Reading,
    /// Index of the condition of the job, counted from 0.
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

    /// Reads it through a reader that other features share; a frequency is that of the component assigned to
    /// the `target`, Hz ([`Reading::read`]).
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

/// Reads every feature from a set of recordings, one for each condition.
#[must_use]
pub fn read_features(
    features: &[Feature],
    recordings: &[Recording],
) -> Vec<Result<FeatureValue, MissingValue>> {
    read_assigned_features(features, &[], &recordings.iter().collect::<Vec<_>>())
}

/// Reads every feature from the recordings of a model. `targets` has one value per feature, in its unit, to
/// which components are assigned; features beyond its end have no target.
#[must_use]
pub fn read_assigned_features(
    features: &[Feature],
    targets: &[f64],
    recordings: &[&Recording],
) -> Vec<Result<FeatureValue, MissingValue>> {
    let find = |recording: &&Recording| ReversalInstants::find_instants(recording);
    let instants: Vec<ReversalInstants> = recordings.iter().map(find).collect();
    let both = recordings.iter().zip(&instants);
    let readers: Vec<FeatureReader> =
        both.map(|(recording, instants)| FeatureReader::new(recording, instants)).collect();
    let read = |(at, feature): (usize, &Feature)| {
        let absent = MissingValue::NoRecording { number: feature.condition + 1 };
        let reader = readers.get(feature.condition).ok_or(absent)?;
        feature.read_assigned(targets.get(at).copied(), reader)
    };
    features.iter().enumerate().map(read).collect()
}
