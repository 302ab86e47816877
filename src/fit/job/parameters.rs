//! Free parameters of a job: bounds, and what is known before any recording is read.

use super::as_written::{self, ListedNuisance};
use super::{KeyRefusal, check_above_zero, find_repeated, is_same_quantity};
use crate::fit::bounds::{Bounds, BoundsSpacing, Prior, SearchAxis};
use crate::math;
use crate::model::parameters::find_parameter;
use crate::toml_file::suggest_key;
use serde::Serialize;

/// A parameter that the search may change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeParameter {
    /// Key of the scene with its table, such as `friction.a`.
    pub name: String,
    /// Its range, in its own SI unit.
    pub bounds: Bounds,
    /// What is known of it beforehand.
    pub prior: Option<Prior>,
}

impl FreeParameter {
    /// Its range and prior, as the search uses them.
    pub(crate) fn search_axis(&self) -> SearchAxis {
        SearchAxis { bounds: self.bounds, prior: self.prior }
    }
}

pub(super) fn check_parameters(
    written: &[as_written::JobParameterTable],
    known: &[&str],
) -> Result<Vec<FreeParameter>, KeyRefusal> {
    if written.is_empty() {
        refuse!("parameter", "found none, expected at least one [[parameter]] to fit");
    }
    if let Some(name) = find_repeated(written.iter().map(|p| p.name.as_str())) {
        refuse!(format!("parameter `{name}`"), "found twice; remove one of them");
    }
    check_quantities(written)?;
    let check = |p: &as_written::JobParameterTable| {
        let key = format!("parameter `{}`", p.name);
        if !known.contains(&p.name.as_str()) {
            refuse!(key, "not a parameter of a scene; {}", suggest_key(&p.name, known));
        }
        let bounds = Bounds::new(p.lower, p.upper, p.scale).or_else(|problem| refuse!(key, "{problem}"))?;
        let prior = p.prior.as_ref().map(|prior| check_prior(&p.name, prior, &bounds)).transpose()?;
        Ok(FreeParameter { name: p.name.clone(), bounds, prior })
    };
    written.iter().map(check).collect()
}

/// Two parameters that set one quantity, such as a stiffness and its natural frequency, cannot both be free:
/// the second would overwrite the first.
fn check_quantities(written: &[as_written::JobParameterTable]) -> Result<(), KeyRefusal> {
    let known: Vec<_> = written.iter().filter_map(|parameter| find_parameter(&parameter.name)).collect();
    for (at, second) in known.iter().enumerate() {
        if let Some(first) = known[..at].iter().find(|first| first.quantity == second.quantity) {
            refuse!(
                format!("parameter `{}`", second.name),
                "sets the same quantity as the parameter `{}`; remove one of them",
                first.name
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

// Constants of the scene that are freed within a prior: nobody knows a mass or a damping exactly.

/// Least standard deviation, %: below it a constant is better held.
const LEAST_PERCENT: f64 = 1e-4;
/// Largest, %: what is known no better is a parameter.
const MOST_PERCENT: f64 = 50.0;

/// Constants of the scene that are freed within a prior.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Constants {
    /// None: they are taken as exact.
    Exact,
    /// Every mass, inertia, stiffness, damping, preload and shoulder angle that a scene has, unlike zero, and
    /// that is neither a free parameter nor set by a condition.
    All {
        /// Relative standard deviation of each.
        sd_relative: f64,
    },
    /// Those of a list.
    Listed(Vec<NuisanceParameter>),
}

/// A constant that is freed within a prior.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NuisanceParameter {
    /// Key of the scene with its table.
    pub name: String,
    /// Standard deviation of its logarithm about the scene's value.
    pub sd_relative: f64,
}

impl Constants {
    /// Whether all are taken as exact.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::Exact
    }

    /// Names that the job lists.
    pub(super) fn listed_names(&self) -> impl Iterator<Item = &str> {
        let listed = match self {
            Self::Listed(listed) => listed.as_slice(),
            _ => &[],
        };
        listed.iter().map(|nuisance| nuisance.name.as_str())
    }
}

pub(super) fn check_constants(
    written: &as_written::JobFile,
    free: &[FreeParameter],
    known: &[&str],
) -> Result<Constants, KeyRefusal> {
    let Some(nuisance) = &written.nuisance else { return Ok(Constants::Exact) };
    if written.trace.is_empty() {
        refuse!(
            "nuisance",
            "found without a [[trace]], expected one: a dozen features do not hold so many unknowns; add a [[trace]], or free single constants as [[parameter]] with a `prior`"
        );
    }
    match nuisance {
        as_written::JobNuisanceEntry::All(text) => {
            Ok(Constants::All { sd_relative: parse_percentage("nuisance", text)? })
        }
        as_written::JobNuisanceEntry::Listed(list) => {
            Ok(Constants::Listed(check_listed_nuisances(list, free, known)?))
        }
    }
}

fn check_listed_nuisances(
    list: &[ListedNuisance],
    free: &[FreeParameter],
    known: &[&str],
) -> Result<Vec<NuisanceParameter>, KeyRefusal> {
    if list.is_empty() {
        refuse!("nuisance", "found an empty list, expected names, or a percentage such as \"3 %\"");
    }
    if let Some(name) = find_repeated(list.iter().map(|one| one.name.as_str())) {
        refuse!(format!("nuisance `{name}`"), "found twice; remove one of them");
    }
    for (at, second) in list.iter().enumerate() {
        if let Some(first) = list[..at].iter().find(|first| is_same_quantity(&first.name, &second.name)) {
            refuse!(
                format!("nuisance `{}`", second.name),
                "sets the same quantity as `{}`; remove one of them",
                first.name
            );
        }
    }
    list.iter().map(|one| check_nuisance(one, free, known)).collect()
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
        refuse!(
            key,
            "the [[parameter]] `{}` is free already; give it a `prior`, and remove it here",
            free.name
        );
    }
    let sd_relative = match (&written.sd, written.sd_relative) {
        (Some(text), None) => parse_percentage(&key, text)?,
        (None, Some(relative)) => check_percentage(&key, 100.0 * relative)?,
        _ => refuse!(key, "expected either `sd`, such as \"3 %\", or `sd_relative`, such as 0.03"),
    };
    Ok(NuisanceParameter { name: name.clone(), sd_relative })
}

/// `3 %` as 0.03.
fn parse_percentage(key: &str, text: &str) -> Result<f64, KeyRefusal> {
    let number = text.trim().strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
    let Some(percent) = number else {
        refuse!(key, "found \"{text}\", expected a percentage such as \"3 %\"");
    };
    check_percentage(key, percent)
}

/// A percentage as a share.
fn check_percentage(key: &str, percent: f64) -> Result<f64, KeyRefusal> {
    if (LEAST_PERCENT..=MOST_PERCENT).contains(&percent) {
        return Ok(percent / 100.0);
    }
    refuse!(
        key,
        "found {percent} %, expected {LEAST_PERCENT} % to {MOST_PERCENT} %: what is known no better is a [[parameter]]"
    )
}
