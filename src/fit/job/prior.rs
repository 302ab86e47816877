//! What is known of a parameter before any recording is looked at.

use super::{Refusal, above_zero, as_written, refuse};
use crate::fit::scale::{Bounds, Spacing};

/// A normal distribution of a parameter, or of its logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Prior {
    /// Of the parameter, in its own SI unit.
    Linear {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
    /// Of its natural logarithm (a parameter with a logarithmic scale).
    Log {
        /// Mean of the logarithm of the parameter in its SI unit.
        mean_ln: f64,
        /// Standard deviation of the logarithm.
        sd_ln: f64,
    },
}

impl Prior {
    /// Distance of a value, in the parameter's SI unit, from the mean, in standard deviations.
    #[must_use]
    pub fn residual(&self, value: f64) -> f64 {
        match *self {
            Self::Linear { mean, sd } => (value - mean) / sd,
            Self::Log { mean_ln, sd_ln } => (value.ln() - mean_ln) / sd_ln,
        }
    }
}

pub(super) fn prior(name: &str, written: &as_written::Prior, bounds: &Bounds) -> Result<Prior, Refusal> {
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
        Spacing::Log => Ok(Prior::Log { mean_ln: mean.ln(), sd_ln: relative }),
        Spacing::Linear if written.sd.is_none() && mean == 0.0 => refuse(
            key("sd_relative"),
            "found a share of a mean of 0; give `sd` in the parameter's unit instead",
        ),
        Spacing::Linear => Ok(Prior::Linear { mean, sd: written.sd.unwrap_or(relative * mean.abs()) }),
    }
}
