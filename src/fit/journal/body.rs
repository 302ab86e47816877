//! What the header of a fit's journal says: what each number of a line means, and what it is held against.

use crate::feature::{Length, Measure};
use crate::fit::axis::{Axis, Prior};
use crate::fit::calibration::Calibration;
use crate::fit::scale::{Bounds, Spacing};
use crate::fit::target::Target;
use crate::journal::Exact;
use serde::{Deserialize, Serialize};

/// What the header of a fit says besides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Seed of the search.
    pub seed: u64,
    /// Free parameters, in the order of the coordinates.
    pub parameters: Vec<Parameter>,
    /// Targets, in the order of the features.
    pub features: Vec<Aimed>,
}

/// A free parameter in a header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "ParameterRow", into = "ParameterRow")]
pub struct Parameter {
    /// Name in the job.
    pub name: String,
    /// Unit as shown; `1` for a plain number.
    pub unit: String,
    /// Its range, from which its values follow, and what is known of it beforehand.
    pub axis: Axis,
}

/// A feature in a header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "FeatureRow", into = "FeatureRow")]
pub struct Aimed {
    /// Name in the job.
    pub name: String,
    /// Unit in files; `1` for a plain number.
    pub unit: String,
    /// What it should be.
    pub target: Target,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterRow {
    name: String,
    unit: String,
    lower: Exact,
    upper: Exact,
    scale: Spacing,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    prior: Option<PriorRow>,
}

/// Of the parameter, or of its logarithm where its scale is one.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PriorRow {
    mean: Exact,
    sd: Exact,
}

impl From<Parameter> for ParameterRow {
    fn from(Parameter { name, unit, axis: Axis { bounds, prior } }: Parameter) -> Self {
        let prior = prior.map(|prior| match prior {
            Prior::Linear { mean, sd } => PriorRow { mean: Exact(mean), sd: Exact(sd) },
            Prior::Log { mean_ln, sd_ln } => PriorRow { mean: Exact(mean_ln), sd: Exact(sd_ln) },
        });
        let [lower, upper] = [bounds.lower(), bounds.upper()].map(Exact);
        Self { name, unit, lower, upper, scale: bounds.spacing(), prior }
    }
}

impl TryFrom<ParameterRow> for Parameter {
    type Error = String;

    fn try_from(row: ParameterRow) -> Result<Self, String> {
        let ParameterRow { name, unit, lower, upper, scale, prior } = row;
        let bounds = Bounds::new(lower.0, upper.0, scale).map_err(|error| format!("`{name}`: {error}"))?;
        let prior = prior.map(|PriorRow { mean, sd }| match scale {
            Spacing::Linear => Prior::Linear { mean: mean.0, sd: sd.0 },
            Spacing::Log => Prior::Log { mean_ln: mean.0, sd_ln: sd.0 },
        });
        Ok(Self { name, unit, axis: Axis { bounds, prior } })
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FeatureRow {
    name: String,
    unit: String,
    target: Exact,
    sd: Exact,
    /// Size of a large difference, where it is differences that are compared and not ratios.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    large_difference: Option<Exact>,
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
    scale_sd: Exact,
    offset_sd_m: Exact,
    /// Of a size, what was added to it in quadrature; none of a place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    floor_m: Option<Exact>,
}

impl From<Calibration> for CameraRow {
    fn from(Calibration { condition, scale_sd, offset_sd_m, length }: Calibration) -> Self {
        let floor_m = match length {
            Length::Place => None,
            Length::Size { floor_m } => Some(Exact(floor_m)),
        };
        let [scale_sd, offset_sd_m] = [scale_sd, offset_sd_m].map(Exact);
        Self { condition: condition + 1, scale_sd, offset_sd_m, floor_m }
    }
}

impl From<CameraRow> for Calibration {
    fn from(CameraRow { condition, scale_sd, offset_sd_m, floor_m }: CameraRow) -> Self {
        let length = floor_m.map_or(Length::Place, |floor_m| Length::Size { floor_m: floor_m.0 });
        let condition = condition.saturating_sub(1);
        Self { condition, scale_sd: scale_sd.0, offset_sd_m: offset_sd_m.0, length }
    }
}

impl From<Aimed> for FeatureRow {
    fn from(Aimed { name, unit, target }: Aimed) -> Self {
        let Target { value, sd, measure, last, calibration, .. } = target;
        let large_difference = match measure {
            Measure::Log => None,
            Measure::Linear { scale } => Some(Exact(scale)),
        };
        let camera = calibration.map(CameraRow::from);
        let (target, sd) = (Exact(value), Exact(sd));
        Self { name, unit, target, sd, large_difference, last_stage: last, camera }
    }
}

impl From<FeatureRow> for Aimed {
    fn from(row: FeatureRow) -> Self {
        let FeatureRow { name, unit, target, sd, large_difference, last_stage: last, camera } = row;
        let measure = large_difference.map_or(Measure::Log, |scale| Measure::Linear { scale: scale.0 });
        let target = Target {
            name: name.clone(),
            value: target.0,
            sd: sd.0,
            scatter: 0.0,
            measure,
            last,
            calibration: camera.map(Calibration::from),
        };
        Self { name, unit, target }
    }
}
