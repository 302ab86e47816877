//! Recordings and operating conditions of a job: what is simulated, and with which values in place of the
//! scene's.

use super::as_written::RecordingCamera;
use super::{JobRefusal, as_written, check_non_empty, find_repeated, refuse};
use crate::model::parameters;
use crate::toml_file::suggest_key;
use serde::Serialize;

/// Name of the scene itself where a job has neither recordings nor conditions.
pub(crate) const SCENE_ALONE: &str = "scene";

/// What drives the head of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeadSource {
    /// The head of the recording itself.
    Recording,
    /// The drive of the scene.
    Scene,
}

/// An operating condition: a scene, with some values replaced, of which there is a recording or published
/// numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct JobCondition {
    /// Its name, unlike any other of the job.
    pub name: String,
    /// Path of the recording's folder, relative to the job file; `None` where only published numbers are
    /// known.
    pub recording: Option<String>,
    /// Path of its scene, relative to the job file.
    pub scene: String,
    /// What drives its head: the drive of its scene, or its own recording.
    pub head: HeadSource,
    /// Parameters whose values replace those of the scene, in SI units.
    pub set: Vec<(String, f64)>,
    /// Whether it is only predicted, never fitted.
    pub held_out: bool,
    /// What is not known of the camera of a recording, where features are read from it; `None` where only
    /// published numbers are known.
    pub camera: Option<FeatureCamera>,
}

/// Recordings first, then conditions, in the order of the file; the scene alone where there is neither.
pub(super) fn check_conditions(
    written: &as_written::JobFile,
    known: &[&str],
) -> Result<Vec<JobCondition>, JobRefusal> {
    let scene = check_non_empty("scene", &written.scene, "the path of a scene, relative to the job file")?;
    let recordings =
        written.recording.iter().enumerate().map(|(i, r)| check_recording(i + 1, r, &scene, known));
    let published = written.condition.iter().map(|c| check_condition(c, &scene, known));
    let mut found = recordings.chain(published).collect::<Result<Vec<_>, _>>()?;
    if let Some(name) = find_repeated(found.iter().map(|c| c.name.as_str())) {
        return refuse(
            format!("recording or condition `{name}`"),
            "the name is used twice; give each its own `name`",
        );
    }
    if found.is_empty() {
        found.push(JobCondition {
            name: SCENE_ALONE.to_owned(),
            recording: None,
            scene,
            head: HeadSource::Scene,
            set: Vec::new(),
            held_out: false,
            camera: None,
        });
    }
    Ok(found)
}

fn check_recording(
    number: usize,
    written: &as_written::JobRecordingTable,
    scene: &str,
    known: &[&str],
) -> Result<JobCondition, JobRefusal> {
    let entry = format!("recording {number}");
    let path = check_non_empty(
        &format!("{entry}, `path`"),
        &written.path,
        "the folder of a recording, relative to the job file",
    )?;
    let name = written.name.clone().unwrap_or_else(|| entry.clone());
    let name = check_non_empty(&format!("{entry}, `name`"), &name, "a name, or no such key")?;
    let scene = scene_path(&entry, written.scene.as_deref(), scene)?;
    let driven = written
        .drive
        .as_deref()
        .map(|word| parse_head_source(format!("{entry}, `drive`"), word))
        .transpose()?;
    Ok(JobCondition {
        name,
        recording: Some(path),
        scene,
        head: driven.unwrap_or(HeadSource::Scene),
        set: parse_set_values(&entry, &written.set, known)?,
        held_out: written.held_out,
        camera: Some(check_feature_camera(&entry, written.camera.as_ref())?),
    })
}

fn check_condition(
    written: &as_written::JobConditionTable,
    scene: &str,
    known: &[&str],
) -> Result<JobCondition, JobRefusal> {
    let name = check_non_empty("condition, `name`", &written.name, "a name such as \"slow\"")?;
    let entry = format!("condition `{name}`");
    let scene = scene_path(&entry, written.scene.as_deref(), scene)?;
    Ok(JobCondition {
        name,
        recording: None,
        scene,
        head: HeadSource::Scene,
        set: parse_set_values(&entry, &written.set, known)?,
        held_out: written.held_out,
        camera: None,
    })
}

fn scene_path(entry: &str, own: Option<&str>, scene: &str) -> Result<String, JobRefusal> {
    own.map_or_else(
        || Ok(scene.to_owned()),
        |own| {
            check_non_empty(
                &format!("{entry}, `scene`"),
                own,
                "the path of a scene, relative to the job file",
            )
        },
    )
}

/// What drives a head, in the word of the file.
pub(super) fn parse_head_source(key: String, word: &str) -> Result<HeadSource, JobRefusal> {
    match word {
        "recording" => Ok(HeadSource::Recording),
        "scene" => Ok(HeadSource::Scene),
        _ => refuse(
            key,
            format!("found \"{word}\", expected \"recording\" (its own head drives the model) or \"scene\""),
        ),
    }
}

/// Values by parameter name; `"drive.frequency_hz" = 0.5` and `drive.frequency_hz = 0.5` say the same.
fn parse_set_values(
    entry: &str,
    written: &toml::Table,
    known: &[&str],
) -> Result<Vec<(String, f64)>, JobRefusal> {
    let mut values = Vec::new();
    for (name, value) in written {
        match value {
            toml::Value::Table(table) => {
                values.extend(table.iter().map(|(key, value)| (format!("{name}.{key}"), value)))
            }
            value => values.push((name.clone(), value)),
        }
    }
    if let Some(name) = find_repeated(values.iter().map(|(name, _)| name.as_str())) {
        return refuse(format!("{entry}, `set`"), format!("found `{name}` twice; remove one of them"));
    }
    values
        .into_iter()
        .map(|(name, value)| parse_set_number(entry, &name, value, known).map(|value| (name, value)))
        .collect()
}

fn parse_set_number(entry: &str, name: &str, value: &toml::Value, known: &[&str]) -> Result<f64, JobRefusal> {
    let key = format!("{entry}, `set`, `{name}`");
    if !known.contains(&name) {
        return refuse(key, format!("not a parameter of a scene; {}", suggest_key(name, known)));
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
pub(crate) fn is_same_quantity(a: &str, b: &str) -> bool {
    let quantity = |name: &str| parameters::find_parameter(name).map(|row| row.quantity);
    a == b || quantity(a).is_some_and(|found| quantity(b) == Some(found))
}

/// A parameter that the search moves cannot be held by a condition as well.
pub(super) fn check_not_set(conditions: &[JobCondition], free: &str) -> Result<(), JobRefusal> {
    let held = conditions
        .iter()
        .find_map(|c| c.set.iter().find(|(name, _)| is_same_quantity(name, free)).map(|(name, _)| (c, name)));
    held.map_or(Ok(()), |(condition, name)| {
        let problem = format!(
            "found free while `{}` sets `{name}`; remove the [[parameter]], or the value from `set`",
            condition.name
        );
        refuse(format!("parameter `{free}`"), problem)
    })
}

// What is not known of cameras: what those of features and of traces have in common, and those of features.

/// Relative standard deviation of the scale unless the job says otherwise: a scale bar of 20 mm that is read
/// to a tenth of a millimetre.
pub(super) const DEFAULT_SCALE_SD: f64 = 0.005;
/// Largest of it: a scale that is known worse is not a calibration.
pub(super) const MAX_SCALE_SD: f64 = 0.1;
/// Standard deviation of the places of both markers unless the job says otherwise, m: nobody's marker sits on
/// the hinge to better than a millimetre.
pub(super) const DEFAULT_OFFSET_SD_M: f64 = 1e-3;
/// Largest of it, m: the length of a blade.
pub(super) const MAX_OFFSET_SD_M: f64 = 0.1;

/// Standard deviations of what is not known of the camera of a recording from which features are read; one
/// that is 0 is held at its nominal value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FeatureCamera {
    /// Of the scale, relative.
    pub scale_sd: f64,
    /// Of the place of the tip's marker against the head's along the sweep, m.
    pub offset_sd_m: f64,
}

impl FeatureCamera {
    /// One of which everything is known.
    pub(crate) const EXACT: Self = Self { scale_sd: 0.0, offset_sd_m: 0.0 };
    const USUAL: Self = Self { scale_sd: DEFAULT_SCALE_SD, offset_sd_m: DEFAULT_OFFSET_SD_M };
}

/// The camera of the recording `entry`, such as `recording 1`.
pub(super) fn check_feature_camera(
    entry: &str,
    written: Option<&RecordingCamera>,
) -> Result<FeatureCamera, JobRefusal> {
    let table = match written {
        None => return Ok(FeatureCamera::USUAL),
        Some(RecordingCamera::Word(word)) if word == "exact" => return Ok(FeatureCamera::EXACT),
        Some(RecordingCamera::Word(word)) => {
            return refuse(
                format!("{entry}, `camera`"),
                format!(
                    "found \"{word}\", expected \"exact\", or a table such as {{ offset_sd_m = 0.0005 }}"
                ),
            );
        }
        Some(RecordingCamera::Doubt(table)) => table,
    };
    let key = |key: &str| format!("{entry}, `camera.{key}`");
    let as_written::JobTraceCameraTable { tilt_sd_deg, scale_sd, offset_sd_m, drift_sd_m_per_s, clock_sd_s } =
        table;
    let of_traces = [
        (
            "tilt_sd_deg",
            tilt_sd_deg,
            "which the offset covers: a tilt moves the tip against the head by the height of the blade times \
             the angle; enlarge `offset_sd_m` and remove it",
        ),
        (
            "drift_sd_m_per_s",
            drift_sd_m_per_s,
            "whose offset is one for the whole recording; enlarge `offset_sd_m`, or fit the recording as a [[trace]]",
        ),
        ("clock_sd_s", clock_sd_s, "which find their instants in each recording by itself; remove it"),
    ];
    for (name, found, why) in of_traces {
        if found.is_some() {
            return refuse(key(name), format!("found in the camera of features, {why}"));
        }
    }
    Ok(FeatureCamera {
        scale_sd: check_camera_sd(key("scale_sd"), *scale_sd, MAX_SCALE_SD)?.unwrap_or(DEFAULT_SCALE_SD),
        offset_sd_m: check_camera_sd(key("offset_sd_m"), *offset_sd_m, MAX_OFFSET_SD_M)?
            .unwrap_or(DEFAULT_OFFSET_SD_M),
    })
}

/// A job with traces has its cameras there.
pub(super) fn check_no_camera_with_traces(written: &as_written::JobFile) -> Result<(), JobRefusal> {
    let both = (1..).zip(&written.recording).find(|(_, r)| !written.trace.is_empty() && r.camera.is_some());
    match both {
        None => Ok(()),
        Some((number, _)) => refuse(
            format!("recording {number}, `camera`"),
            "found in a job with a [[trace]], which estimates its camera frame by frame; write it as \
             [trace.camera], or remove it",
        ),
    }
}

/// A standard deviation of a camera's number, where it is written.
pub(super) fn check_camera_sd(key: String, found: Option<f64>, most: f64) -> Result<Option<f64>, JobRefusal> {
    match found {
        Some(sd) if !(0.0..=most).contains(&sd) => {
            refuse(key, format!("found {sd}, expected 0 (held) to {most}"))
        }
        found => Ok(found),
    }
}
