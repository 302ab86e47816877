//! What ends a run, and which tables it writes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What happens when the normal force reaches zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactLossRule {
    /// The run ends and says so.
    #[default]
    Stop,
    /// The tip flies and lands.
    Fly,
}

/// What happens when the Painlevé condition fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JamRule {
    /// The run ends and says so.
    #[default]
    Stop,
    /// An impact without collision.
    Impact,
}

/// What `simulate` writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OutputTable {
    /// `trace.csv`.
    Trace,
    /// `state.csv`.
    State,
    /// `events.csv`.
    Events,
}
