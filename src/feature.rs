//! Features: values that the same code computes from a recording and from the synthetic recording of a model,
//! for jobs and studies. Every kind is a row of the table in `feature/reading.rs`; `docs/fits.md` and
//! `docs/sweeps.md` list the kinds.
//!
//! The instants of a window are found in each recording separately, so model and measurement need not share a
//! clock. Values that only a simulated run can give are computed from the [`RunRecord`] of the run.

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

/// Lower limit of the relative standard deviation of a measured frequency. Even without noise, the frequency
/// of a peak at 78 Hz in a window of 0.15 s has an error of 0.03 Hz (4e-4). The error depends on the instants
/// in the window, and those of the model differ from those of the recording.
pub(crate) const FREQUENCY_SD_FLOOR: f64 = 1e-3;

/// A reading that a job names, and the condition of the job in whose recording the reading is evaluated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Feature {
    /// Name of the feature in the job.
    pub name: String,
    /// Quantity that is evaluated, with its settings.
    pub reading: Reading,
    /// Index of the job's condition in whose recording the feature is evaluated, counted from 0.
    pub condition: usize,
}

impl Feature {
    /// Evaluates the feature in `recording`; `instants` are the instants that were found in this recording.
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

    /// Evaluates the feature with a reader that other features share. The value of a frequency feature is the
    /// frequency of the component assigned to `target`, Hz ([`Reading::read`]).
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

/// Evaluates every feature; `recordings` has one recording for each condition of the job.
#[must_use]
pub fn read_features(
    features: &[Feature],
    recordings: &[Recording],
) -> Vec<Result<FeatureValue, MissingValue>> {
    read_assigned_features(features, &[], &recordings.iter().collect::<Vec<_>>())
}

/// Evaluates every feature in the recordings of a model, one for each condition. `targets` has one value per
/// feature, in the unit of that feature; a frequency feature evaluates the component that is assigned to its
/// target. Features beyond the end of `targets` have no target.
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
