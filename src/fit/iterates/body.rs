//! What the header of a trace fit's journal says.

use crate::blade::parameters;
use crate::fit::trace::{CameraUnknown, TraceUnknown, UnknownKind};
use crate::journal::ExactNumber;
use crate::math;
use serde::{Deserialize, Serialize};

/// What the header of a trace fit says besides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TraceHeaderBody {
    /// Seed of the job.
    pub seed: u64,
    /// Names of the recordings, in the order of their numbers.
    pub recordings: Vec<String>,
    /// Length of the segments in each stage, s.
    pub segment_s: Vec<ExactNumber>,
    /// What is estimated, in the order of the coordinates.
    pub unknowns: Vec<HeaderCoordinate>,
}

/// Something that is estimated, and what its coordinate means.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeaderCoordinate {
    /// Key of the scene, or the recording and what of its camera.
    pub name: String,
    /// Unit of its value.
    pub unit: String,
    /// Length of a unit of the coordinate; absent where the coordinate is the logarithm of the value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_unit: Option<ExactNumber>,
    /// Range of the coordinate.
    pub range: [ExactNumber; 2],
    /// Mean and standard deviation of the prior of the coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<[ExactNumber; 2]>,
}

impl HeaderCoordinate {
    /// An unknown of a fit to these recordings.
    #[must_use]
    pub fn from_unknown(unknown: &TraceUnknown, recordings: &[String]) -> Self {
        let (name, unit) = match &unknown.kind {
            UnknownKind::Parameter { name, .. } => {
                (name.clone(), parameters::find_parameter(name).map_or("1", |row| row.unit).to_owned())
            }
            UnknownKind::Camera { film, what } => {
                let recording = recordings.get(*film).map_or("", String::as_str);
                (
                    format!("{recording}: {}", camera_unknown_name(*what)),
                    camera_unknown_unit(*what).to_owned(),
                )
            }
        };
        let is_logarithm = matches!(unknown.kind, UnknownKind::Parameter { unit: None, .. });
        Self {
            name,
            unit,
            per_unit: (!is_logarithm).then(|| ExactNumber(unknown.slope(0.0))),
            range: unknown.range.map(ExactNumber),
            prior: unknown.prior.map(|prior| prior.map(ExactNumber)),
        }
    }

    /// The value at a coordinate, in its unit.
    #[must_use]
    pub fn value(&self, coordinate: f64) -> f64 {
        self.per_unit.map_or_else(|| math::exp(coordinate), |unit| coordinate * unit.0)
    }
}

/// Key of a number of a camera in files, its unit included.
#[must_use]
pub fn camera_unknown_name(what: CameraUnknown) -> &'static str {
    match what {
        CameraUnknown::OffsetX => "offset_x_m",
        CameraUnknown::OffsetDrop => "offset_drop_m",
        CameraUnknown::DriftX => "drift_x_m_per_s",
        CameraUnknown::DriftDrop => "drift_drop_m_per_s",
        CameraUnknown::Scale => "scale_relative",
        CameraUnknown::Tilt => "tilt_rad",
        CameraUnknown::Clock => "clock_s",
    }
}

fn camera_unknown_unit(what: CameraUnknown) -> &'static str {
    match what {
        CameraUnknown::OffsetX | CameraUnknown::OffsetDrop => "m",
        CameraUnknown::DriftX | CameraUnknown::DriftDrop => "m/s",
        CameraUnknown::Scale => "1",
        CameraUnknown::Tilt => "rad",
        CameraUnknown::Clock => "s",
    }
}
