//! scene.toml as people write it: tables and types only, nothing checked against anything else.

use super::contact::{Jam, Loss};
use super::output::Output;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

pub(super) type Numbers = BTreeMap<String, Spanned<f64>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub(super) format: u32,
    pub(super) title: String,
    pub(super) blade: Numbers,
    pub(super) shoulder: Option<Numbers>,
    pub(super) friction: Numbers,
    pub(super) drive: DriveFile,
    #[serde(default)]
    pub(super) contact: ContactFile,
    #[serde(default)]
    pub(super) start: StartFile,
    pub(super) run: RunFile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriveFile {
    pub(super) amplitude_m: Option<Spanned<f64>>,
    pub(super) frequency_hz: Option<Spanned<f64>>,
    pub(super) delay_s: Option<Spanned<f64>>,
    pub(super) recording: Option<Spanned<String>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct ContactFile {
    #[serde(default)]
    pub(super) loss: Loss,
    #[serde(default)]
    pub(super) jam: Jam,
    pub(super) restitution: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub(super) enum StartWord {
    #[default]
    Upright,
    SteadySlide,
    State,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct StartFile {
    #[serde(default)]
    pub(super) time_s: f64,
    #[serde(default)]
    pub(super) kind: StartWord,
    pub(super) neck_angle_rad: Option<f64>,
    pub(super) lip_angle_rad: Option<f64>,
    pub(super) neck_rate_rad_per_s: Option<f64>,
    pub(super) lip_rate_rad_per_s: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RunFile {
    pub(super) stop_s: f64,
    pub(super) sample_rate_hz: f64,
    pub(super) relative_tolerance: Option<f64>,
    pub(super) most_evaluations: Option<u64>,
    pub(super) outputs: Option<Vec<Output>>,
}
