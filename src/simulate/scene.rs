//! Scenes: a blade, its friction, its drive and what is to be computed; `scene.toml` as written and as validated.

mod as_written;
mod linkage;

use crate::blade::parameters::{self, PARAMETERS, Parameter};
use crate::blade::{HeadMotion, Linkage, Pose};
use crate::toml_file::{self, TomlError};
use as_written::{Numbers, RunFile, SceneFile, StartFile, StartWord};
use linkage::linkage;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
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
}

/// What happens when the normal force reaches zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// The run ends and says so.
    #[default]
    Stop,
    /// The tip flies and lands.
    Fly,
}

/// What happens when the Painlevé condition fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Jam {
    /// The run ends and says so.
    #[default]
    Stop,
    /// An impact without collision.
    Impact,
}

/// How the head moves along the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// `v = a (1 - cos 2 pi f t)`, the paper's drive.
    Cosine {
        /// `a`, m.
        amplitude_m: f64,
        /// `f`, Hz.
        frequency_hz: f64,
    },
    /// `v = speed t`; not reachable from a scene file, it serves the exact cases.
    Uniform {
        /// Speed of the head, m/s.
        speed_m_per_s: f64,
    },
}

impl Drive {
    /// Motion of the head at time `t`, s.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f64) -> HeadMotion {
        match *self {
            Self::Cosine { amplitude_m, frequency_hz } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (omega * t).sin_cos();
                HeadMotion {
                    position_m: amplitude_m * (1.0 - cos),
                    velocity_m_per_s: amplitude_m * omega * sin,
                    acceleration_m_per_s2: amplitude_m * omega * omega * cos,
                }
            }
            Self::Uniform { speed_m_per_s } => HeadMotion { position_m: speed_m_per_s * t, velocity_m_per_s: speed_m_per_s, acceleration_m_per_s2: 0.0 },
        }
    }
}

impl Drive {
    /// Taylor coefficients of the head's velocity about `t`, as many as `out` holds.
    #[inline]
    pub fn series(&self, t: f64, out: &mut [f64]) {
        match *self {
            Self::Cosine { amplitude_m, frequency_hz } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (omega * t).sin_cos();
                let (mut velocity, mut quadrature) = (amplitude_m * omega * sin, amplitude_m * omega * cos);
                for (k, out) in out.iter_mut().enumerate() {
                    *out = velocity;
                    let factor = omega / (k + 1) as f64;
                    (velocity, quadrature) = (factor * quadrature, -factor * velocity);
                }
            }
            Self::Uniform { speed_m_per_s } => {
                out.fill(0.0);
                out[..1].fill(speed_m_per_s);
            }
        }
    }
}

/// How the blade starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartKind {
    /// Upright and at rest.
    Upright,
    /// In the equilibrium of steady slip at the head's speed.
    SteadySlide,
    /// In a given state.
    State(Pose),
}

/// What `simulate` writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
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
#[derive(Debug, Clone, PartialEq)]
pub struct RunSettings {
    /// End of the run, s.
    pub stop_s: f64,
    /// Rate of the sampled outputs, 1/s.
    pub sample_rate_hz: f64,
    /// Tolerated relative error of a step.
    pub relative_tolerance: f64,
    /// What is written.
    pub outputs: Vec<Output>,
}

/// A validated scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    file: String,
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

/// Largest number of samples that a run may ask for: a mistyped rate or stop time is refused instead of filling the disk.
const MOST_SAMPLES: f64 = 1e8;
/// Tolerances that double precision can meet.
const TOLERANCES: (f64, f64) = (1e-13, 1e-2);
const DEFAULT_TOLERANCE: f64 = 1e-8;

impl Scene {
    /// Reads and validates a scene; `file` is the name used in refusals.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, key, what was found and what to do.
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        let written: SceneFile = toml_file::parse(file, text)?;
        toml_file::check_format(file, written.format)?;
        let mut reader = Reader { file, text, values: BTreeMap::new() };
        reader.table("blade", written.blade)?;
        let has_shoulder = written.shoulder.is_some();
        reader.table("shoulder", written.shoulder.unwrap_or_default())?;
        reader.table("friction", written.friction)?;
        reader.number("drive.amplitude_m", written.drive.amplitude_m)?;
        reader.number("drive.frequency_hz", written.drive.frequency_hz)?;
        reader.number("contact.restitution", written.contact.restitution)?;
        if let Some(recording) = &written.drive.recording {
            return Err(later(file, "drive.recording", recording, "amplitude_m and frequency_hz", "describe the head's motion by them"));
        }
        if written.contact.loss == Loss::Fly {
            return Err(later(file, "contact.loss", "fly", "\"stop\"", "the run then ends where the tip lifts off and says when"));
        }
        if written.contact.jam == Jam::Impact {
            return Err(later(file, "contact.jam", "impact", "\"stop\"", "the run then ends where the tip jams and says when"));
        }
        let values = reader.values;
        check_complete(file, &values, has_shoulder)?;
        let (start_s, start) = start(file, &written.start)?;
        let run = run_settings(file, &written.run, start_s)?;
        let (linkage, drive) = (linkage(file, &values, has_shoulder)?, drive(&values));
        check_slide(file, start_s, start, &linkage, &drive)?;
        let (loss, jam) = (written.contact.loss, written.contact.jam);
        Ok(Self { file: file.to_owned(), title: written.title, values, has_shoulder, loss, jam, drive, start_s, start, run, linkage })
    }

    /// Title of the scene.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The same scene with one parameter set; a quantity that was written another way is then written this way.
    ///
    /// # Errors
    /// [`SceneError::Key`] for an unknown name or a value out of range.
    pub fn with(&self, name: &str, value: f64) -> Result<Self, SceneError> {
        let parameter = parameter(&self.file, name)?;
        check_range(&self.file, parameter, value)?;
        if parameter.name.starts_with("shoulder.") && !self.has_shoulder {
            return Err(key_error(&self.file, name, "no [shoulder]", "a scene with a shoulder", "add a [shoulder] table to the scene"));
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

    /// Value of a parameter in SI, converted where the scene writes the quantity another way; `None` where the scene has no such part.
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

    fn number(&mut self, name: &str, value: Option<Spanned<f64>>) -> Result<(), SceneError> {
        let Some(value) = value else { return Ok(()) };
        let (line, _) = toml_file::line_and_column(self.text, value.span().start);
        let place = format!("{}:{line}", self.file);
        let parameter = parameter(&place, name)?;
        check_range(&place, parameter, *value.get_ref())?;
        if let Some(twin) = PARAMETERS.iter().find(|p| p.quantity == parameter.quantity && self.values.contains_key(p.name)) {
            return Err(key_error(&place, name, &format!("also `{}`", twin.name), "one of the two", "remove one: both set the same quantity"));
        }
        self.values.insert(parameter.name, *value.get_ref());
        Ok(())
    }
}

fn key_error(place: &str, key: &str, found: &str, expected: &str, advice: &str) -> SceneError {
    let [place, key, found, expected, advice] = [place, key, found, expected, advice].map(str::to_owned);
    SceneError::Key { place, key, found, expected, advice }
}

fn later(file: &str, key: &str, found: &str, expected: &str, advice: &str) -> SceneError {
    key_error(file, key, &format!("\"{found}\", which this version does not compute"), expected, advice)
}

fn parameter(place: &str, name: &str) -> Result<&'static Parameter, SceneError> {
    parameters::find(name).ok_or_else(|| {
        let table = name.split_once('.').map_or("", |(table, _)| table);
        let known: Vec<&str> = parameters::names().into_iter().filter(|n| table.is_empty() || n.split('.').next() == Some(table)).collect();
        let known = if known.is_empty() { parameters::names() } else { known };
        key_error(place, name, "an unknown key", "a key of the scene format", &toml_file::nearest(name, &known))
    })
}

fn check_range(place: &str, parameter: &Parameter, value: f64) -> Result<(), SceneError> {
    if parameter.range.admits(value) {
        return Ok(());
    }
    let expected = format!("{} ({}, {})", parameter.range.in_words(), parameter.meaning, parameter.unit);
    Err(key_error(place, parameter.name, &value.to_string(), &expected, "correct the value"))
}

/// Every quantity is given once or has a default; the shoulder's only where there is a shoulder.
fn check_complete(file: &str, values: &BTreeMap<&'static str, f64>, has_shoulder: bool) -> Result<(), SceneError> {
    let needed = |p: &&Parameter| p.default.is_none() && (has_shoulder || !p.name.starts_with("shoulder."));
    for parameter in PARAMETERS.iter().filter(needed) {
        let ways: Vec<&str> = PARAMETERS.iter().filter(|p| p.quantity == parameter.quantity).map(|p| p.name).collect();
        if !ways.iter().any(|name| values.contains_key(name)) {
            return Err(key_error(file, parameter.name, "nothing", &ways.join(" or "), &format!("add it: {}, {}", parameter.meaning, parameter.unit)));
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
            let missing = |key: &str| key_error(file, key, "nothing", "a number", "start.kind = \"state\" needs all four");
            StartKind::State(Pose {
                theta: theta.map_err(missing)?,
                phi: phi.map_err(missing)?,
                theta_rate: theta_rate.map_err(missing)?,
                phi_rate: phi_rate.map_err(missing)?,
            })
        }
        _ if numbers.iter().any(|(_, v)| v.is_some()) => {
            return Err(key_error(file, "start.kind", "angles or rates without it", "\"state\"", "set start.kind = \"state\" or remove them"));
        }
        StartWord::Upright => StartKind::Upright,
        StartWord::SteadySlide => StartKind::SteadySlide,
    };
    Ok((written.time_s, kind))
}

/// A run that starts in steady slip needs a head that moves and a blade that has such an equilibrium.
fn check_slide(file: &str, start_s: f64, kind: StartKind, linkage: &Linkage, drive: &Drive) -> Result<(), SceneError> {
    let speed = drive.at(start_s).velocity_m_per_s;
    if kind != StartKind::SteadySlide || super::equilibrium::steady_slide(linkage, speed).is_some() {
        return Ok(());
    }
    let found = format!("\"steady-slide\" at start.time_s = {start_s}, where the head moves at {speed} m/s and no equilibrium of steady slip is found");
    let advice = "start at a time when the head moves, start \"upright\", or lower friction or preload";
    Err(key_error(file, "start.kind", &found, "a blade that slides steadily, pressed onto the glass, its links short of level", advice))
}

fn run_settings(file: &str, written: &RunFile, start_s: f64) -> Result<RunSettings, SceneError> {
    let refuse = |key: &str, value: f64, expected: &str| Err(key_error(file, key, &value.to_string(), expected, "correct the value"));
    if !(written.stop_s.is_finite() && written.stop_s > start_s) {
        return refuse("run.stop_s", written.stop_s, &format!("a finite time after start.time_s = {start_s}"));
    }
    if !(written.sample_rate_hz.is_finite() && written.sample_rate_hz > 0.0) {
        return refuse("run.sample_rate_hz", written.sample_rate_hz, "a number above 0");
    }
    let samples = written.sample_rate_hz * (written.stop_s - start_s);
    if !(1.0..=MOST_SAMPLES).contains(&samples) {
        return refuse("run.sample_rate_hz", written.sample_rate_hz, &format!("2 to {MOST_SAMPLES:e} samples in the run, not {samples:e}"));
    }
    let relative_tolerance = written.relative_tolerance.unwrap_or(DEFAULT_TOLERANCE);
    check_tolerance(relative_tolerance)
        .map_err(|expected| key_error(file, "run.relative_tolerance", &relative_tolerance.to_string(), &expected, "correct it"))?;
    let outputs = written.outputs.clone().unwrap_or_else(|| vec![Output::Trace, Output::State, Output::Events]);
    Ok(RunSettings { stop_s: written.stop_s, sample_rate_hz: written.sample_rate_hz, relative_tolerance, outputs })
}

/// Checks a relative tolerance against what double precision can meet.
///
/// # Errors
/// The expected range in words.
pub fn check_tolerance(relative: f64) -> Result<(), String> {
    let (least, most) = TOLERANCES;
    if (least..=most).contains(&relative) { Ok(()) } else { Err(format!("a number from {least:e} to {most:e}")) }
}

fn drive(values: &BTreeMap<&'static str, f64>) -> Drive {
    let number = |name: &str| values.get(name).copied().unwrap_or(0.0); // completeness was checked
    Drive::Cosine { amplitude_m: number("drive.amplitude_m"), frequency_hz: number("drive.frequency_hz") }
}
