//! Rules for events that may end a run, and the tables that a run writes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What happens when the normal force reaches zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactLossRule {
    /// The run ends and reports the loss of contact.
    #[default]
    Stop,
    /// The tip flies and lands again.
    Fly,
}

/// What happens when the Painlevé condition fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JamRule {
    /// The run ends and reports the jam.
    #[default]
    Stop,
    /// The jam is resolved as an impact without collision.
    Impact,
}

/// A table that `simulate` writes.
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
