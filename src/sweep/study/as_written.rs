//! sweep.toml as people write it: types and keys only, nothing checked against anything else.

use crate::feature::{define_entry, with_reading_keys};
use crate::sweep::grid::Spacing;
use crate::sweep::sample::Sample;
use crate::toml_file::Pair;
use crate::twin::Camera;
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    pub format: u32,
    pub title: String,
    pub scene: String,
    pub camera: Camera,
    pub sample: Option<Sample>,
    #[serde(default)]
    pub axis: Vec<Axis>,
    #[serde(default)]
    pub map: Vec<Map>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    pub name: String,
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub points: Option<usize>,
    pub scale: Option<Spacing>,
    pub values: Option<Vec<f64>>,
}

with_reading_keys!(define_entry {
    Map {
        name: String,
        range: Option<Pair>,
    }
});
