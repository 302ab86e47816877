//! Evaluations of a fit in a journal.

use super::FitError;
use super::bounds::{Bounds, BoundsSpacing, Prior, SearchAxis};
use super::camera_calibration::TargetCalibration;
use super::evaluation::{
    EvaluationOutcome, EvaluationStage, FailureReason, Observation, Observed, RunFailure,
};
use super::objective::Objective;
use super::run::FitContext;
use super::targets::TargetValue;
use crate::checkpoint;
use crate::checkpoint::{CheckpointError, CheckpointKind, CheckpointRecord, ExactNumber, sample_records};
use crate::feature::{LengthCalibration, ValueComparison};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// The journal of a fit.
pub type FeatureCheckpoint = checkpoint::CheckpointFile<EvaluationRecord>;
pub(crate) type FeatureHeader = checkpoint::CheckpointHeader<FeatureHeaderBody>;

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    /// What it was made for.
    pub stage: EvaluationStage,
    /// What the model showed. Costs are not kept: they depend on the scatter that a search has met.
    pub outcome: EvaluationOutcome,
}

/// Exact coordinates of a point of the unit box, for look-up.
pub(crate) fn point_key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

impl CheckpointRecord for EvaluationRecord {
    const KIND: CheckpointKind = CheckpointKind::Fit;
    type Body = FeatureHeaderBody;
    type IterateRow = Row;
    type Identity = Vec<u64>;

    fn identity(&self) -> Vec<u64> {
        point_key(&self.outcome.unit)
    }

    /// The values follow from the place in the unit box, and are not stored.
    fn to_row(&self, at: usize) -> Row {
        let EvaluationOutcome { unit, features, failure, .. } = &self.outcome;
        Row {
            index: at,
            stage: self.stage,
            unit: unit.iter().copied().map(ExactNumber).collect(),
            features: features.iter().map(FeatureValueRow::from_observed).collect(),
            failure: failure.as_ref().map(FailureRow::from_failure),
        }
    }

    fn line_index(row: &Row) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: Row, body: &FeatureHeaderBody) -> Result<Self, String> {
        row.check_against(body)?;
        Ok(Self { stage: row.stage, outcome: row.into_outcome(body) })
    }

    /// Everything that the model shows. Stages may differ: another search may have come to a point for
    /// another reason.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        first_difference(&self.outcome, &other.outcome)
    }

    fn problem_difference(found: &FeatureHeaderBody, expected: &FeatureHeaderBody) -> Option<String> {
        let same = found.parameters == expected.parameters && found.features == expected.features;
        (!same)
            .then(|| "the header has other parameters, bounds, features or targets than the fit".to_owned())
    }
}

/// An evaluation as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    index: usize,
    stage: EvaluationStage,
    unit: Vec<ExactNumber>,
    features: Vec<FeatureValueRow>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<FailureRow>,
}

impl Row {
    fn check_against(&self, body: &FeatureHeaderBody) -> Result<(), String> {
        let (found, expected) = (self.unit.len(), body.parameters.len());
        if found != expected {
            return Err(format!("`unit`: found {found} numbers, expected {expected}"));
        }
        let (found, expected) = (self.features.len(), body.features.len());
        if self.failure.is_none() && found != expected {
            return Err(format!("`features`: found {found}, expected {expected}"));
        }
        if self.failure.is_some() && !self.features.is_empty() {
            return Err("found `features` and `failure`, expected one of them".to_owned());
        }
        match self.unit.iter().find(|u| !(0.0..=1.0).contains(&u.0)) {
            Some(outside) => Err(format!("`unit`: found {}, expected 0 to 1", outside.0)),
            None => Ok(()),
        }
    }

    /// The values follow from the place in the unit box.
    fn into_outcome(self, body: &FeatureHeaderBody) -> EvaluationOutcome {
        let unit: Vec<f64> = self.unit.into_iter().map(|n| n.0).collect();
        let values = body.parameters.iter().zip(&unit);
        let values = values.map(|(parameter, u)| parameter.axis.bounds.from_unit(*u)).collect();
        let features = self.features.into_iter().map(FeatureValueRow::into_observed).collect();
        EvaluationOutcome { unit, values, features, failure: self.failure.map(FailureRow::into_failure) }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum FeatureValueRow {
    Value(ExactNumber),
    Averaged { value: ExactNumber, spread: ExactNumber, below_db: ExactNumber },
    Missing { missing: String },
}

impl FeatureValueRow {
    fn from_observed(observed: &Observed) -> Self {
        match observed {
            Observed::Value(Observation { value, spread: 0.0, below_db: 0.0 }) => {
                Self::Value(ExactNumber(*value))
            }
            Observed::Value(Observation { value, spread, below_db }) => Self::Averaged {
                value: ExactNumber(*value),
                spread: ExactNumber(*spread),
                below_db: ExactNumber(*below_db),
            },
            Observed::Missing(missing) => Self::Missing { missing: missing.clone() },
        }
    }

    fn into_observed(self) -> Observed {
        match self {
            Self::Value(value) => Observed::from_value(value.0),
            Self::Averaged { value, spread, below_db } => {
                Observed::Value(Observation { value: value.0, spread: spread.0, below_db: below_db.0 })
            }
            Self::Missing { missing } => Observed::Missing(missing),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FailureRow {
    reason: FailureReason,
    message: String,
    progress: ExactNumber,
}

impl FailureRow {
    fn from_failure(failure: &RunFailure) -> Self {
        let RunFailure { reason, message, progress } = failure.clone();
        Self { reason, message, progress: ExactNumber(progress) }
    }

    fn into_failure(self) -> RunFailure {
        RunFailure { reason: self.reason, message: self.message, progress: self.progress.0 }
    }
}

// What the header of a fit's journal says: what each number of a line means, and what it is held against.

/// What the header of a fit says besides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureHeaderBody {
    /// Seed of the search.
    pub seed: u64,
    /// Free parameters, in the order of the coordinates.
    pub parameters: Vec<HeaderParameter>,
    /// Targets, in the order of the features.
    pub features: Vec<HeaderFeature>,
}

/// A free parameter in a header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ParameterRow", into = "ParameterRow")]
pub struct HeaderParameter {
    /// Name in the job.
    pub name: String,
    /// Unit as shown; `1` for a plain number.
    pub unit: String,
    /// Its range, from which its values follow, and what is known of it beforehand.
    pub axis: SearchAxis,
}

/// A feature in a header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "FeatureRow", into = "FeatureRow")]
pub struct HeaderFeature {
    /// Name in the job.
    pub name: String,
    /// Unit in files; `1` for a plain number.
    pub unit: String,
    /// What it should be.
    pub target: TargetValue,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterRow {
    name: String,
    unit: String,
    lower: ExactNumber,
    upper: ExactNumber,
    scale: BoundsSpacing,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    prior: Option<PriorRow>,
}

/// Of the parameter, or of its logarithm where its scale is one.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PriorRow {
    mean: ExactNumber,
    sd: ExactNumber,
}

impl From<HeaderParameter> for ParameterRow {
    fn from(HeaderParameter { name, unit, axis: SearchAxis { bounds, prior } }: HeaderParameter) -> Self {
        let prior = prior.map(|prior| match prior {
            Prior::Linear { mean, sd } => PriorRow { mean: ExactNumber(mean), sd: ExactNumber(sd) },
            Prior::Log { mean_ln, sd_ln } => PriorRow { mean: ExactNumber(mean_ln), sd: ExactNumber(sd_ln) },
        });
        let [lower, upper] = [bounds.lower(), bounds.upper()].map(ExactNumber);
        Self { name, unit, lower, upper, scale: bounds.spacing(), prior }
    }
}

impl TryFrom<ParameterRow> for HeaderParameter {
    type Error = String;

    fn try_from(row: ParameterRow) -> Result<Self, String> {
        let ParameterRow { name, unit, lower, upper, scale, prior } = row;
        let bounds = Bounds::new(lower.0, upper.0, scale).map_err(|error| format!("`{name}`: {error}"))?;
        let prior = prior.map(|PriorRow { mean, sd }| match scale {
            BoundsSpacing::Linear => Prior::Linear { mean: mean.0, sd: sd.0 },
            BoundsSpacing::Log => Prior::Log { mean_ln: mean.0, sd_ln: sd.0 },
        });
        Ok(Self { name, unit, axis: SearchAxis { bounds, prior } })
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FeatureRow {
    name: String,
    unit: String,
    target: ExactNumber,
    sd: ExactNumber,
    /// Size of a large difference, where it is differences that are compared and not ratios.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    large_difference: Option<ExactNumber>,
    /// Whether it counts in the last stage alone.
    last_stage: bool,
    /// What is not known of its camera, where it depends on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<CameraRow>,
}

/// Features of one condition have a camera in common.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraRow {
    /// Counted from 1, as in a job.
    condition: usize,
    scale_sd: ExactNumber,
    offset_sd_m: ExactNumber,
    /// Of a size, what was added to it in quadrature; none of a place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    floor_m: Option<ExactNumber>,
}

impl From<TargetCalibration> for CameraRow {
    fn from(TargetCalibration { condition, scale_sd, offset_sd_m, length }: TargetCalibration) -> Self {
        let floor_m = match length {
            LengthCalibration::Position => None,
            LengthCalibration::Size { floor_m } => Some(ExactNumber(floor_m)),
        };
        let [scale_sd, offset_sd_m] = [scale_sd, offset_sd_m].map(ExactNumber);
        Self { condition: condition + 1, scale_sd, offset_sd_m, floor_m }
    }
}

impl From<CameraRow> for TargetCalibration {
    fn from(CameraRow { condition, scale_sd, offset_sd_m, floor_m }: CameraRow) -> Self {
        let length = floor_m
            .map_or(LengthCalibration::Position, |floor_m| LengthCalibration::Size { floor_m: floor_m.0 });
        let condition = condition.saturating_sub(1);
        Self { condition, scale_sd: scale_sd.0, offset_sd_m: offset_sd_m.0, length }
    }
}

impl From<HeaderFeature> for FeatureRow {
    fn from(HeaderFeature { name, unit, target }: HeaderFeature) -> Self {
        let TargetValue { value, sd, measure, last, calibration, .. } = target;
        let large_difference = match measure {
            ValueComparison::Log => None,
            ValueComparison::Linear { scale } => Some(ExactNumber(scale)),
        };
        let camera = calibration.map(CameraRow::from);
        let (target, sd) = (ExactNumber(value), ExactNumber(sd));
        Self { name, unit, target, sd, large_difference, last_stage: last, camera }
    }
}

impl From<FeatureRow> for HeaderFeature {
    fn from(row: FeatureRow) -> Self {
        let FeatureRow { name, unit, target, sd, large_difference, last_stage: last, camera } = row;
        let measure =
            large_difference.map_or(ValueComparison::Log, |scale| ValueComparison::Linear { scale: scale.0 });
        let target = TargetValue {
            name: name.clone(),
            value: target.0,
            sd: sd.0,
            scatter: 0.0,
            measure,
            last,
            calibration: camera.map(TargetCalibration::from),
        };
        Self { name, unit, target }
    }
}

// What differs between two outcomes at one point, in words.

/// The first difference: what the one has there, and what the other.
pub(super) fn first_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    value_difference(one, other)
        .or_else(|| failure_difference(one, other))
        .or_else(|| feature_difference(one, other))
}

fn value_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    (one.values != other.values).then(|| [one, other].map(|outcome| format!("values {:?}", outcome.values)))
}

fn failure_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    let words = |failure: Option<&RunFailure>| match failure {
        Some(RunFailure { reason, message, progress }) => {
            format!("failure {reason} ({message}) after {progress} of the run")
        }
        None => "no failure".to_owned(),
    };
    (one.failure != other.failure).then(|| [one, other].map(|outcome| words(outcome.failure.as_ref())))
}

fn feature_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    if one.features.len() != other.features.len() {
        return Some([one, other].map(|outcome| format!("{} features", outcome.features.len())));
    }
    let mut pairs = one.features.iter().zip(&other.features).enumerate();
    let (at, (a, b)) = pairs.find(|(_, (a, b))| a != b)?;
    Some([a, b].map(|observed| format!("feature {} {}", at + 1, describe_observed(observed))))
}

fn describe_observed(observed: &Observed) -> String {
    let number = |name: &str, number: &dyn Debug| format!(", {name} {number:?}");
    match observed {
        Observed::Value(found) => {
            let apart = [("spread", found.spread), ("below the strongest by (dB)", found.below_db)];
            let apart = apart.iter().filter(|(_, value)| *value != 0.0);
            let apart: String = apart.map(|(name, value)| number(name, value)).collect();
            format!("{:?}{apart}", found.value)
        }
        Observed::Missing(why) => format!("missing ({why})"),
    }
}

// Evaluations of a journal once more: a resumed fit believes none that the model does not give.

/// Makes some evaluations of the journal that is resumed again, and compares them to the last bit.
pub(super) fn recheck_sample(objective: &Objective, context: &FitContext, seed: u64) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let records = journal.records.len();
    let places = sample_records(records, seed.wrapping_add(records as u64)); // others each time, as it grows
    let checked: Vec<Result<(), CheckpointError>> =
        places.into_par_iter().map(|place| recheck_record(objective, file, journal, place)).collect();
    Ok(checked.into_iter().collect::<Result<(), _>>()?)
}

/// The same for the evaluation at a point, if the journal has it.
pub(super) fn recheck_at(objective: &Objective, context: &FitContext, unit: &[f64]) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let place = journal.records.iter().position(|entry| point_key(&entry.outcome.unit) == point_key(unit));
    Ok(place.map_or(Ok(()), |place| recheck_record(objective, file, journal, place))?)
}

fn recheck_record(
    objective: &Objective,
    file: &str,
    journal: &FeatureCheckpoint,
    place: usize,
) -> Result<(), CheckpointError> {
    let Some(stored) = journal.records.get(place) else { return Ok(()) };
    let outcome = objective.evaluate(&stored.outcome.unit).into();
    journal.check_recomputed(file, place, &EvaluationRecord { outcome, ..stored.clone() })
}

#[cfg(test)]
mod tests;
