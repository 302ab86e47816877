//! A study file as written: types and keys; values are checked later.

use crate::feature::{define_entry, with_reading_keys};
use crate::simulate::twin::Camera;
use crate::sweep::grid::{AxisSpacing, SamplePlan};
use crate::toml_file::NumberPair;
use schemars::JsonSchema;
use serde::Deserialize;

/// A parameter study.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "study.toml")]
pub(crate) struct StudyFile {
    /// Version of the format: 1.
    pub format: u32,
    /// Title for pages and figures.
    pub title: String,
    /// Scene whose parameters vary; relative to this file.
    pub scene: String,
    /// Camera through which every run is seen.
    pub camera: Camera,
    /// Points drawn from the box of the axes; a grid if left out.
    pub sample: Option<SamplePlan>,
    /// What varies.
    #[serde(default)]
    pub axis: Vec<StudyAxisFile>,
    /// What is read at every point.
    #[serde(default)]
    pub map: Vec<Map>,
}

/// A parameter that varies.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StudyAxisFile {
    /// Key of the scene with its table, such as "friction.a".
    pub name: String,
    /// First value, SI.
    pub from: Option<f64>,
    /// Last value, SI.
    pub to: Option<f64>,
    /// Number of values of a grid.
    pub points: Option<usize>,
    /// How the values lie; "linear" if left out.
    pub scale: Option<AxisSpacing>,
    /// The values themselves, in place of from, to and points.
    pub values: Option<Vec<f64>>,
}

with_reading_keys!(define_entry {
    "What is read at every point."
    Map {
        /// Different from every other map.
        name: String,
        /// Ends of the colours, in the unit of the map; from the values if left out.
        range: Option<NumberPair>,
    }
});
