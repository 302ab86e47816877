//! What is fitted: a feature, and where its target comes from.

use crate::feature::Feature;
use serde::Serialize;

/// A feature and where its target comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitTarget {
    /// What is read from measurement and model alike.
    pub feature: Feature,
    /// Where target and standard deviation come from.
    pub source: TargetSource,
    /// Relative error that passes, for a component; `None` for any other feature.
    pub tolerance_relative: Option<f64>,
    /// Whether it is only predicted, never fitted.
    pub held_out: bool,
    /// From when on it counts.
    pub stage: TargetStage,
}

/// Stages of a search in which an aim counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum TargetStage {
    /// In all of them.
    Always,
    /// In the last stage alone: the lines of a log-spectrum have many minima, and help only near the right
    /// one.
    Last,
}

/// Where a target comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum TargetSource {
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
