//! A free parameter as the search sees it: its range, and what is known of it beforehand.

use super::scale::Bounds;
use crate::math;
use serde::Serialize;

/// A free parameter as the search sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchAxis {
    /// Its range.
    pub bounds: Bounds,
    /// What is known of it beforehand.
    pub prior: Option<Prior>,
}

impl From<Bounds> for SearchAxis {
    fn from(bounds: Bounds) -> Self {
        Self { bounds, prior: None }
    }
}

/// A normal distribution of a parameter, or of its logarithm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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
            Self::Log { mean_ln, sd_ln } => (math::ln(value) - mean_ln) / sd_ln,
        }
    }
}
