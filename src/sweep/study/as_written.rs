//! A study file as written, with its keys and types; the values are checked later.

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
    /// Path of the scene whose parameters vary, relative to this file.
    pub scene: String,
    /// Camera that films every run.
    pub camera: Camera,
    /// Sample of the box that the axes span; a grid if left out.
    pub sample: Option<SamplePlan>,
    /// Parameters that vary.
    #[serde(default)]
    pub axis: Vec<StudyAxisFile>,
    /// Readings that are taken at every point.
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
    /// Number of values, for a grid.
    pub points: Option<usize>,
    /// Spacing of the values; "linear" if left out.
    pub scale: Option<AxisSpacing>,
    /// The values themselves, instead of from, to and points.
    pub values: Option<Vec<f64>>,
}

with_reading_keys!(define_entry {
    "What is read at every point."
    Map {
        /// Name of the map, different from all others.
        name: String,
        /// Values at the ends of the colour scale, in the unit of the map; its extremes if left out.
        range: Option<NumberPair>,
    }
});
