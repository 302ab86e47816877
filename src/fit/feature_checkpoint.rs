//! Journal of a fit of features: one evaluation per line.

use super::FitError;
use super::bounds::{Bounds, BoundsSpacing, Prior, SearchAxis};
use super::context::FitContext;
use super::evaluation::{EvaluationOutcome, EvaluationStage, Observation, Observed, RunFailure};
use super::objective::Objective;
use super::target_value::{TargetCalibration, TargetValue};
use crate::checkpoint::{
    self, CheckpointError, CheckpointKind, CheckpointRecord, ExactNumber, sample_records,
};
use crate::feature::{LengthCalibration, ValueComparison};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The journal of a fit of features.
pub type FeatureCheckpoint = checkpoint::CheckpointFile<EvaluationRecord>;
pub(crate) type FeatureHeader = checkpoint::CheckpointHeader<FeatureHeaderBody>;

/// One evaluation in a journal.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    /// Purpose of the evaluation.
    pub stage: EvaluationStage,
    /// Outcome of the model. Costs are not stored: they depend on the scatter that a search estimates.
    pub outcome: EvaluationOutcome,
}

/// The coordinates of a point in the unit box as bit patterns, to look up the point.
pub(crate) fn point_key(unit: &[f64]) -> Vec<u64> {
    unit.iter().map(|u| u.to_bits()).collect()
}

impl CheckpointRecord for EvaluationRecord {
    const KIND: CheckpointKind = CheckpointKind::Fit;
    type Body = FeatureHeaderBody;
    type Row = EvaluationRow;
    type Identity = Vec<u64>;

    fn identity(&self) -> Vec<u64> {
        point_key(&self.outcome.unit)
    }

    /// The row of this evaluation in the journal. Parameter values are not stored, because they follow from
    /// the point in the unit box.
    fn to_row(&self, at: usize) -> EvaluationRow {
        let EvaluationOutcome { unit, features, failure, .. } = &self.outcome;
        EvaluationRow {
            index: at,
            stage: self.stage,
            unit: unit.iter().copied().map(ExactNumber).collect(),
            features: features.iter().map(FeatureValueRow::from_observed).collect(),
            failure: failure.clone(),
        }
    }

    fn line_index(row: &EvaluationRow) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: EvaluationRow, body: &FeatureHeaderBody) -> Result<Self, String> {
        row.check_against(body)?;
        Ok(Self { stage: row.stage, outcome: row.into_outcome(body) })
    }

    /// Compares the outcomes but not the stages, because another search may evaluate the same point in
    /// another stage.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        first_difference(&self.outcome, &other.outcome)
    }

    fn problem_difference(found: &FeatureHeaderBody, expected: &FeatureHeaderBody) -> Option<String> {
        let differs = found.parameters != expected.parameters || found.features != expected.features;
        let why = "the header has other parameters, bounds, features or targets than the fit";
        differs.then(|| why.to_owned())
    }
}

/// An evaluation as a line of the journal.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluationRow {
    index: usize,
    stage: EvaluationStage,
    unit: Vec<ExactNumber>,
    features: Vec<FeatureValueRow>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<RunFailure>,
}

impl EvaluationRow {
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

    fn into_outcome(self, body: &FeatureHeaderBody) -> EvaluationOutcome {
        let unit: Vec<f64> = self.unit.into_iter().map(|n| n.0).collect();
        let values = body.parameters.iter().zip(&unit);
        let values = values.map(|(parameter, u)| parameter.axis.bounds.value_at_unit(*u)).collect();
        let features = self.features.into_iter().map(FeatureValueRow::into_observed).collect();
        EvaluationOutcome { unit, values, features, failure: self.failure }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum FeatureValueRow {
    Value(ExactNumber),
    Averaged(Observation),
    Missing { missing: String },
}

impl FeatureValueRow {
    fn from_observed(observed: &Observed) -> Self {
        match observed {
            Observed::Value(Observation { value, spread: 0.0, below_db: 0.0 }) => {
                Self::Value(ExactNumber(*value))
            }
            Observed::Value(averaged) => Self::Averaged(*averaged),
            Observed::Missing(missing) => Self::Missing { missing: missing.clone() },
        }
    }

    fn into_observed(self) -> Observed {
        match self {
            Self::Value(value) => Observed::from_value(value.0),
            Self::Averaged(averaged) => Observed::Value(averaged),
            Self::Missing { missing } => Observed::Missing(missing),
        }
    }
}

// Header of the journal: the meaning of the numbers in the lines that follow, and the targets.

/// The part of the header that is specific to a fit of features.
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
    /// Unit in which the value is shown; `1` for a dimensionless number.
    pub unit: String,
    /// Range of the parameter, which maps coordinates to values, and its prior.
    pub axis: SearchAxis,
}

/// A feature in a header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "FeatureRow", into = "FeatureRow")]
pub struct HeaderFeature {
    /// Name in the job.
    pub name: String,
    /// Unit in which files give the value; `1` for a dimensionless number.
    pub unit: String,
    /// Target value and its standard deviation.
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

/// Prior of the parameter or, on a logarithmic scale, of its logarithm.
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
    /// Difference of two values that counts as large, in the unit of the feature; absent if values are
    /// compared by the logarithm of their ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    large_difference: Option<ExactNumber>,
    /// Whether the feature counts in the last stage only.
    last_stage: bool,
    /// Calibration errors of the camera, if the feature depends on them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<CameraRow>,
}

/// Calibration errors of the camera of a condition.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraRow {
    /// Number of the condition, counted from 1 as in a job.
    condition: usize,
    scale_sd: ExactNumber,
    offset_sd_m: ExactNumber,
    /// Noise floor, m, of a feature that is a size: the size contains this noise, added in quadrature. Absent
    /// for a position.
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

/// Describes the first difference between two outcomes at the same point.
pub(super) fn first_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    let both = [one, other];
    if one.values != other.values {
        return Some(both.map(|outcome| format!("values {:?}", outcome.values)));
    }
    if one.failure != other.failure {
        return Some(both.map(|outcome| match &outcome.failure {
            Some(RunFailure { reason, message, progress }) => {
                format!("failure {reason} ({message}) after {progress} of the run")
            }
            None => "no failure".to_owned(),
        }));
    }
    if one.features.len() != other.features.len() {
        return Some(both.map(|outcome| format!("{} features", outcome.features.len())));
    }
    let mut pairs = one.features.iter().zip(&other.features).enumerate();
    let (at, (a, b)) = pairs.find(|(_, (a, b))| a != b)?;
    Some([a, b].map(|observed| format!("feature {} {}", at + 1, describe_observed(observed))))
}

fn describe_observed(observed: &Observed) -> String {
    match observed {
        Observed::Value(found) => {
            let apart = [("spread", found.spread), ("below the strongest by (dB)", found.below_db)];
            let apart = apart.iter().filter(|(_, value)| *value != 0.0);
            let apart: String = apart.map(|(name, value)| format!(", {name} {value:?}")).collect();
            format!("{:?}{apart}", found.value)
        }
        Observed::Missing(why) => format!("missing ({why})"),
    }
}

// A resumed fit repeats some evaluations of its journal and refuses the journal if they differ.

/// Repeats a sample of the evaluations in the resumed journal and compares every bit of the results.
pub(super) fn recheck_sample(objective: &Objective, context: &FitContext, seed: u64) -> Result<(), FitError> {
    let Some((file, journal)) = context.resume else { return Ok(()) };
    let records = journal.records.len();
    // the sample changes as the journal grows
    let places = sample_records(records, seed.wrapping_add(records as u64));
    let checked: Vec<Result<(), CheckpointError>> =
        places.into_par_iter().map(|place| recheck_record(objective, file, journal, place)).collect();
    Ok(checked.into_iter().collect::<Result<(), _>>()?)
}

/// Repeats the evaluation at a point, if the resumed journal contains it.
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
