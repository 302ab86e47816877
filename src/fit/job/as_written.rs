//! job.toml as people write it: types and keys only, nothing checked against anything else.

use super::super::scale::Spacing;
use crate::feature::{Keys, define_entry, with_reading_keys};
use crate::toml_file::Pair;
use crate::twin::Camera;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    pub format: u32,
    pub title: String,
    pub scene: String,
    pub seed: u64,
    pub ensemble: Option<Ensemble>,
    #[serde(default)]
    pub recording: Vec<Recording>,
    #[serde(default)]
    pub condition: Vec<Condition>,
    pub camera: Option<Camera>,
    #[serde(default)]
    pub parameter: Vec<Parameter>,
    pub nuisance: Option<Nuisance>,
    #[serde(default)]
    pub trace: Vec<Trace>,
    pub plausible: Option<Plausible>,
    #[serde(default)]
    pub component: Vec<Component>,
    #[serde(default)]
    pub feature: Vec<Feature>,
    pub search: Option<Search>,
    pub intervals: Option<Intervals>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ensemble {
    pub members: Option<usize>,
    pub spread: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    pub name: Option<String>,
    pub path: String,
    pub scene: Option<String>,
    #[serde(default)]
    pub set: toml::Table,
    #[serde(default)]
    pub held_out: bool,
    pub camera: Option<RecordingCamera>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    pub name: String,
    pub scene: Option<String>,
    #[serde(default)]
    pub set: toml::Table,
    #[serde(default)]
    pub held_out: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    pub name: String,
    pub lower: f64,
    pub upper: f64,
    pub scale: Spacing,
    pub prior: Option<Prior>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prior {
    pub mean: f64,
    pub sd: Option<f64>,
    pub sd_relative: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plausible {
    pub largest_tilt_deg: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    pub name: String,
    pub channel: String,
    pub window: String,
    pub band_hz: Pair,
    pub detrend: Option<String>,
    pub target_hz: Option<f64>,
    pub target_sd_hz: Option<f64>,
    pub tolerance_relative: Option<f64>,
    pub recording: Option<Which>,
}

with_reading_keys!(define_entry {
    Feature {
        name: Option<String>,
        sd_relative: Option<f64>,
        target: Option<f64>,
        target_sd: Option<f64>,
        recording: Option<Which>,
    }
});

impl Component {
    pub fn keys(&self) -> Keys {
        Keys {
            channel: Some(self.channel.clone()),
            window: Some(self.window.clone()),
            band_hz: Some(self.band_hz),
            detrend: self.detrend.clone(),
            ..Keys::default()
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Search {
    pub global_evaluations: Option<usize>,
    pub local_evaluations: Option<usize>,
    pub particles: Option<usize>,
    pub stagnation_generations: Option<usize>,
    pub starts: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intervals {
    pub profile: Option<bool>,
    pub bootstrap: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trace {
    pub recording: Option<Which>,
    pub channels: Option<Vec<String>>,
    pub segment_s: Option<Vec<f64>>,
    pub window: Option<String>,
    pub noise_m: Option<f64>,
    pub drive: Option<String>,
    #[serde(default)]
    pub camera: TraceCamera,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TraceCamera {
    pub tilt_sd_deg: Option<f64>,
    pub scale_sd: Option<f64>,
    pub offset_sd_m: Option<f64>,
    pub drift_sd_m_per_s: Option<f64>,
    pub clock_sd_s: Option<f64>,
}

/// The camera of a recording from which features are read: `"exact"`, or what is not known of it.
#[derive(Debug)]
pub enum RecordingCamera {
    Word(String),
    Doubt(TraceCamera),
}

impl<'de> Deserialize<'de> for RecordingCamera {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RecordingCameraVisitor)
    }
}

struct RecordingCameraVisitor;

impl<'de> Visitor<'de> for RecordingCameraVisitor {
    type Value = RecordingCamera;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"exact\", or a table such as { scale_sd = 0.005, offset_sd_m = 0.001 }")
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<RecordingCamera, E> {
        Ok(RecordingCamera::Word(value.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RecordingCamera, A::Error> {
        TraceCamera::deserialize(MapAccessDeserializer::new(map)).map(RecordingCamera::Doubt)
    }
}

/// Constants that are freed with a prior: all of them with one deviation, or those of a list.
#[derive(Debug)]
pub enum Nuisance {
    All(String),
    Listed(Vec<ListedNuisance>),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedNuisance {
    pub name: String,
    pub sd: Option<String>,
    pub sd_relative: Option<f64>,
}

impl<'de> Deserialize<'de> for Nuisance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NuisanceVisitor)
    }
}

struct NuisanceVisitor;

impl<'de> Visitor<'de> for NuisanceVisitor {
    type Value = Nuisance;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a percentage such as \"3 %\", or a list such as [{ name = \"blade.lip_mass_kg\", sd = \"5 %\" }]")
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Nuisance, E> {
        Ok(Nuisance::All(value.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Nuisance, A::Error> {
        let mut listed = Vec::new();
        while let Some(one) = list.next_element()? {
            listed.push(one);
        }
        Ok(Nuisance::Listed(listed))
    }
}

/// A recording or condition by its number, counted from 1, or its name.
#[derive(Debug)]
pub enum Which {
    Number(usize),
    Name(String),
}

impl<'de> Deserialize<'de> for Which {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WhichVisitor)
    }
}

struct WhichVisitor;

impl Visitor<'_> for WhichVisitor {
    type Value = Which;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the number of a recording, counted from 1, or its name")
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Which, E> {
        // one below 1 is no number of a recording either way, and 0 is refused with the numbers that there
        // are
        Ok(Which::Number(usize::try_from(value).unwrap_or(0)))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Which, E> {
        Ok(Which::Name(value.to_owned()))
    }
}
