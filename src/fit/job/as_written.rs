//! job.toml as people write it: types and keys only, nothing checked against anything else.

use super::super::scale::Spacing;
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    pub format: u32,
    pub title: String,
    pub scene: String,
    pub seed: u64,
    #[serde(default)]
    pub recording: Vec<Recording>,
    pub camera: Option<Camera>,
    #[serde(default)]
    pub parameter: Vec<Parameter>,
    #[serde(default)]
    pub component: Vec<Component>,
    #[serde(default)]
    pub feature: Vec<Feature>,
    pub search: Search,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    pub path: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    pub frame_rate_hz: f64,
    pub exposure_s: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    pub name: String,
    pub lower: f64,
    pub upper: f64,
    pub scale: Spacing,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    pub name: String,
    pub channel: String,
    pub window: String,
    pub band_hz: [f64; 2],
    pub detrend: Option<String>,
    pub target_hz: Option<f64>,
    pub target_sd_hz: Option<f64>,
    pub tolerance_relative: Option<f64>,
    pub recording: Option<usize>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    ReleaseAfterReversal,
    MeanDeflection,
    Rms,
    Amplitude,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    pub kind: Kind,
    pub name: Option<String>,
    pub channel: Option<String>,
    pub window: Option<String>,
    pub band_hz: Option<[f64; 2]>,
    pub detrend: Option<String>,
    pub reversal: Option<usize>,
    pub sd_relative: Option<f64>,
    pub target: Option<f64>,
    pub target_sd: Option<f64>,
    pub recording: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    pub global_evaluations: usize,
    pub local_evaluations: usize,
    pub particles: Option<usize>,
    pub stagnation_generations: Option<usize>,
}
