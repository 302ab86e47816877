//! Recordings and operating conditions of a job: the scene of each, and the values that replace those
//! of the scene.

use super::KeyRefusal;
use super::as_written::{self, RecordingCamera};
use super::checks::{check_non_empty, find_repeated};
use crate::model::parameters;
use crate::toml_file::suggest_key;
use serde::Serialize;

/// Name of the only condition of a job that has neither recordings nor conditions.
pub(crate) const SCENE_ALONE: &str = "scene";

/// Source of the head's motion in a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeadSource {
    /// The recorded motion of the head.
    Recording,
    /// The drive of the scene.
    Scene,
}

/// An operating condition: a scene with some values replaced, and either a recording or published numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct JobCondition {
    /// Name, unique in the job.
    pub name: String,
    /// Path of the recording's folder, relative to the job file; `None` if there are only published numbers.
    pub recording: Option<String>,
    /// Path of the scene of the condition, relative to the job file.
    pub scene: String,
    /// Source of the head's motion: the drive of the scene, or the recorded head.
    pub head: HeadSource,
    /// Names of parameters, each with the value, in SI units, that replaces the value in the scene.
    pub set: Vec<(String, f64)>,
    /// Whether the features of the condition are only predicted, never fitted.
    pub held_out: bool,
    /// Standard deviations of scale and offset of the recording's camera; `None` without a recording.
    pub camera: Option<FeatureCamera>,
}

impl JobCondition {
    fn without_recording(name: String, scene: String) -> Self {
        let (head, set) = (HeadSource::Scene, Vec::new());
        Self { name, recording: None, scene, head, set, held_out: false, camera: None }
    }
}

/// Checks recordings, then conditions, each in the order of the file; if there is neither, the scene is
/// the only condition.
pub(super) fn check_conditions(
    written: &as_written::JobFile,
    known: &[&str],
) -> Result<Vec<JobCondition>, KeyRefusal> {
    let scene = check_non_empty("scene", &written.scene, "the path of a scene, relative to the job file")?;
    let recordings =
        written.recording.iter().enumerate().map(|(i, r)| check_recording(i + 1, r, &scene, known));
    let published = written.condition.iter().map(|c| check_condition(c, &scene, known));
    let mut found = recordings.chain(published).collect::<Result<Vec<_>, _>>()?;
    if let Some(name) = find_repeated(found.iter().map(|c| c.name.as_str())) {
        refuse!(
            format!("recording or condition `{name}`"),
            "the name is used twice; give each its own `name`"
        );
    }
    if found.is_empty() {
        found.push(JobCondition::without_recording(SCENE_ALONE.to_owned(), scene));
    }
    Ok(found)
}

fn check_recording(
    number: usize,
    written: &as_written::JobRecordingTable,
    scene: &str,
    known: &[&str],
) -> Result<JobCondition, KeyRefusal> {
    let entry = format!("recording {number}");
    let expected = "the folder of a recording, relative to the job file";
    let path = check_non_empty(&format!("{entry}, `path`"), &written.path, expected)?;
    let name = written.name.clone().unwrap_or_else(|| entry.clone());
    let name = check_non_empty(&format!("{entry}, `name`"), &name, "a name, or no such key")?;
    let scene = scene_path(&entry, written.scene.as_deref(), scene)?;
    let head = parse_head_source(|| format!("{entry}, `drive`"), written.drive.as_deref())?;
    Ok(JobCondition {
        name,
        recording: Some(path),
        scene,
        head: head.unwrap_or(HeadSource::Scene),
        set: parse_set_values(&entry, &written.set, known)?,
        held_out: written.held_out,
        camera: Some(check_feature_camera(&entry, written.camera.as_ref())?),
    })
}

fn check_condition(
    written: &as_written::JobConditionTable,
    scene: &str,
    known: &[&str],
) -> Result<JobCondition, KeyRefusal> {
    let name = check_non_empty("condition, `name`", &written.name, "a name such as \"slow\"")?;
    let entry = format!("condition `{name}`");
    let scene = scene_path(&entry, written.scene.as_deref(), scene)?;
    let set = parse_set_values(&entry, &written.set, known)?;
    Ok(JobCondition { set, held_out: written.held_out, ..JobCondition::without_recording(name, scene) })
}

fn scene_path(entry: &str, own: Option<&str>, scene: &str) -> Result<String, KeyRefusal> {
    let Some(own) = own else { return Ok(scene.to_owned()) };
    check_non_empty(&format!("{entry}, `scene`"), own, "the path of a scene, relative to the job file")
}

/// Parses the value of the key `drive`, `scene` or `recording`.
pub(super) fn parse_head_source(
    key: impl Fn() -> String,
    word: Option<&str>,
) -> Result<Option<HeadSource>, KeyRefusal> {
    let Some(word) = word else { return Ok(None) };
    match word {
        "recording" => Ok(Some(HeadSource::Recording)),
        "scene" => Ok(Some(HeadSource::Scene)),
        _ => refuse!(
            key(),
            "found \"{word}\", expected \"recording\" (its own head drives the model) or \"scene\""
        ),
    }
}

/// Parses a table that maps parameter names to values. The quoted key `"drive.frequency_hz"` and the dotted
/// key `drive.frequency_hz` are equivalent.
fn parse_set_values(
    entry: &str,
    written: &toml::Table,
    known: &[&str],
) -> Result<Vec<(String, f64)>, KeyRefusal> {
    let mut values = Vec::new();
    for (name, value) in written {
        match value {
            toml::Value::Table(of) => values.extend(of.iter().map(|(key, v)| (format!("{name}.{key}"), v))),
            value => values.push((name.clone(), value)),
        }
    }
    if let Some(name) = find_repeated(values.iter().map(|(name, _)| name.as_str())) {
        refuse!(format!("{entry}, `set`"), "found `{name}` twice; remove one of them");
    }
    let parse = |(name, value)| Ok((String::clone(&name), parse_set_number(entry, &name, value, known)?));
    values.into_iter().map(parse).collect()
}

fn parse_set_number(entry: &str, name: &str, value: &toml::Value, known: &[&str]) -> Result<f64, KeyRefusal> {
    let key = format!("{entry}, `set`, `{name}`");
    if !known.contains(&name) {
        refuse!(key, "not a parameter of a scene; {}", suggest_key(name, known));
    }
    match value.as_float().or_else(|| Some(value.as_integer()? as f64)) {
        Some(number) if number.is_finite() => Ok(number),
        _ => refuse!(key, "found {value}, expected a finite number in the parameter's SI unit"),
    }
}

/// Whether two parameter names denote the same quantity, possibly in different forms such as a stiffness and
/// its natural frequency.
pub(crate) fn is_same_quantity(a: &str, b: &str) -> bool {
    let quantity = |name: &str| parameters::find_parameter(name).map(|row| row.quantity);
    a == b || quantity(a).is_some_and(|found| quantity(b) == Some(found))
}

/// Refuses a condition that sets the free parameter `free`.
pub(super) fn check_not_set(conditions: &[JobCondition], free: &str) -> Result<(), KeyRefusal> {
    for JobCondition { name, set, .. } in conditions {
        if let Some((set, _)) = set.iter().find(|(set, _)| is_same_quantity(set, free)) {
            refuse!(
                format!("parameter `{free}`"),
                "found free while `{name}` sets `{set}`; remove the [[parameter]], or the value from `set`"
            );
        }
    }
    Ok(())
}

// Calibration errors of cameras.

/// Default relative standard deviation of a camera's scale: the reading error of a scale bar of 20 mm that is
/// read to a tenth of a millimetre.
pub(super) const DEFAULT_SCALE_SD: f64 = 0.005;
/// Largest allowed relative standard deviation of a camera's scale. A picture with a less certain scale
/// counts as not calibrated.
pub(super) const MAX_SCALE_SD: f64 = 0.1;
/// Default standard deviation, m, of the position of a marker relative to its hinge. It applies to a marker
/// that is placed to a millimetre.
pub(super) const DEFAULT_OFFSET_SD_M: f64 = 1e-3;
/// Largest allowed standard deviation, m, of the position of a marker relative to its hinge: the length of a
/// blade.
pub(super) const MAX_OFFSET_SD_M: f64 = 0.1;

/// Standard deviations of scale and offset of a camera, for a fit of features; 0 fixes the scale or offset at
/// its nominal value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FeatureCamera {
    /// Relative standard deviation of the scale.
    pub scale_sd: f64,
    /// Standard deviation, m, of the offset along the sweep between the markers of tip and head.
    pub offset_sd_m: f64,
}

impl FeatureCamera {
    /// A camera without calibration errors.
    pub(crate) const EXACT: Self = Self { scale_sd: 0.0, offset_sd_m: 0.0 };
}

/// Checks the key `camera` of a recording; `entry` names the recording in error messages, such as `recording
/// 1`.
pub(super) fn check_feature_camera(
    entry: &str,
    written: Option<&RecordingCamera>,
) -> Result<FeatureCamera, KeyRefusal> {
    let usual = as_written::JobTraceCameraTable::default();
    let table = match written {
        None => &usual,
        Some(RecordingCamera::Word(word)) if word == "exact" => return Ok(FeatureCamera::EXACT),
        Some(RecordingCamera::Word(word)) => {
            refuse!(
                format!("{entry}, `camera`"),
                "found \"{word}\", expected \"exact\", or a table such as {{ offset_sd_m = 0.0005 }}"
            );
        }
        Some(RecordingCamera::Doubt(table)) => table,
    };
    let key = |key: &str| format!("{entry}, `camera.{key}`");
    let of_traces = [
        (
            "tilt_sd_deg",
            table.tilt_sd_deg,
            "which the offset covers: a tilt moves the tip against the head by the height of the blade times \
             the angle; enlarge `offset_sd_m` and remove it",
        ),
        (
            "drift_sd_m_per_s",
            table.drift_sd_m_per_s,
            "whose offset is one for the whole recording; enlarge `offset_sd_m`, or fit the recording as a [[trace]]",
        ),
        ("clock_sd_s", table.clock_sd_s, "which find their instants in each recording by itself; remove it"),
    ];
    for (name, found, why) in of_traces {
        if found.is_some() {
            refuse!(key(name), "found in the camera of features, {why}");
        }
    }
    let scale_sd = check_camera_sd(key("scale_sd"), table.scale_sd, MAX_SCALE_SD)?;
    let offset_sd_m = check_camera_sd(key("offset_sd_m"), table.offset_sd_m, MAX_OFFSET_SD_M)?;
    Ok(FeatureCamera {
        scale_sd: scale_sd.unwrap_or(DEFAULT_SCALE_SD),
        offset_sd_m: offset_sd_m.unwrap_or(DEFAULT_OFFSET_SD_M),
    })
}

/// Refuses a camera of a recording in a job with traces, because such a job describes its cameras in each
/// [[trace]].
pub(super) fn check_no_camera_with_traces(written: &as_written::JobFile) -> Result<(), KeyRefusal> {
    let both = (1..).zip(&written.recording).find(|(_, r)| !written.trace.is_empty() && r.camera.is_some());
    match both {
        None => Ok(()),
        Some((number, _)) => refuse!(
            format!("recording {number}, `camera`"),
            "found in a job with a [[trace]], which estimates its camera frame by frame; write it as \
             [trace.camera], or remove it"
        ),
    }
}

/// Checks that the standard deviation of a camera error, if the job gives it, is from 0 to `most`.
pub(super) fn check_camera_sd(key: String, found: Option<f64>, most: f64) -> Result<Option<f64>, KeyRefusal> {
    match found {
        Some(sd) if !(0.0..=most).contains(&sd) => refuse!(key, "found {sd}, expected 0 (held) to {most}"),
        found => Ok(found),
    }
}
