//! Free parameters and freed constants of a job: bounds and priors.

use super::as_written::{self, JobNuisanceEntry, ListedNuisance, ParameterScope};
use super::checks::find_repeated;
use super::{KeyRefusal, TraceTarget, check_above_zero, is_same_quantity};
use crate::fit::bounds::{Bounds, BoundsSpacing, Prior};
use crate::model::parameters::name_in_recording;
use crate::toml_file::suggest_key;
use portable_math as math;
use serde::Serialize;

/// A parameter that the search may change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeParameter {
    /// Key in the scene file, preceded by its table, such as `friction.a`. If the parameter has its own value
    /// in each recording, the number of the recording follows, as in `friction.a@2`.
    pub name: String,
    /// Bounds of the parameter, in its SI unit.
    pub bounds: Bounds,
    /// Prior of the parameter, if any.
    pub prior: Option<Prior>,
}

/// A parameter without a name and without a prior.
impl From<Bounds> for FreeParameter {
    fn from(bounds: Bounds) -> Self {
        Self { name: String::new(), bounds, prior: None }
    }
}

pub(super) fn check_parameters(
    written: &[as_written::JobParameterTable],
    known: &[&str],
    traces: &[TraceTarget],
) -> Result<Vec<FreeParameter>, KeyRefusal> {
    if written.is_empty() {
        refuse!("parameter", "found none, expected at least one [[parameter]] to fit");
    }
    let names: Vec<&str> = written.iter().map(|p| p.name.as_str()).collect();
    check_distinct("parameter", &names, "the parameter ")?;
    let check = |p: &as_written::JobParameterTable| {
        let key = format!("parameter `{}`", p.name);
        if !known.contains(&p.name.as_str()) {
            refuse!(key, "not a parameter of a scene; {}", suggest_key(&p.name, known));
        }
        let bounds = Bounds::new(p.lower, p.upper, p.scale).or_else(|problem| refuse!(key, "{problem}"))?;
        let prior = p.prior.as_ref().map(|prior| check_prior(&p.name, prior, &bounds)).transpose()?;
        if p.scope == ParameterScope::Job {
            return Ok(vec![FreeParameter { name: p.name.clone(), bounds, prior }]);
        }
        if traces.is_empty() {
            refuse!(
                format!("parameter `{}`, `scope`", p.name),
                "found \"recording\" in a job without a [[trace]], whose recordings share all parameters; remove it"
            );
        }
        let own = |trace: &TraceTarget| {
            let name = name_in_recording(&p.name, trace.condition);
            FreeParameter { name, bounds, prior }
        };
        Ok(traces.iter().map(own).collect())
    };
    let found: Vec<Vec<FreeParameter>> = written.iter().map(check).collect::<Result<_, _>>()?;
    Ok(found.concat())
}

/// Refuses two entries that set the same quantity, such as a stiffness and its natural frequency, because the
/// second entry would overwrite the first.
fn check_distinct(table: &str, names: &[&str], article: &str) -> Result<(), KeyRefusal> {
    if let Some(name) = find_repeated(names.iter().copied()) {
        refuse!(format!("{table} `{name}`"), "found twice; remove one of them");
    }
    for (at, second) in names.iter().enumerate() {
        if let Some(first) = names[..at].iter().find(|first| is_same_quantity(first, second)) {
            refuse!(
                format!("{table} `{second}`"),
                "sets the same quantity as {article}`{first}`; remove one of them"
            );
        }
    }
    Ok(())
}

fn check_prior(
    name: &str,
    written: &as_written::JobPriorTable,
    bounds: &Bounds,
) -> Result<Prior, KeyRefusal> {
    let key = |key: &str| format!("parameter `{name}`, `prior.{key}`");
    let (mean, lower, upper) = (written.mean, bounds.lower(), bounds.upper());
    if !(lower..=upper).contains(&mean) {
        refuse!(
            key("mean"),
            "found {mean}, expected a number within the bounds, {lower} to {upper}; move the bounds or correct it"
        );
    }
    let relative = match (written.sd, written.sd_relative) {
        (Some(sd), None) => check_above_zero(key("sd"), sd)? / mean.abs(),
        (None, Some(relative)) => check_above_zero(key("sd_relative"), relative)?,
        _ => {
            refuse!(
                key("sd"),
                "expected either `sd`, in the parameter's unit, or `sd_relative`, a share of the mean; give one of them"
            );
        }
    };
    match bounds.spacing() {
        BoundsSpacing::Log => Ok(Prior::Log { mean_ln: math::ln(mean), sd_ln: relative }),
        BoundsSpacing::Linear if written.sd.is_none() && mean == 0.0 => refuse!(
            key("sd_relative"),
            "found a share of a mean of 0; give `sd` in the parameter's unit instead"
        ),
        BoundsSpacing::Linear => Ok(Prior::Linear { mean, sd: written.sd.unwrap_or(relative * mean.abs()) }),
    }
}

// Constants of the scene that are free within a prior. They are freed because a mass or a damping is never
// known exactly.

/// Value of `nuisance` with which a job takes all constants as exact.
const EXACT_WORD: &str = "exact";
/// The forms of `nuisance`, for refusals.
const NUISANCE_FORMS: &str = "\"exact\", a percentage such as \"3 %\", or a list of constants";
/// Smallest allowed standard deviation of the prior of a constant, in % of the constant. A more precisely
/// known constant must be left fixed.
const LEAST_PERCENT: f64 = 1e-4;
/// Largest allowed standard deviation of the prior of a constant, in % of the constant. A less precisely
/// known quantity must be a free parameter.
const MOST_PERCENT: f64 = 50.0;

/// Constants of the scene that are free within a prior.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Constants {
    /// No constant is free: all constants are exact.
    Exact,
    /// Every constant for which a default prior exists is free within it, except constants that are zero,
    /// free parameters, or set by a condition.
    Default,
    /// All masses, inertias, stiffnesses and dampings, the preload and the shoulder angle of a scene, except
    /// those that are zero, free parameters, or set by a condition.
    All {
        /// Standard deviation of the prior of each constant, relative to the constant.
        sd_relative: f64,
    },
    /// Only the constants of a list.
    Listed(Vec<NuisanceParameter>),
}

/// A constant that is free within a prior.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NuisanceParameter {
    /// Key in the scene file, preceded by its table.
    pub name: String,
    /// Standard deviation of the prior of the constant's natural logarithm; the mean of this prior is the
    /// logarithm of the value in the scene.
    pub sd_relative: f64,
}

impl Constants {
    /// Whether all constants are exact.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::Exact
    }

    /// Names of the listed constants.
    pub(in crate::fit) fn listed_names(&self) -> impl Iterator<Item = &str> {
        let listed = if let Self::Listed(listed) = self { &listed[..] } else { &[] };
        listed.iter().map(|nuisance| nuisance.name.as_str())
    }
}

pub(super) fn check_constants(
    written: &as_written::JobFile,
    free: &[FreeParameter],
    known: &[&str],
) -> Result<Constants, KeyRefusal> {
    let Some(nuisance) = &written.nuisance else {
        return Ok(if written.trace.is_empty() { Constants::Exact } else { Constants::Default });
    };
    if written.trace.is_empty() {
        refuse!(
            "nuisance",
            "found without a [[trace]], expected one: a dozen features do not hold so many unknowns; add a [[trace]], or free single constants as [[parameter]] with a `prior`"
        );
    }
    let list = match nuisance {
        JobNuisanceEntry::All(text) if text == EXACT_WORD => return Ok(Constants::Exact),
        JobNuisanceEntry::All(text) => {
            return Ok(Constants::All { sd_relative: parse_percentage("nuisance", text, NUISANCE_FORMS)? });
        }
        JobNuisanceEntry::Listed(list) => list,
    };
    if list.is_empty() {
        refuse!("nuisance", "found an empty list, expected {NUISANCE_FORMS}");
    }
    let names: Vec<&str> = list.iter().map(|one| one.name.as_str()).collect();
    check_distinct("nuisance", &names, "")?;
    let listed = list.iter().map(|one| check_nuisance(one, free, known)).collect::<Result<_, _>>()?;
    Ok(Constants::Listed(listed))
}

fn check_nuisance(
    written: &ListedNuisance,
    free: &[FreeParameter],
    known: &[&str],
) -> Result<NuisanceParameter, KeyRefusal> {
    let (name, key) = (&written.name, format!("nuisance `{}`", written.name));
    if !known.contains(&name.as_str()) {
        refuse!(key, "not a parameter of a scene; {}", suggest_key(name, known));
    }
    if let Some(free) = free.iter().find(|free| is_same_quantity(&free.name, name)) {
        let free = &free.name;
        refuse!(key, "the [[parameter]] `{free}` is free already; give it a `prior`, and remove it here");
    }
    let sd_relative = match (&written.sd, written.sd_relative) {
        (Some(text), None) => parse_percentage(&key, text, "a percentage such as \"3 %\"")?,
        (None, Some(relative)) => check_percentage(&key, 100.0 * relative)?,
        _ => refuse!(key, "expected either `sd`, such as \"3 %\", or `sd_relative`, such as 0.03"),
    };
    Ok(NuisanceParameter { name: name.clone(), sd_relative })
}

/// Parses `3 %` as 0.03. The error for other text says that `expected` was expected.
fn parse_percentage(key: &str, text: &str, expected: &str) -> Result<f64, KeyRefusal> {
    match text.trim().strip_suffix('%').and_then(|number| number.trim().parse().ok()) {
        Some(percent) => check_percentage(key, percent),
        None => refuse!(key, "found \"{text}\", expected {expected}"),
    }
}

/// Checks a percentage and returns it as a fraction.
fn check_percentage(key: &str, percent: f64) -> Result<f64, KeyRefusal> {
    if (LEAST_PERCENT..=MOST_PERCENT).contains(&percent) {
        return Ok(percent / 100.0);
    }
    refuse!(
        key,
        "found {percent} %, expected {LEAST_PERCENT} % to {MOST_PERCENT} %: what is known no better is a [[parameter]], and nuisance = \"exact\" takes all constants as exact"
    )
}
