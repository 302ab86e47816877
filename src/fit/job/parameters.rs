//! Free parameters of a job: bounds, and what is known before any recording is read.

use super::as_written;
use super::refusal::{JobRefusal, check_above_zero, find_repeated, refuse};
use crate::blade::parameters::find_parameter;
use crate::fit::axis::Prior;
use crate::fit::scale::{Bounds, BoundsSpacing};
use crate::math;
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

pub(super) fn check_parameters(
    written: &[as_written::JobParameterTable],
    known: &[&str],
) -> Result<Vec<FreeParameter>, JobRefusal> {
    if written.is_empty() {
        return refuse("parameter", "found none, expected at least one [[parameter]] to fit");
    }
    if let Some(name) = find_repeated(written.iter().map(|p| p.name.as_str())) {
        return refuse(format!("parameter `{name}`"), "found twice; remove one of them");
    }
    check_quantities(written)?;
    let check = |p: &as_written::JobParameterTable| {
        if !known.contains(&p.name.as_str()) {
            return refuse(
                format!("parameter `{}`", p.name),
                format!("not a parameter of a scene; {}", suggest_key(&p.name, known)),
            );
        }
        let bounds = Bounds::new(p.lower, p.upper, p.scale)
            .map_err(|problem| JobRefusal::Bounds { name: p.name.clone(), problem })?;
        let prior = p.prior.as_ref().map(|prior| check_prior(&p.name, prior, &bounds)).transpose()?;
        Ok(FreeParameter { name: p.name.clone(), bounds, prior })
    };
    written.iter().map(check).collect()
}

/// Two parameters that set one quantity, such as a stiffness and its natural frequency, cannot both be free:
/// the second would overwrite the first.
fn check_quantities(written: &[as_written::JobParameterTable]) -> Result<(), JobRefusal> {
    let known: Vec<_> = written.iter().filter_map(|parameter| find_parameter(&parameter.name)).collect();
    for (at, second) in known.iter().enumerate() {
        if let Some(first) = known[..at].iter().find(|first| first.quantity == second.quantity) {
            return refuse(
                format!("parameter `{}`", second.name),
                format!("sets the same quantity as the parameter `{}`; remove one of them", first.name),
            );
        }
    }
    Ok(())
}

fn check_prior(
    name: &str,
    written: &as_written::JobPriorTable,
    bounds: &Bounds,
) -> Result<Prior, JobRefusal> {
    let key = |key: &str| format!("parameter `{name}`, `prior.{key}`");
    let (mean, lower, upper) = (written.mean, bounds.lower(), bounds.upper());
    if !(lower..=upper).contains(&mean) {
        return refuse(
            key("mean"),
            format!(
                "found {mean}, expected a number within the bounds, {lower} to {upper}; move the bounds or correct it"
            ),
        );
    }
    let relative = match (written.sd, written.sd_relative) {
        (Some(sd), None) => check_above_zero(key("sd"), sd)? / mean.abs(),
        (None, Some(relative)) => check_above_zero(key("sd_relative"), relative)?,
        _ => {
            return refuse(
                key("sd"),
                "expected either `sd`, in the parameter's unit, or `sd_relative`, a share of the mean; give one of them",
            );
        }
    };
    match bounds.spacing() {
        BoundsSpacing::Log => Ok(Prior::Log { mean_ln: math::ln(mean), sd_ln: relative }),
        BoundsSpacing::Linear if written.sd.is_none() && mean == 0.0 => refuse(
            key("sd_relative"),
            "found a share of a mean of 0; give `sd` in the parameter's unit instead",
        ),
        BoundsSpacing::Linear => Ok(Prior::Linear { mean, sd: written.sd.unwrap_or(relative * mean.abs()) }),
    }
}
