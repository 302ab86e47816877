//! job.toml: what is fitted to what, checked completely before anything runs. Every key: `docs/fits.md`.

mod aims;
mod as_written;
mod conditions;
mod entry;
mod prior;
mod settings;

pub use conditions::{Condition, SCENE_ALONE};
pub use prior::Prior;

use super::scale::{Bounds, ScaleError};
use super::search::Settings;
use crate::feature::Feature;
use crate::toml_file::{self, TomlError, check_format, nearest, parse};

/// Relative error of a component's frequency that passes, unless the job says otherwise: the aim of this
/// program, 2 %.
pub const TOLERANCE_RELATIVE: f64 = 0.02;
/// Points of a cloud unless the job says otherwise: a few for each of up to six parameters, and a multiple of
/// common core counts.
pub const PARTICLES: usize = 24;
/// Points from which a local search starts unless the job says otherwise: known cases have two or three
/// basins, and some starts share one.
pub const STARTS: usize = 6;
/// Most of them: each takes its share of the local evaluations.
pub const MOST_STARTS: usize = 64;
/// Most evaluations of a stage: a bound on memory, weeks of computing away.
pub const MOST_EVALUATIONS: usize = 10_000_000;
/// Least standard deviation relative to a target: beyond what any camera gives, and far from overflow of a
/// squared residual.
pub const LEAST_SD_RELATIVE: f64 = 1e-9;
/// Most starting states that are averaged over: eight bring a friction from 20 % to 1-3 %, and each costs a
/// run.
pub const MOST_MEMBERS: usize = 64;
/// Relative spread of the starting state unless the job says otherwise: how far a start guessed from a
/// recording is off.
pub const SPREAD: f64 = 0.1;
/// Fits to twins of the best model unless the job says otherwise: forty know a standard deviation to a tenth.
pub const REPLICATES: usize = 40;
/// Most of them: a thousand know a 95 % interval to a few hundredths of its width.
pub const MOST_REPLICATES: usize = 1000;

/// A checked job.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// Title for pages and figures.
    pub title: String,
    /// What is simulated: recordings first, then conditions without one, in the order of the file; at least
    /// one.
    pub conditions: Vec<Condition>,
    /// The camera through which the model of a condition without a recording is seen.
    pub camera: Option<Camera>,
    /// Free parameters.
    pub parameters: Vec<FreeParameter>,
    /// Components first, then features, in the order of the file.
    pub aims: Vec<Aim>,
    /// Budgets and seed of the search.
    pub search: Settings,
    /// Starting states that are averaged over.
    pub ensemble: Ensemble,
    /// Largest lean of the blade from the vertical that a run may show, rad; `None` for any.
    pub largest_tilt_rad: Option<f64>,
    /// How intervals are found.
    pub intervals: IntervalSettings,
}

/// A camera that no recording brings along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Frames per second, 1/s.
    pub frame_rate_hz: f64,
    /// Time for which the shutter is open, s.
    pub exposure_s: f64,
}

/// Starting states of a model run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ensemble {
    /// How many, 1 or more; 1 for the scene's own.
    pub members: usize,
    /// Relative spread of the starting state, above 0 and at most 1.
    pub spread: f64,
}

/// How intervals are found, beside the linearised ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntervalSettings {
    /// By profiles of the cost.
    pub profile: bool,
    /// By this many fits to twins of the best model; 0 for none.
    pub bootstrap: usize,
}

/// A parameter that the search may change.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParameter {
    /// Key of the scene with its table, such as `friction.a`.
    pub name: String,
    /// Its range, in its own SI unit.
    pub bounds: Bounds,
    /// What is known of it beforehand.
    pub prior: Option<Prior>,
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
    /// Whether it is only predicted, never fitted.
    pub held_out: bool,
    /// From when on it counts.
    pub stage: When,
}

/// Stages of a search in which an aim counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// In all of them.
    Always,
    /// In the last stage alone: the lines of a log-spectrum have many minima, and help only near the right
    /// one.
    Last,
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
    /// Measured on the recording; its standard deviation is at least `least_sd` and `least_sd_relative` times
    /// its size, and where both are 0 that of the recording's own noise.
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
    /// Reads and checks a job; `known` are the names of the parameters that a scene has, `file` is its name
    /// in refusals.
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

    /// Paths of the recordings, relative to the job file: those of the first conditions.
    pub fn recordings(&self) -> impl Iterator<Item = &str> {
        self.conditions.iter().filter_map(|condition| condition.recording.as_deref())
    }

    /// Everything in the job that decides the cost of a point, in one canonical text: neither title, seed and
    /// budgets of the search nor how intervals are found, so that a fit can be given a larger budget.
    #[must_use]
    pub fn problem_text(&self) -> String {
        let Self {
            title: _,
            conditions,
            camera,
            parameters,
            aims,
            search: _,
            ensemble,
            largest_tilt_rad,
            intervals: _,
        } = self;
        let lines = [
            conditions.iter().map(|c| format!("{c:?}\n")).collect::<String>(),
            parameters.iter().map(|p| format!("{p:?}\n")).collect(),
            aims.iter().map(|aim| format!("{aim:?}\n")).collect(),
            format!("{camera:?}\n{ensemble:?}\nlargest_tilt_rad {largest_tilt_rad:?}\n"),
        ];
        lines.concat()
    }

    fn check(written: &as_written::Job, known: &[&str]) -> Result<Self, Refusal> {
        let conditions = conditions::conditions(written, known)?;
        let camera = settings::camera(written)?;
        let parameters = parameters(&written.parameter, known)?;
        parameters.iter().try_for_each(|p| conditions::check_free(&conditions, &p.name))?;
        let context =
            aims::Context { conditions: &conditions, nyquist_hz: camera.map(|c| c.frame_rate_hz / 2.0) };
        let aims = aims::aims(written, &context)?;
        let (search, ensemble) = (settings::search(written)?, settings::ensemble(written)?);
        let (largest_tilt_rad, intervals) =
            (settings::largest_tilt_rad(written)?, settings::intervals(written)?);
        Ok(Self {
            title: written.title.clone(),
            conditions,
            camera,
            parameters,
            aims,
            search,
            ensemble,
            largest_tilt_rad,
            intervals,
        })
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

impl From<toml_file::Refusal> for Refusal {
    fn from((key, problem): toml_file::Refusal) -> Self {
        Self::Value { key, problem }
    }
}

fn refuse<T>(key: impl Into<String>, problem: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal::Value { key: key.into(), problem: problem.into() })
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
            return refuse(
                format!("parameter `{}`", p.name),
                format!("not a parameter of a scene; {}", nearest(&p.name, known)),
            );
        }
        let bounds = Bounds::new(p.lower, p.upper, p.scale)
            .map_err(|problem| Refusal::Bounds { name: p.name.clone(), problem })?;
        let prior = p.prior.as_ref().map(|prior| prior::prior(&p.name, prior, &bounds)).transpose()?;
        Ok(FreeParameter { name: p.name.clone(), bounds, prior })
    };
    written.iter().map(check).collect()
}

fn non_empty(key: &str, found: &str, expected: &str) -> Result<String, Refusal> {
    if found.trim().is_empty() {
        return refuse(key, format!("found \"{found}\", expected {expected}"));
    }
    Ok(found.to_owned())
}

fn above_zero(key: impl Into<String>, found: f64) -> Result<f64, Refusal> {
    Ok(toml_file::above_zero(key, found)?)
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
