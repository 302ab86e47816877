//! The tables of a run.

use schemars::JsonSchema;
use serde::Deserialize;

/// What `simulate` writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Output {
    /// `trace.csv`.
    Trace,
    /// `state.csv`.
    State,
    /// `events.csv`.
    Events,
}
