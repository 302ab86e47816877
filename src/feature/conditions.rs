//! Features of several conditions, each read from the recording of its own.

use super::missing::MissingValue;
use super::reader::FeatureReader;
use super::reading::Reading;
use super::value::FeatureValue;
use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
use serde::Serialize;

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
