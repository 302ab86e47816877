//! job.toml: what is fitted to what, checked completely before anything runs.

mod as_written;
mod entry;

use super::features::{Band, Feature, Reading};
use super::scale::{Bounds, ScaleError};
use super::search::{STAGNANT_GENERATIONS, Settings};
use crate::recording::channel::{Channel, Window};
use crate::spectrum::Detrend;
use crate::toml_file::{TomlError, check_format, nearest, parse};
use as_written::Kind;
use entry::Entry;

/// Relative error of a component's frequency that passes, unless the job says otherwise: the aim of this program, 2 %.
pub const TOLERANCE_RELATIVE: f64 = 0.02;
/// Particles of the swarm unless the job says otherwise: a few for each of up to six parameters, and a multiple of common core counts.
pub const PARTICLES: usize = 24;
/// Most evaluations of a stage: a bound on memory, weeks of computing away.
pub const MOST_EVALUATIONS: usize = 10_000_000;
/// Least standard deviation relative to a target: beyond what any camera gives, and far from overflow of a squared residual.
pub const LEAST_SD_RELATIVE: f64 = 1e-9;

/// A checked job.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Title for pages and figures.
    pub title: String,
    /// Path of the scene, relative to the job file.
    pub scene: String,
    /// Paths of the recordings' folders, relative to the job file.
    pub recordings: Vec<String>,
    /// The camera through which the model is seen, where there is no recording.
    pub camera: Option<Camera>,
    /// Free parameters.
    pub parameters: Vec<FreeParameter>,
    /// Components first, then features, in the order of the file.
    pub aims: Vec<Aim>,
    /// Budgets and seed of the search.
    pub search: Settings,
}

/// A camera that no recording brings along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Frames per second, 1/s.
    pub frame_rate_hz: f64,
    /// Time for which the shutter is open, s.
    pub exposure_s: f64,
}

/// A parameter that the search may change.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParameter {
    /// Key of the scene with its table, such as `friction.a`.
    pub name: String,
    /// Its range, in its own SI unit.
    pub bounds: Bounds,
}

/// A feature and where its target comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Aim {
    /// What is read from measurement and model alike.
    pub feature: Feature,
    /// Where target and standard deviation come from.
    pub source: Source,
    /// Relative error that passes, for a component; `None` for any other feature.
    pub tolerance_relative: Option<f64>,
}

/// Where a target comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// Given in the job, in the feature's unit.
    Given {
        /// The target.
        target: f64,
        /// Its standard deviation.
        sd: f64,
    },
    /// Measured on the recording; its standard deviation is at least `least_sd` and `least_sd_relative` times its size.
    Measured {
        /// In the feature's unit.
        least_sd: f64,
        /// As a share of the target.
        least_sd_relative: f64,
    },
}

/// Why a job was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum JobError {
    /// It is not TOML of the right shape.
    #[error(transparent)]
    Toml(#[from] TomlError),
    /// The bounds of a parameter are no bounds.
    #[error("{file}: parameter `{name}`: {problem}")]
    Bounds {
        /// File as named by the user.
        file: String,
        /// Name of the parameter.
        name: String,
        /// What is wrong with them.
        problem: ScaleError,
    },
    /// A value that cannot be used.
    #[error("{file}: {key}: {problem}")]
    Value {
        /// File as named by the user.
        file: String,
        /// The key, with the entry that it belongs to.
        key: String,
        /// What was found, what was expected, and what to do.
        problem: String,
    },
}

impl Job {
    /// Reads and checks a job; `known` are the names of the parameters that a scene has, `file` is its name in refusals.
    ///
    /// # Errors
    /// [`JobError`] at the first problem.
    pub fn parse(file: &str, text: &str, known: &[&str]) -> Result<Self, JobError> {
        let written: as_written::Job = parse(file, text)?;
        check_format(file, written.format)?;
        let checked = Self::check(&written, known);
        checked.map_err(|refusal| refusal.in_file(file))
    }

    /// Names of the free parameters in order.
    #[must_use]
    pub fn parameter_names(&self) -> Vec<String> {
        self.parameters.iter().map(|p| p.name.clone()).collect()
    }

    /// What is read from each recording, in order.
    #[must_use]
    pub fn features(&self) -> Vec<Feature> {
        self.aims.iter().map(|aim| aim.feature.clone()).collect()
    }

    fn check(written: &as_written::Job, known: &[&str]) -> Result<Self, Refusal> {
        let scene = non_empty("scene", &written.scene, "the path of a scene, relative to the job file")?;
        let recordings = written
            .recording
            .iter()
            .enumerate()
            .map(|(i, r)| non_empty(&format!("recording {}, `path`", i + 1), &r.path, "the folder of a recording, relative to the job file"));
        let recordings = recordings.collect::<Result<Vec<_>, _>>()?;
        let camera = camera(written)?;
        let parameters = parameters(&written.parameter, known)?;
        let context = Context { recordings: recordings.len(), nyquist_hz: camera.map(|c| c.frame_rate_hz / 2.0) };
        let components = written.component.iter().map(|c| component(c, &context));
        let aims = components.chain(written.feature.iter().map(|f| feature(f, &context))).collect::<Result<Vec<_>, _>>()?;
        if aims.is_empty() {
            return refuse("component", "found none, and no [[feature]]; expected at least one thing to fit: add a [[component]]");
        }
        if let Some(name) = repeated(aims.iter().map(|aim| aim.feature.name.as_str())) {
            return refuse(format!("component or feature `{name}`"), "the name is used twice; give each its own `name`");
        }
        let search = search(written)?;
        Ok(Self { title: written.title.clone(), scene, recordings, camera, parameters, aims, search })
    }
}

/// A refusal that does not know its file yet.
enum Refusal {
    Value { key: String, problem: String },
    Bounds { name: String, problem: ScaleError },
}

impl Refusal {
    fn in_file(self, file: &str) -> JobError {
        let file = file.to_owned();
        match self {
            Self::Value { key, problem } => JobError::Value { file, key, problem },
            Self::Bounds { name, problem } => JobError::Bounds { file, name, problem },
        }
    }
}

fn refuse<T>(key: impl Into<String>, problem: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal::Value { key: key.into(), problem: problem.into() })
}

/// What the entries have to agree with.
struct Context {
    recordings: usize,
    nyquist_hz: Option<f64>,
}

fn camera(written: &as_written::Job) -> Result<Option<Camera>, Refusal> {
    let Some(camera) = &written.camera else {
        if written.recording.is_empty() {
            return refuse(
                "camera",
                "missing; expected [camera] with `frame_rate_hz` and `exposure_s`, because there is no [[recording]] that brings its own; add one of them",
            );
        }
        return Ok(None);
    };
    if !written.recording.is_empty() {
        return refuse("camera", "found beside a [[recording]], which brings its own camera; remove [camera]");
    }
    let frame_rate_hz = above_zero("camera.frame_rate_hz", camera.frame_rate_hz)?;
    let exposure_s = camera.exposure_s;
    if !(exposure_s >= 0.0 && exposure_s * frame_rate_hz <= 1.0) {
        return refuse("camera.exposure_s", format!("found {exposure_s}, expected 0 to {} (one frame)", 1.0 / frame_rate_hz));
    }
    Ok(Some(Camera { frame_rate_hz, exposure_s }))
}

fn parameters(written: &[as_written::Parameter], known: &[&str]) -> Result<Vec<FreeParameter>, Refusal> {
    if written.is_empty() {
        return refuse("parameter", "found none, expected at least one [[parameter]] to fit");
    }
    if let Some(name) = repeated(written.iter().map(|p| p.name.as_str())) {
        return refuse(format!("parameter `{name}`"), "found twice; remove one of them");
    }
    let check = |p: &as_written::Parameter| {
        if !known.contains(&p.name.as_str()) {
            return refuse(format!("parameter `{}`", p.name), format!("not a parameter of a scene; {}", nearest(&p.name, known)));
        }
        let bounds = Bounds::new(p.lower, p.upper, p.scale).map_err(|problem| Refusal::Bounds { name: p.name.clone(), problem })?;
        Ok(FreeParameter { name: p.name.clone(), bounds })
    };
    written.iter().map(check).collect()
}

fn component(written: &as_written::Component, context: &Context) -> Result<Aim, Refusal> {
    let entry = Entry { what: format!("component `{}`", written.name) };
    non_empty("component, `name`", &written.name, "a name such as \"low\"")?;
    let band = entry.band(Some(&written.channel), Some(&written.window), Some(written.band_hz), written.detrend.as_deref(), context)?;
    let sd = written.target_sd_hz.map(|sd| above_zero(entry.key("target_sd_hz"), sd)).transpose()?;
    let source = match (written.target_hz, sd) {
        (Some(target), Some(sd)) => entry.given(above_zero(entry.key("target_hz"), target)?, sd, "target_sd_hz")?,
        (Some(_), None) => return refuse(entry.key("target_sd_hz"), "missing; a given `target_hz` needs its standard deviation"),
        (None, _) if context.recordings == 0 => {
            return refuse(entry.key("target_hz"), "missing; without a [[recording]] expected `target_hz` and `target_sd_hz`");
        }
        (None, sd) => Source::Measured { least_sd: sd.unwrap_or(0.0), least_sd_relative: super::features::FREQUENCY_SD_FLOOR },
    };
    let tolerance = above_zero(entry.key("tolerance_relative"), written.tolerance_relative.unwrap_or(TOLERANCE_RELATIVE))?;
    let feature = Feature { name: written.name.clone(), reading: Reading::Frequency(band), recording: entry.recording(written.recording, context)? };
    Ok(Aim { feature, source, tolerance_relative: Some(tolerance) })
}

fn feature(written: &as_written::Feature, context: &Context) -> Result<Aim, Refusal> {
    let recording_of = |entry: &Entry| entry.recording(written.recording, context);
    let kind = kind_word(written.kind);
    let name = written.name.clone().unwrap_or_else(|| kind.to_owned());
    non_empty("feature, `name`", &name, "a name, or no such key")?;
    let entry = Entry { what: format!("feature `{name}` ({kind})") };
    let reading = reading(&entry, written, context)?;
    let source = match (written.target, written.target_sd, written.sd_relative) {
        (Some(target), Some(sd), None) => entry.given(target, sd, "target_sd")?,
        (None, None, Some(relative)) if context.recordings > 0 => Source::Measured { least_sd: 0.0, least_sd_relative: entry.relative_sd(relative)? },
        (None, None, _) if context.recordings == 0 => return refuse(entry.key("target"), "missing; without a [[recording]] expected `target` and `target_sd`"),
        _ => {
            return refuse(
                entry.key("sd_relative"),
                "expected either `sd_relative` alone (the target is measured on the recording) or `target` and `target_sd` together",
            );
        }
    };
    let recording = recording_of(&entry)?;
    Ok(Aim { feature: Feature { name, reading, recording }, source, tolerance_relative: None })
}

fn kind_word(kind: Kind) -> &'static str {
    match kind {
        Kind::ReleaseAfterReversal => "release-after-reversal",
        Kind::MeanDeflection => "mean-deflection",
        Kind::Rms => "rms",
        Kind::Amplitude => "amplitude",
    }
}

fn reading(entry: &Entry, written: &as_written::Feature, context: &Context) -> Result<Reading, Refusal> {
    let spectral = matches!(written.kind, Kind::Rms | Kind::Amplitude);
    let released = matches!(written.kind, Kind::ReleaseAfterReversal);
    let present = [
        ("channel", written.channel.is_some(), spectral),
        ("band_hz", written.band_hz.is_some(), spectral),
        ("detrend", written.detrend.is_some(), spectral),
        ("window", written.window.is_some(), !released),
        ("reversal", written.reversal.is_some(), released),
    ];
    if let Some((key, ..)) = present.into_iter().find(|(_, found, fits)| *found && !fits) {
        return refuse(entry.key(key), "has no meaning for this kind of feature; remove it");
    }
    let band = || entry.band(written.channel.as_deref(), written.window.as_deref(), written.band_hz, written.detrend.as_deref(), context);
    match written.kind {
        Kind::Rms => Ok(Reading::Rms(band()?)),
        Kind::Amplitude => Ok(Reading::Amplitude(band()?)),
        Kind::MeanDeflection => Ok(Reading::MeanDeflection(entry.window(written.window.as_deref())?)),
        Kind::ReleaseAfterReversal => match written.reversal {
            Some(0) => refuse(entry.key("reversal"), "found 0, expected 1 or more: the first reversal is 1"),
            reversal => Ok(Reading::ReleaseAfterReversal(reversal.unwrap_or(1))),
        },
    }
}

fn search(written: &as_written::Job) -> Result<Settings, Refusal> {
    let (search, dimensions) = (&written.search, written.parameter.len());
    let particles = search.particles.unwrap_or(PARTICLES);
    let limits = [
        ("search.particles", particles, 2, MOST_EVALUATIONS, "a swarm needs at least two"),
        ("search.global_evaluations", search.global_evaluations, particles, MOST_EVALUATIONS, "the first generation takes one a particle"),
    ];
    for (key, found, least, most, why) in limits {
        if !(least..=most).contains(&found) {
            return refuse(key, format!("found {found}, expected {least} to {most}: {why}"));
        }
    }
    let local = search.local_evaluations;
    if local > MOST_EVALUATIONS || (local != 0 && local <= dimensions) {
        return refuse(
            "search.local_evaluations",
            format!("found {local}, expected 0, or {} to {MOST_EVALUATIONS}: the first simplex takes one more than there are parameters", dimensions + 1),
        );
    }
    let stagnation_generations = search.stagnation_generations.unwrap_or(STAGNANT_GENERATIONS);
    Ok(Settings { seed: written.seed, global_evaluations: search.global_evaluations, local_evaluations: local, particles, stagnation_generations })
}

fn non_empty(key: &str, found: &str, expected: &str) -> Result<String, Refusal> {
    if found.trim().is_empty() {
        return refuse(key, format!("found \"{found}\", expected {expected}"));
    }
    Ok(found.to_owned())
}

fn above_zero(key: impl Into<String>, found: f64) -> Result<f64, Refusal> {
    if found.is_finite() && found > 0.0 {
        return Ok(found);
    }
    refuse(key, format!("found {found}, expected a finite number above 0"))
}

fn repeated<'a>(names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut seen = Vec::new();
    for name in names {
        if seen.contains(&name) {
            return Some(name);
        }
        seen.push(name);
    }
    None
}

#[cfg(test)]
mod tests;
