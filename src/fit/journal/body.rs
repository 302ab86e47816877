//! What the header of a fit's journal says: what each number of a line means, and what it is held against.

use crate::feature::{LengthCalibration, ValueComparison};
use crate::fit::axis::{Prior, SearchAxis};
use crate::fit::calibration::TargetCalibration;
use crate::fit::scale::{Bounds, BoundsSpacing};
use crate::fit::target::TargetValue;
use crate::journal::ExactNumber;
use serde::{Deserialize, Serialize};

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
