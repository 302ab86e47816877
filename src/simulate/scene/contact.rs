//! What a scene says of contact that is lost or jammed.

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
