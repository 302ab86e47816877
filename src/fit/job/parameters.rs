//! Free parameters of a job: bounds, and what is known before any recording is read.

use super::as_written;
use super::refusal::{Refusal, above_zero, refuse, repeated};
use crate::blade::parameters::find;
use crate::fit::axis::Prior;
use crate::fit::scale::{Bounds, Spacing};
use crate::math;
use crate::toml_file::nearest;
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

pub(super) fn parameters(
    written: &[as_written::Parameter],
    known: &[&str],
) -> Result<Vec<FreeParameter>, Refusal> {
    if written.is_empty() {
        return refuse("parameter", "found none, expected at least one [[parameter]] to fit");
    }
    if let Some(name) = repeated(written.iter().map(|p| p.name.as_str())) {
        return refuse(format!("parameter `{name}`"), "found twice; remove one of them");
    }
    check_quantities(written)?;
    let check = |p: &as_written::Parameter| {
        if !known.contains(&p.name.as_str()) {
            return refuse(
                format!("parameter `{}`", p.name),
                format!("not a parameter of a scene; {}", nearest(&p.name, known)),
            );
        }
        let bounds = Bounds::new(p.lower, p.upper, p.scale)
            .map_err(|problem| Refusal::Bounds { name: p.name.clone(), problem })?;
        let prior = p.prior.as_ref().map(|prior| prior_of(&p.name, prior, &bounds)).transpose()?;
        Ok(FreeParameter { name: p.name.clone(), bounds, prior })
    };
    written.iter().map(check).collect()
}

/// Two parameters that set one quantity, such as a stiffness and its natural frequency, cannot both be free:
/// the second would overwrite the first.
fn check_quantities(written: &[as_written::Parameter]) -> Result<(), Refusal> {
    let known: Vec<_> = written.iter().filter_map(|parameter| find(&parameter.name)).collect();
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

fn prior_of(name: &str, written: &as_written::Prior, bounds: &Bounds) -> Result<Prior, Refusal> {
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
        (Some(sd), None) => above_zero(key("sd"), sd)? / mean.abs(),
        (None, Some(relative)) => above_zero(key("sd_relative"), relative)?,
        _ => {
            return refuse(
                key("sd"),
                "expected either `sd`, in the parameter's unit, or `sd_relative`, a share of the mean; give one of them",
            );
        }
    };
    match bounds.spacing() {
        Spacing::Log => Ok(Prior::Log { mean_ln: math::ln(mean), sd_ln: relative }),
        Spacing::Linear if written.sd.is_none() && mean == 0.0 => refuse(
            key("sd_relative"),
            "found a share of a mean of 0; give `sd` in the parameter's unit instead",
        ),
        Spacing::Linear => Ok(Prior::Linear { mean, sd: written.sd.unwrap_or(relative * mean.abs()) }),
    }
}
