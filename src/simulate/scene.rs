//! Scenes: a blade, its friction, its drive and what is to be computed; `scene.toml` as written and as
//! validated.

mod as_written;
mod linkage;

pub use super::drive::Drive;
use super::drive::head_motion;
use crate::blade::flight::Airborne;
use crate::blade::parameters::{self, PARAMETERS, Parameter};
use crate::blade::{Linkage, Pose};
use crate::recording::Recording;
use crate::toml_file::{self, TomlError};
use as_written::{DriveFile, Numbers, RunFile, SceneFile, StartFile, StartWord};
use linkage::linkage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;
use toml::Spanned;

/// Why a scene was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The file is not TOML of this format.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// A key is unknown, missing, doubled or out of range.
    #[error("{place}: key `{key}`: found {found}, expected {expected}; {advice}")]
    Key {
        /// File, with the line where there is one.
        place: String,
        /// Table and key.
        key: String,
        /// What the file says.
        found: String,
        /// What the key takes.
        expected: String,
        /// What to do.
        advice: String,
    },
    /// The recording that drives the head cannot be read or used.
    #[error("{place}: key `drive.recording`: {problem}")]
    Recording {
        /// File and line.
        place: String,
        /// The recording's own refusal.
        problem: String,
    },
}

/// What happens when the normal force reaches zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// The run ends and says so.
    #[default]
    Stop,
    /// The tip flies and lands.
    Fly,
}

/// What happens when the Painlevé condition fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Jam {
    /// The run ends and says so.
    #[default]
    Stop,
    /// An impact without collision.
    Impact,
}

/// How the blade starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum StartKind {
    /// Upright and at rest.
    Upright,
    /// In the equilibrium of steady slip at the head's speed.
    SteadySlide,
    /// In a given state.
    State(Pose),
    /// In a given state off the glass; not reachable from a scene file, it serves the exact cases.
    Airborne(Airborne),
}

/// What `simulate` writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Output {
    /// `trace.csv`.
    Trace,
    /// `state.csv`.
    State,
    /// `events.csv`.
    Events,
}

/// What is to be computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSettings {
    /// End of the run, s.
    pub stop_s: f64,
    /// Rate of the sampled outputs, 1/s.
    pub sample_rate_hz: f64,
    /// Tolerated relative error of a step.
    pub relative_tolerance: f64,
    /// What is written.
    #[serde(skip)]
    pub outputs: Vec<Output>,
}

/// A validated scene; it is serialised as what decides a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    #[serde(skip)]
    file: String,
    #[serde(skip)]
    title: String,
    values: BTreeMap<&'static str, f64>,
    has_shoulder: bool,
    /// What a loss of contact does.
    pub loss: Loss,
    /// What the Painlevé paradox does.
    pub jam: Jam,
    /// How the head moves.
    pub drive: Drive,
    /// Start of the run, s.
    pub start_s: f64,
    /// State at the start.
    pub start: StartKind,
    /// What is computed.
    pub run: RunSettings,
    /// The blade, its friction and its shoulder.
    pub linkage: Linkage,
}

/// Largest number of samples that a run may ask for: a mistyped rate or stop time is refused instead of
/// filling the disk.
const MOST_SAMPLES: f64 = 1e8;
/// Tolerances that double precision can meet.
const TOLERANCES: (f64, f64) = (1e-13, 1e-2);
const DEFAULT_TOLERANCE: f64 = 1e-8;

impl Scene {
    /// Reads and validates a scene that needs no other file; `file` is the name used in refusals.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, key, what was found and what to do; also for a scene with
    /// `drive.recording`, which [`Self::parse_with`] reads.
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        Self::parse_with(file, text, |path| {
            Err(format!(
                "found \"{path}\", expected amplitude_m and frequency_hz: recordings are not at hand here"
            ))
        })
    }

    /// Reads and validates a scene; `recording` reads the recording that `drive.recording` names, or says why
    /// it cannot.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, key, what was found and what to do.
    pub fn parse_with(
        file: &str,
        text: &str,
        recording: impl FnOnce(&str) -> Result<Recording, String>,
    ) -> Result<Self, SceneError> {
        let written: SceneFile = toml_file::parse(file, text)?;
        toml_file::check_format(file, written.format)?;
        let mut reader = Reader { file, text, values: BTreeMap::new() };
        reader.table("blade", written.blade)?;
        let has_shoulder = written.shoulder.is_some();
        reader.table("shoulder", written.shoulder.unwrap_or_default())?;
        reader.table("friction", written.friction)?;
        let recorded = reader.drive(&written.drive)?;
        reader.number("contact.restitution", written.contact.restitution)?;
        let values = reader.values;
        check_complete(file, &values, has_shoulder, recorded.is_some())?;
        let (start_s, start) = start(file, &written.start)?;
        let run = run_settings(file, &written.run, start_s)?;
        let linkage = linkage(file, &values, has_shoulder)?;
        let drive = match recorded {
            Some((place, path)) => recorded_drive(&place, &recording(&path), [start_s, run.stop_s])?,
            None => drive(&values),
        };
        check_slide(file, start_s, start, &linkage, &drive)?;
        let (loss, jam) = (written.contact.loss, written.contact.jam);
        Ok(Self {
            file: file.to_owned(),
            title: written.title,
            values,
            has_shoulder,
            loss,
            jam,
            drive,
            start_s,
            start,
            run,
            linkage,
        })
    }

    /// Title of the scene.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// Energetic coefficient of restitution of the tip's impacts on the glass.
    #[must_use]
    pub fn restitution(&self) -> f64 {
        self.values.get("contact.restitution").copied().unwrap_or(0.0)
    }

    /// The same scene with one parameter set; a quantity that was written another way is then written this
    /// way.
    ///
    /// # Errors
    /// [`SceneError::Key`] for an unknown name or a value out of range.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, SceneError> {
        let parameter = parameter(&self.file, name)?;
        check_range(&self.file, parameter, value)?;
        if parameter.name.starts_with("shoulder.") && !self.has_shoulder {
            return Err(key_error(
                &self.file,
                name,
                "no [shoulder]",
                "a scene with a shoulder",
                "add a [shoulder] table to the scene",
            ));
        }
        if matches!(self.drive, Drive::Recorded(_)) && name.starts_with("drive.") {
            return Err(key_error(
                &self.file,
                name,
                "a recorded drive",
                "a scene whose head moves as a cosine",
                "leave the parameter out",
            ));
        }
        let mut scene = self.clone();
        for other in PARAMETERS.iter().filter(|p| p.quantity == parameter.quantity) {
            scene.values.remove(other.name);
        }
        scene.values.insert(parameter.name, value);
        scene.linkage = linkage(&self.file, &scene.values, self.has_shoulder)?;
        if let Drive::Cosine { .. } = self.drive {
            scene.drive = drive(&scene.values);
        }
        Ok(scene)
    }

    /// Value of a parameter in SI, converted where the scene writes the quantity another way; `None` where
    /// the scene has no such part.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.values.get(name).copied().or_else(|| parameters::converted(name, &self.linkage))
    }
}

/// Collects the numbers of a file under the names of the parameter table.
struct Reader<'a> {
    file: &'a str,
    text: &'a str,
    values: BTreeMap<&'static str, f64>,
}

impl Reader<'_> {
    fn table(&mut self, table: &str, numbers: Numbers) -> Result<(), SceneError> {
        numbers.into_iter().try_for_each(|(key, value)| self.number(&format!("{table}.{key}"), Some(value)))
    }

    /// Place and path of the recording that drives the head, where there is one instead of numbers.
    fn drive(&mut self, written: &DriveFile) -> Result<Option<(String, String)>, SceneError> {
        let numbers = [("amplitude_m", &written.amplitude_m), ("frequency_hz", &written.frequency_hz)];
        let Some(recording) = &written.recording else {
            numbers
                .into_iter()
                .try_for_each(|(key, value)| self.number(&format!("drive.{key}"), value.clone()))?;
            return Ok(None);
        };
        let (line, _) = toml_file::line_and_column(self.text, recording.span().start);
        let place = format!("{}:{line}", self.file);
        if let Some((key, _)) = numbers.into_iter().find(|(_, value)| value.is_some()) {
            let expected = "a recording, or amplitude_m and frequency_hz";
            return Err(key_error(
                &place,
                "drive.recording",
                &format!("also `drive.{key}`"),
                expected,
                "remove one: both say how the head moves",
            ));
        }
        Ok(Some((place, recording.get_ref().clone())))
    }

    fn number(&mut self, name: &str, value: Option<Spanned<f64>>) -> Result<(), SceneError> {
        let Some(value) = value else { return Ok(()) };
        let (line, _) = toml_file::line_and_column(self.text, value.span().start);
        let place = format!("{}:{line}", self.file);
        let parameter = parameter(&place, name)?;
        check_range(&place, parameter, *value.get_ref())?;
        if let Some(twin) =
            PARAMETERS.iter().find(|p| p.quantity == parameter.quantity && self.values.contains_key(p.name))
        {
            return Err(key_error(
                &place,
                name,
                &format!("also `{}`", twin.name),
                "one of the two",
                "remove one: both set the same quantity",
            ));
        }
        self.values.insert(parameter.name, *value.get_ref());
        Ok(())
    }
}

fn key_error(place: &str, key: &str, found: &str, expected: &str, advice: &str) -> SceneError {
    let [place, key, found, expected, advice] = [place, key, found, expected, advice].map(str::to_owned);
    SceneError::Key { place, key, found, expected, advice }
}

fn parameter(place: &str, name: &str) -> Result<&'static Parameter, SceneError> {
    parameters::find(name).ok_or_else(|| {
        let table = name.split_once('.').map_or("", |(table, _)| table);
        let known: Vec<&str> = parameters::names()
            .into_iter()
            .filter(|n| table.is_empty() || n.split('.').next() == Some(table))
            .collect();
        let known = if known.is_empty() { parameters::names() } else { known };
        key_error(
            place,
            name,
            "an unknown key",
            "a key of the scene format",
            &toml_file::nearest(name, &known),
        )
    })
}

fn check_range(place: &str, parameter: &Parameter, value: f64) -> Result<(), SceneError> {
    if parameter.range.admits(value) {
        return Ok(());
    }
    let expected = format!("{} ({}, {})", parameter.range.in_words(), parameter.meaning, parameter.unit);
    Err(key_error(place, parameter.name, &value.to_string(), &expected, "correct the value"))
}

/// Every quantity is given once or has a default; the shoulder's only where there is a shoulder, the drive's
/// where it is not recorded.
fn check_complete(
    file: &str,
    values: &BTreeMap<&'static str, f64>,
    has_shoulder: bool,
    recorded: bool,
) -> Result<(), SceneError> {
    let absent = |p: &Parameter| {
        (!has_shoulder && p.name.starts_with("shoulder.")) || (recorded && p.name.starts_with("drive."))
    };
    let needed = |p: &&Parameter| p.default.is_none() && !absent(p);
    for parameter in PARAMETERS.iter().filter(needed) {
        let ways: Vec<&str> =
            PARAMETERS.iter().filter(|p| p.quantity == parameter.quantity).map(|p| p.name).collect();
        if !ways.iter().any(|name| values.contains_key(name)) {
            return Err(key_error(
                file,
                parameter.name,
                "nothing",
                &ways.join(" or "),
                &format!("add it: {}, {}", parameter.meaning, parameter.unit),
            ));
        }
    }
    Ok(())
}

fn start(file: &str, written: &StartFile) -> Result<(f64, StartKind), SceneError> {
    let numbers = [
        ("start.neck_angle_rad", written.neck_angle_rad),
        ("start.lip_angle_rad", written.lip_angle_rad),
        ("start.neck_rate_rad_per_s", written.neck_rate_rad_per_s),
        ("start.lip_rate_rad_per_s", written.lip_rate_rad_per_s),
    ];
    for (key, value) in numbers.into_iter().chain([("start.time_s", Some(written.time_s))]) {
        if let Some(value) = value.filter(|v| !v.is_finite()) {
            return Err(key_error(file, key, &value.to_string(), "a finite number", "correct the value"));
        }
    }
    let kind = match written.kind {
        StartWord::State => {
            let [theta, phi, theta_rate, phi_rate] = numbers.map(|(key, value)| value.ok_or(key));
            let missing = |key: &str| {
                key_error(file, key, "nothing", "a number", "start.kind = \"state\" needs all four")
            };
            StartKind::State(Pose {
                theta: theta.map_err(missing)?,
                phi: phi.map_err(missing)?,
                theta_rate: theta_rate.map_err(missing)?,
                phi_rate: phi_rate.map_err(missing)?,
            })
        }
        _ if numbers.iter().any(|(_, v)| v.is_some()) => {
            return Err(key_error(
                file,
                "start.kind",
                "angles or rates without it",
                "\"state\"",
                "set start.kind = \"state\" or remove them",
            ));
        }
        StartWord::Upright => StartKind::Upright,
        StartWord::SteadySlide => StartKind::SteadySlide,
    };
    Ok((written.time_s, kind))
}

/// A run that starts in steady slip needs a head that moves and a blade that has such an equilibrium.
fn check_slide(
    file: &str,
    start_s: f64,
    kind: StartKind,
    linkage: &Linkage,
    drive: &Drive,
) -> Result<(), SceneError> {
    let speed = drive.at(start_s).velocity_m_per_s;
    if kind != StartKind::SteadySlide || super::equilibrium::steady_slide(linkage, speed).is_some() {
        return Ok(());
    }
    let found = format!(
        "\"steady-slide\" at start.time_s = {start_s}, where the head moves at {speed} m/s and no equilibrium of steady slip is found"
    );
    let advice = "start at a time when the head moves, start \"upright\", or lower friction or preload";
    Err(key_error(
        file,
        "start.kind",
        &found,
        "a blade that slides steadily, pressed onto the glass, its links short of level",
        advice,
    ))
}

fn run_settings(file: &str, written: &RunFile, start_s: f64) -> Result<RunSettings, SceneError> {
    let refuse = |key: &str, value: f64, expected: &str| {
        Err(key_error(file, key, &value.to_string(), expected, "correct the value"))
    };
    if !(written.stop_s.is_finite() && written.stop_s > start_s) {
        return refuse(
            "run.stop_s",
            written.stop_s,
            &format!("a finite time after start.time_s = {start_s}"),
        );
    }
    if !(written.sample_rate_hz.is_finite() && written.sample_rate_hz > 0.0) {
        return refuse("run.sample_rate_hz", written.sample_rate_hz, "a number above 0");
    }
    let samples = written.sample_rate_hz * (written.stop_s - start_s);
    if !(1.0..=MOST_SAMPLES).contains(&samples) {
        return refuse(
            "run.sample_rate_hz",
            written.sample_rate_hz,
            &format!("2 to {MOST_SAMPLES:e} samples in the run, not {samples:e}"),
        );
    }
    let relative_tolerance = written.relative_tolerance.unwrap_or(DEFAULT_TOLERANCE);
    check_tolerance(relative_tolerance).map_err(|expected| {
        key_error(file, "run.relative_tolerance", &relative_tolerance.to_string(), &expected, "correct it")
    })?;
    let outputs =
        written.outputs.clone().unwrap_or_else(|| vec![Output::Trace, Output::State, Output::Events]);
    Ok(RunSettings {
        stop_s: written.stop_s,
        sample_rate_hz: written.sample_rate_hz,
        relative_tolerance,
        outputs,
    })
}

/// Checks a relative tolerance against what double precision can meet.
///
/// # Errors
/// The expected range in words.
pub fn check_tolerance(relative: f64) -> Result<(), String> {
    let (least, most) = TOLERANCES;
    if (least..=most).contains(&relative) {
        Ok(())
    } else {
        Err(format!("a number from {least:e} to {most:e}"))
    }
}

fn drive(values: &BTreeMap<&'static str, f64>) -> Drive {
    let number = |name: &str| values.get(name).copied().unwrap_or(0.0); // completeness was checked
    Drive::Cosine { amplitude_m: number("drive.amplitude_m"), frequency_hz: number("drive.frequency_hz") }
}

/// The head's recorded motion; the run lies within the time in which it was tracked.
fn recorded_drive(
    place: &str,
    recording: &Result<Recording, String>,
    run_s: [f64; 2],
) -> Result<Drive, SceneError> {
    let refuse = |problem: String| SceneError::Recording { place: place.to_owned(), problem };
    let recording = recording.as_ref().map_err(|problem| refuse(problem.clone()))?;
    let motion = head_motion(recording).map_err(|problem| refuse(problem.to_string()))?;
    let ([start_s, stop_s], [first_s, last_s]) = (run_s, motion.span_s());
    if motion.covers(start_s, stop_s) {
        return Ok(Drive::Recorded(Arc::new(motion)));
    }
    let found = format!("a run from {start_s} s to {stop_s} s");
    let expected =
        format!("one within the {first_s} s to {last_s} s in which `{}` tracks the head", recording.name());
    Err(key_error(
        place,
        "drive.recording",
        &found,
        &expected,
        "change start.time_s and run.stop_s, or take another recording",
    ))
}
