//! Recordings and operating conditions of a job: what is simulated, and with which values in place of the
//! scene's.

use super::as_written;
use super::cameras::{FeatureCamera, camera};
use super::refusal::{Refusal, non_empty, refuse, repeated};
use crate::blade::parameters;
use crate::toml_file::nearest;
use serde::Serialize;

/// Name of the scene itself where a job has neither recordings nor conditions.
pub(crate) const SCENE_ALONE: &str = "scene";

/// What drives the head of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Head {
    /// The head of the recording itself.
    Recording,
    /// The drive of the scene.
    Scene,
}

/// An operating condition: a scene, with some values replaced, of which there is a recording or published
/// numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its name, unlike any other of the job.
    pub name: String,
    /// Path of the recording's folder, relative to the job file; `None` where only published numbers are
    /// known.
    pub recording: Option<String>,
    /// Path of its scene, relative to the job file.
    pub scene: String,
    /// What drives its head: the drive of its scene, or its own recording.
    pub head: Head,
    /// Parameters whose values replace those of the scene, in SI units.
    pub set: Vec<(String, f64)>,
    /// Whether it is only predicted, never fitted.
    pub held_out: bool,
    /// What is not known of the camera of a recording, where features are read from it; `None` where only
    /// published numbers are known.
    pub camera: Option<FeatureCamera>,
}

/// Recordings first, then conditions, in the order of the file; the scene alone where there is neither.
pub(super) fn conditions(written: &as_written::Job, known: &[&str]) -> Result<Vec<Condition>, Refusal> {
    let scene = non_empty("scene", &written.scene, "the path of a scene, relative to the job file")?;
    let recordings = written.recording.iter().enumerate().map(|(i, r)| recorded(i + 1, r, &scene, known));
    let published = written.condition.iter().map(|c| published(c, &scene, known));
    let mut found = recordings.chain(published).collect::<Result<Vec<_>, _>>()?;
    if let Some(name) = repeated(found.iter().map(|c| c.name.as_str())) {
        return refuse(
            format!("recording or condition `{name}`"),
            "the name is used twice; give each its own `name`",
        );
    }
    if found.is_empty() {
        found.push(Condition {
            name: SCENE_ALONE.to_owned(),
            recording: None,
            scene,
            head: Head::Scene,
            set: Vec::new(),
            held_out: false,
            camera: None,
        });
    }
    Ok(found)
}

fn recorded(
    number: usize,
    written: &as_written::Recording,
    scene: &str,
    known: &[&str],
) -> Result<Condition, Refusal> {
    let entry = format!("recording {number}");
    let path = non_empty(
        &format!("{entry}, `path`"),
        &written.path,
        "the folder of a recording, relative to the job file",
    )?;
    let name = written.name.clone().unwrap_or_else(|| entry.clone());
    let name = non_empty(&format!("{entry}, `name`"), &name, "a name, or no such key")?;
    let scene = own_scene(&entry, written.scene.as_deref(), scene)?;
    let driven = written.drive.as_deref().map(|word| head(format!("{entry}, `drive`"), word)).transpose()?;
    Ok(Condition {
        name,
        recording: Some(path),
        scene,
        head: driven.unwrap_or(Head::Scene),
        set: set(&entry, &written.set, known)?,
        held_out: written.held_out,
        camera: Some(camera(&entry, written.camera.as_ref())?),
    })
}

fn published(written: &as_written::Condition, scene: &str, known: &[&str]) -> Result<Condition, Refusal> {
    let name = non_empty("condition, `name`", &written.name, "a name such as \"slow\"")?;
    let entry = format!("condition `{name}`");
    let scene = own_scene(&entry, written.scene.as_deref(), scene)?;
    Ok(Condition {
        name,
        recording: None,
        scene,
        head: Head::Scene,
        set: set(&entry, &written.set, known)?,
        held_out: written.held_out,
        camera: None,
    })
}

fn own_scene(entry: &str, own: Option<&str>, scene: &str) -> Result<String, Refusal> {
    own.map_or_else(
        || Ok(scene.to_owned()),
        |own| non_empty(&format!("{entry}, `scene`"), own, "the path of a scene, relative to the job file"),
    )
}

/// What drives a head, in the word of the file.
pub(super) fn head(key: String, word: &str) -> Result<Head, Refusal> {
    match word {
        "recording" => Ok(Head::Recording),
        "scene" => Ok(Head::Scene),
        _ => refuse(
            key,
            format!("found \"{word}\", expected \"recording\" (its own head drives the model) or \"scene\""),
        ),
    }
}

/// Values by parameter name; `"drive.frequency_hz" = 0.5` and `drive.frequency_hz = 0.5` say the same.
fn set(entry: &str, written: &toml::Table, known: &[&str]) -> Result<Vec<(String, f64)>, Refusal> {
    let mut values = Vec::new();
    for (name, value) in written {
        match value {
            toml::Value::Table(table) => {
                values.extend(table.iter().map(|(key, value)| (format!("{name}.{key}"), value)))
            }
            value => values.push((name.clone(), value)),
        }
    }
    if let Some(name) = repeated(values.iter().map(|(name, _)| name.as_str())) {
        return refuse(format!("{entry}, `set`"), format!("found `{name}` twice; remove one of them"));
    }
    values
        .into_iter()
        .map(|(name, value)| number(entry, &name, value, known).map(|value| (name, value)))
        .collect()
}

fn number(entry: &str, name: &str, value: &toml::Value, known: &[&str]) -> Result<f64, Refusal> {
    let key = format!("{entry}, `set`, `{name}`");
    if !known.contains(&name) {
        return refuse(key, format!("not a parameter of a scene; {}", nearest(name, known)));
    }
    let number = value
        .as_float()
        .or_else(|| value.as_integer().map(|whole| whole as f64))
        .filter(|number| number.is_finite());
    number.map_or_else(
        || refuse(key, format!("found {value}, expected a finite number in the parameter's SI unit")),
        Ok,
    )
}

/// Whether two names set the same quantity, however each writes it.
pub(crate) fn same_quantity(a: &str, b: &str) -> bool {
    let quantity = |name: &str| parameters::find(name).map(|row| row.quantity);
    a == b || quantity(a).is_some_and(|found| quantity(b) == Some(found))
}

/// A parameter that the search moves cannot be held by a condition as well.
pub(super) fn check_free(conditions: &[Condition], free: &str) -> Result<(), Refusal> {
    let held = conditions
        .iter()
        .find_map(|c| c.set.iter().find(|(name, _)| same_quantity(name, free)).map(|(name, _)| (c, name)));
    held.map_or(Ok(()), |(condition, name)| {
        let problem = format!(
            "found free while `{}` sets `{name}`; remove the [[parameter]], or the value from `set`",
            condition.name
        );
        refuse(format!("parameter `{free}`"), problem)
    })
}
